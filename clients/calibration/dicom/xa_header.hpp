// What the header of a DICOM X-ray angiogram (XA) says of the C-arm. No pixel and no patient's field is read.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "clients/calibration/c_arm_fit.hpp"
#include "clients/calibration/configuration_fragment.hpp"
#include "idl/geometry/c_arm.hpp"

namespace tubed {

/// One number that the header has, or has not.
struct XaAttribute {
  std::string name;  ///< "DistanceSourceToDetector"
  std::string tag;   ///< "(0018,1110)"
  std::string unit;
  std::vector<double> values;  ///< empty: missing, or no number

  [[nodiscard]] bool is_there() const { return !values.empty(); }
};

struct XaHeader {
  std::string file;
  int rows = 0, columns = 0;  ///< px
  int frames = 1;
  std::vector<XaAttribute> attributes;  ///< all that were looked for, in the order of the standard
  std::vector<GantryAngles> angles;     ///< one a frame, or of the first frames only; empty: not stated
  /// What a C-arm model can be made of, at the first frame; nothing while a distance or the pitch is missing.
  std::optional<CArm> c_arm;
  std::vector<std::string> remarks;  ///< what was taken for what, and what is missing

  [[nodiscard]] const XaAttribute& attribute(const std::string& name) const;
};

/// Reads a header by DCMTK. Throws PhantomError for a file that cannot be read, is no DICOM, or of
/// another modality than XA (or RF, radio fluoroscopy, which has the same positioner).
XaHeader read_xa_header(const std::filesystem::path& file);

/// c_arm.* of that camera. Throws PhantomError, naming what is missing, when there is no C-arm.
ConfigurationFragment fragment_of(const XaHeader& header, const std::string& camera);

}  // namespace tubed
