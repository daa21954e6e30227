#include "clients/tubectl/run/grab_dicom.hpp"

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <iostream>
#include <stdexcept>
#include <utility>

#include "clients/tubectl/run/grab_view.hpp"
#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/replay/playhead_over.hpp"
#include "drivers/replay/sequence_writer.hpp"
#ifdef TUBED_READS_DICOM_RUNS
#include "clients/dicom/dicom_run.hpp"
#include "clients/tubectl/run/dicom_geometry.hpp"
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

/// Poses of the run's angles, where a configuration is there to say where the C-arm stands.
void add_poses(DicomRun& run, const std::string& config, const std::string& camera, ReplayedView& view) {
  if (config.empty()) {
    run.remarks.emplace_back("images are sent without poses: --config gives them those of the run's angles");
    return;
  }
  DicomGeometries geometries = geometries_of(run, config, camera);
  std::size_t posed = 0;
  for (std::size_t i = 0; i < view.rows.size(); ++i) {
    view.rows[i].geometry = geometries.of_frames[i];
    posed += geometries.of_frames[i] ? 1 : 0;
  }
  run.remarks.push_back(std::to_string(posed) + " images are sent with the poses of their angles");
  run.remarks.insert(run.remarks.end(), geometries.remarks.begin(), geometries.remarks.end());
}

void tell(const DicomRun& run, const DicomGrabArguments& arguments) {
  std::cerr << "tubectl: camera " << arguments.camera << ' ' << run.width << " x " << run.height << " of "
            << run.bits_stored << " bits, " << run.frames.size() << " images, " << 1 / run.period_s
            << " a second, at " << arguments.socket << '\n';
  for (const std::string& remark : run.remarks) std::cerr << "tubectl: " << remark << '\n';
}

/// The camera that the run's images are of, in the coils' recording.
int camera_of(const Sequence& coils, const DicomFolderArguments& arguments, const DicomRun& run) {
  const auto& cameras = coils.room.cameras;
  const auto found = arguments.camera.empty()
                         ? cameras.begin()
                         : std::find_if(cameras.begin(), cameras.end(), [&](const CameraCalibration& each) {
                             return each.name == arguments.camera;
                           });
  if (found == cameras.end()) {
    throw std::runtime_error(arguments.coils + " has no camera '" + arguments.camera + "'");
  }
  if (found->width != run.width || found->height != run.height) {
    throw std::runtime_error(arguments.run + " is " + std::to_string(run.width) + " x " +
                             std::to_string(run.height) + ", camera '" + found->name + "' of " +
                             arguments.coils + " " + std::to_string(found->width) + " x " +
                             std::to_string(found->height) + ": expected the same");
  }
  return static_cast<int>(found - cameras.begin());
}

}  // namespace

std::size_t write_dicom_folder(const DicomFolderArguments& arguments) {
  const Sequence coils = read_sequence(arguments.coils);
  DicomRunOptions options;
  options.rate_hz = arguments.rate_hz;
  DicomRun run = read_dicom_run(arguments.run, options);
  const int camera = camera_of(coils, arguments, run);
  const std::string& name = coils.room.cameras[static_cast<std::size_t>(camera)].name;
  ReplayedView view = view_of(run);
  add_poses(run, arguments.config, name, view);
  const auto& measured = coils.measurements;
  const double end_s = arguments.at_s + run.frames.back().t_s;
  if (measured.empty() || measured.back().t_s < arguments.at_s || measured.front().t_s > end_s) {
    throw std::runtime_error("at " + std::to_string(arguments.at_s) + " to " + std::to_string(end_s) +
                             " s no coil of " + arguments.coils +
                             " was measured: expected --at on that recording's clock");
  }
  if (std::filesystem::exists(arguments.into) && !std::filesystem::is_empty(arguments.into)) {
    throw std::runtime_error(arguments.into + " is not empty: give a new folder");
  }
  SequenceWriter writer(arguments.into, "coils of " + arguments.coils + ", images of " + arguments.run,
                        coils.room);
  for (std::size_t i = 0; i < view.rows.size(); ++i) {
    const SequenceFrame& row = view.rows[i];
    writer.add_exposure(row.frame, arguments.at_s + row.t_s, camera, view.images[i]);
    if (row.geometry) writer.add_geometry(row.frame, *row.geometry);
  }
  for (const SequenceMeasurement& measurement : coils.measurements) writer.add_measurement(measurement);
  writer.finish();
  for (const std::string& remark : run.remarks) std::cerr << "tubectl: " << remark << '\n';
  return view.rows.size();
}

std::uint64_t grab_dicom(const DicomGrabArguments& arguments,
                         const volatile std::sig_atomic_t& is_asked_to_end) {
  DicomRunOptions options;
  options.rate_hz = arguments.rate_hz;
  DicomRun run = read_dicom_run(arguments.run, options);
  ReplayedView view = view_of(run);
  add_poses(run, arguments.config, arguments.camera, view);
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

namespace {
constexpr char kWithoutDcmtk[] =
    "this tubectl was built without DCMTK: install libdcmtk-dev and build it again, or play a sequence "
    "folder";
}  // namespace

std::size_t write_dicom_folder(const DicomFolderArguments& /*arguments*/) {
  throw std::runtime_error(kWithoutDcmtk);
}

std::uint64_t grab_dicom(const DicomGrabArguments& /*arguments*/,
                         const volatile std::sig_atomic_t& /*is_asked_to_end*/) {
  throw std::runtime_error(kWithoutDcmtk);
}

#endif

}  // namespace tubed
