#include "clients/tubectl/run/grab_dicom.hpp"

#include <chrono>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "clients/tubectl/run/grab_view.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead_over.hpp"
#ifdef TUBED_READS_DICOM_RUNS
#include "clients/dicom/dicom_run.hpp"
#endif

namespace tubed {

#ifdef TUBED_READS_DICOM_RUNS

namespace {

constexpr std::chrono::milliseconds kBeforeTheFirst{300};

ReplayedView view_of(DicomRun& run) {
  ReplayedView view;
  view.decoded = true;
  std::uint32_t number = 0;
  for (DicomFrame& frame : run.frames) {
    SequenceFrame row;
    row.frame = number++;
    row.t_s = frame.t_s;
    row.file = "dicom";  // not empty: fluoroscopy is on
    view.rows.push_back(std::move(row));
    view.images.push_back({run.width, run.height, run.depth, std::move(frame.pixels)});
  }
  return view;
}

Playhead playhead_of(const ReplayedView& view, const DicomRun& run, const DicomGrabArguments& arguments) {
  ReplayedFolder timing;
  timing.lap = to_nanoseconds(run.frames.back().t_s + run.period_s);
  timing.start = monotonic_now() + kBeforeTheFirst;
  const DriverSettings settings(
      {{"loop", arguments.loop}, {"start_monotonic_ns", arguments.start_monotonic_ns}});
  return playhead_over(view.rows, timing, settings);
}

void tell(const DicomRun& run, const DicomGrabArguments& arguments) {
  std::cerr << "tubectl: camera " << arguments.camera << ' ' << run.width << " x " << run.height << " of "
            << run.bits_stored << " bits, " << run.frames.size() << " images, " << 1 / run.period_s
            << " a second, at " << arguments.socket << '\n';
  for (const std::string& remark : run.remarks) std::cerr << "tubectl: " << remark << '\n';
}

}  // namespace

std::uint64_t grab_dicom(const DicomGrabArguments& arguments,
                         const volatile std::sig_atomic_t& is_asked_to_end) {
  DicomRunOptions options;
  options.rate_hz = arguments.rate_hz;
  DicomRun run = read_dicom_run(arguments.run, options);
  const ReplayedView view = view_of(run);
  ShmImageWriter writer({.socket = arguments.socket,
                         .camera = arguments.camera,
                         .max_width = static_cast<std::uint32_t>(run.width),
                         .max_height = static_cast<std::uint32_t>(run.height),
                         .max_depth_bits = 16,
                         .group = arguments.group});
  tell(run, arguments);
  return write_view(view, playhead_of(view, run, arguments), writer, arguments.end, is_asked_to_end);
}

#else

std::uint64_t grab_dicom(const DicomGrabArguments& /*arguments*/,
                         const volatile std::sig_atomic_t& /*is_asked_to_end*/) {
  throw std::runtime_error(
      "this tubectl was built without DCMTK: install libdcmtk-dev and build it again, or play a sequence "
      "folder");
}

#endif

}  // namespace tubed
