// tubectl geometry xa: what the header of an angiogram says of the C-arm.
#include <iomanip>
#include <iostream>
#include <memory>
#include <optional>
#include <sstream>

#include "clients/tubectl/calibrate/accept_options.hpp"
#include "clients/tubectl/verbs.hpp"
#ifdef TUBED_READS_XA
#include "clients/calibration/dicom/xa_header.hpp"
#include "daemon/config/load_configuration.hpp"
#endif

namespace tubed {

namespace {

struct XaOptions {
  std::string file;
  std::string camera;
  AcceptOptions accept;
};

#ifdef TUBED_READS_XA
void print(const XaHeader& header) {
  std::cerr << header.file << ": " << header.columns << " x " << header.rows << " px, " << header.frames
            << (header.frames == 1 ? " frame\n" : " frames\n");
  for (const XaAttribute& attribute : header.attributes) {
    std::cerr << "  " << std::left << std::setw(36) << attribute.name << attribute.tag << "  ";
    if (!attribute.is_there()) std::cerr << "missing";
    constexpr std::size_t kShown = 4;
    for (std::size_t i = 0; i < std::min(kShown, attribute.values.size()); ++i) {
      std::cerr << (i == 0 ? "" : ", ") << attribute.values[i];
    }
    if (attribute.values.size() > kShown) std::cerr << ", ... (" << attribute.values.size() << ")";
    std::cerr << (attribute.is_there() ? " " + attribute.unit : "") << '\n';
  }
  for (const std::string& remark : header.remarks) std::cerr << "  " << remark << '\n';
}

/// What images of another size than the configured camera's mean for the pitch; empty: they have its size.
std::string other_size(const XaHeader& header, const CameraCalibration& camera, const std::string& config) {
  if (camera.width == header.columns && camera.height == header.rows) return "";
  std::ostringstream words;
  words
      << "WARNING: " << header.file << " has images of " << header.columns << " x " << header.rows
      << " px, camera \"" << camera.name << "\" of " << config << " of " << camera.width << " x "
      << camera.height
      << " px: pixel_pitch_mm is of the file's pixels. Where the daemon gets images of the file's size, set "
         "width, height, cx and cy; where it gets them scaled, scale the pitch";
  return words.str();
}

/// The camera as it would be with the fragment: one that waits for its c_arm is no configuration before.
std::optional<CameraCalibration> resulting_camera(const ConfigurationFragment& fragment,
                                                  const XaOptions& options) {
  const std::string& config = options.accept.config;
  if (config.empty()) return std::nullopt;
  try {
    const Configuration result = parse_configuration(accept_into(config, fragment).text, config);
    for (const CameraCalibration& camera : result.room.cameras) {
      if (camera.name == options.camera) return camera;
    }
  } catch (const FragmentError&) {
    return std::nullopt;  // offer() says what is wrong, once the fragment has been shown
  }
  return std::nullopt;
}

ConfigurationFragment checked_fragment(const XaHeader& header, const XaOptions& options) {
  ConfigurationFragment fragment = fragment_of(header, options.camera);
  const auto camera = resulting_camera(fragment, options);
  const std::string words = camera ? other_size(header, *camera, options.accept.config) : "";
  if (!words.empty()) {
    std::cerr << words << '\n';
    fragment.remarks.push_back(words);
  }
  return fragment;
}
#endif

int show_xa(const XaOptions& options) {
#ifdef TUBED_READS_XA
  try {
    const XaHeader header = read_xa_header(options.file);
    print(header);
    return offer(checked_fragment(header, options), options.accept);
  } catch (const std::runtime_error& error) {
    std::cerr << "tubectl: " << error.what() << '\n';
    return kExitBadData;
  }
#else
  std::cerr
      << "tubectl: " << options.file
      << ": this tubectl was built without DCMTK: install libdcmtk-dev and build again for geometry xa\n";
  return kExitUnavailable;
#endif
}

}  // namespace

CommandLine add_geometry(CommandLine app, int& exit_code) {
  CommandLine verb = app.add_subcommand("geometry", "Take a C-arm's geometry from what states it");
  verb.require_subcommand();
  const auto options = std::make_shared<XaOptions>();
  CommandLine xa =
      verb.add_subcommand("xa", "From the header of a DICOM angiogram (XA); no patient's field is read");
  xa.add_option("FILE", options->file, "DICOM file").required();
  xa.add_option("--camera", options->camera, "Its name in the configuration").required();
  add_fragment_options(xa, options->accept);
  xa.footer("Example:\n  tubectl geometry xa angiogram.dcm --camera A --out c-arm.toml");
  xa.callback([options, &exit_code] { exit_code = show_xa(*options); });
  return verb;
}

}  // namespace tubed
