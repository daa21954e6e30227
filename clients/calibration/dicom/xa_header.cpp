#include "clients/calibration/dicom/xa_header.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "clients/calibration/calibration_picture.hpp"

namespace tubed {

namespace {

struct Wanted {
  const char* name;
  DcmTagKey tag;
  const char* unit;
};

/// PS3.3 C.8.7.5 (XA Positioner), C.8.7.3 (XA Acquisition), C.8.7.4 (table), C.8.19.3 (enhanced XA); none of
/// a patient's module.
const std::vector<Wanted>& wanted() {
  static const std::vector<Wanted> all{
      {"DistanceSourceToDetector", DCM_DistanceSourceToDetector, "mm"},
      {"DistanceSourceToPatient", DCM_DistanceSourceToPatient, "mm"},
      {"DistanceSourceToIsocenter", DCM_DistanceSourceToIsocenter, "mm"},
      {"ImagerPixelSpacing", DCM_ImagerPixelSpacing, "mm"},
      {"FieldOfViewDimensions", DCM_FieldOfViewDimensions, "mm"},
      {"IntensifierSize", DCM_IntensifierSize, "mm"},
      {"PositionerPrimaryAngle", DCM_PositionerPrimaryAngle, "deg"},
      {"PositionerSecondaryAngle", DCM_PositionerSecondaryAngle, "deg"},
      {"PositionerPrimaryAngleIncrement", DCM_PositionerPrimaryAngleIncrement, "deg"},
      {"PositionerSecondaryAngleIncrement", DCM_PositionerSecondaryAngleIncrement, "deg"},
      {"TableTopVerticalPosition", DCM_TableTopVerticalPosition, "mm"},
      {"TableTopLongitudinalPosition", DCM_TableTopLongitudinalPosition, "mm"},
      {"TableTopLateralPosition", DCM_TableTopLateralPosition, "mm"}};
  return all;
}

std::string tag_words(const DcmTagKey& tag) {
  std::ostringstream text;
  text << std::hex << std::setfill('0') << '(' << std::setw(4) << tag.getGroup() << ',' << std::setw(4)
       << tag.getElement() << ')';
  return text.str();
}

/// Anywhere in the data set: enhanced XA keeps them in sequences of shared and per-frame groups.
XaAttribute read_attribute(DcmDataset& dataset, const Wanted& what) {
  XaAttribute attribute{what.name, tag_words(what.tag), what.unit, {}};
  constexpr unsigned long kMaxValues = 100000;
  for (unsigned long i = 0; i < kMaxValues; ++i) {
    Float64 value = 0;
    if (dataset.findAndGetFloat64(what.tag, value, i, OFTrue).bad() || !std::isfinite(value)) break;
    attribute.values.push_back(value);
  }
  return attribute;
}

int read_count(DcmDataset& dataset, const DcmTagKey& tag) {
  Uint16 value = 0;
  return dataset.findAndGetUint16(tag, value).good() ? value : 0;
}

/// Increments are relative to the angle of the first frame (PS3.3 C.8.7.5.1.3); without any the C-arm stands.
/// Angles end with the shorter list where there are fewer increments than frames.
std::vector<GantryAngles> angles_of(const XaHeader& header) {
  const XaAttribute& primary = header.attribute("PositionerPrimaryAngle");
  const XaAttribute& secondary = header.attribute("PositionerSecondaryAngle");
  if (!primary.is_there() || !secondary.is_there()) return {};
  const XaAttribute& primary_steps = header.attribute("PositionerPrimaryAngleIncrement");
  const XaAttribute& secondary_steps = header.attribute("PositionerSecondaryAngleIncrement");
  std::vector<GantryAngles> angles;
  for (std::size_t frame = 0; frame < static_cast<std::size_t>(header.frames); ++frame) {
    const auto ends = [frame](const XaAttribute& steps) {
      return steps.is_there() && frame >= steps.values.size();
    };
    if (ends(primary_steps) || ends(secondary_steps)) break;
    const auto at = [frame](const XaAttribute& steps) {
      return steps.is_there() ? steps.values[frame] : 0.0;
    };
    angles.push_back({primary.values[0] + at(primary_steps), secondary.values[0] + at(secondary_steps)});
  }
  return angles;
}

/// Enhanced XA: each frame may have angles of its own (PS3.3 C.8.19.6.10), those of the groups that all
/// frames share are found by read_attribute(). Empty where the frames have none.
std::vector<GantryAngles> angles_of_groups(DcmDataset& dataset, int frames) {
  std::vector<GantryAngles> angles;
  DcmItem* group = nullptr;
  for (int frame = 0; frame < frames; ++frame) {
    GantryAngles of_frame;
    if (dataset.findAndGetSequenceItem(DCM_PerFrameFunctionalGroupsSequence, group, frame).bad() ||
        group == nullptr ||
        group->findAndGetFloat64(DCM_PositionerPrimaryAngle, of_frame.primary_deg, 0, OFTrue).bad() ||
        group->findAndGetFloat64(DCM_PositionerSecondaryAngle, of_frame.secondary_deg, 0, OFTrue).bad() ||
        !std::isfinite(of_frame.primary_deg) || !std::isfinite(of_frame.secondary_deg)) {
      break;
    }
    angles.push_back(of_frame);
  }
  return angles;
}

/// Zoomed images state the pitch of what is shown: no zoom beside it. Without a pitch, the field over the
/// pixels says it.
std::optional<double> pitch_mm(XaHeader& header) {
  const XaAttribute& spacing = header.attribute("ImagerPixelSpacing");
  if (spacing.is_there()) {
    if (spacing.values.size() > 1 && std::abs(spacing.values[0] / spacing.values[1] - 1) > 1e-3) {
      header.remarks.emplace_back(
          "ImagerPixelSpacing differs between rows and columns: that of the columns is used");
      return spacing.values[1];
    }
    return spacing.values[0];
  }
  const XaAttribute& field = header.attribute("FieldOfViewDimensions");
  const XaAttribute& intensifier = header.attribute("IntensifierSize");
  const double side_mm = field.is_there()         ? field.values[0]
                         : intensifier.is_there() ? intensifier.values[0]
                                                  : 0;
  if (side_mm > 0 && header.columns > 0) {
    header.remarks.push_back("ImagerPixelSpacing " + spacing.tag + " is missing: the pitch is " +
                             (field.is_there() ? field.name : intensifier.name) +
                             " over the number of columns");
    return side_mm / header.columns;
  }
  header.remarks.push_back("missing: " + spacing.name + " " + spacing.tag + ", the pitch of the pixels");
  return std::nullopt;
}

std::optional<double> isocentre_mm(XaHeader& header) {
  const XaAttribute& isocentre = header.attribute("DistanceSourceToIsocenter");
  if (isocentre.is_there()) return isocentre.values[0];
  const XaAttribute& patient = header.attribute("DistanceSourceToPatient");
  if (patient.is_there()) {
    header.remarks.push_back("DistanceSourceToIsocenter " + isocentre.tag +
                             " is missing: taken from DistanceSourceToPatient " + patient.tag +
                             ", which is the isocentre's only where the patient lies in it");
    return patient.values[0];
  }
  header.remarks.push_back("missing: DistanceSourceToIsocenter " + isocentre.tag +
                           " and DistanceSourceToPatient " + patient.tag);
  return std::nullopt;
}

/// A pitch without zoom beside a smaller field that is shown.
double zoom_of(XaHeader& header, double pitch_mm) {
  const XaAttribute& field = header.attribute("FieldOfViewDimensions");
  if (!header.attribute("ImagerPixelSpacing").is_there() || !field.is_there() || header.columns == 0)
    return 1;
  const double zoom = pitch_mm * header.columns / field.values[0];
  constexpr double kSame = 0.05;
  if (!(zoom > 0.1 && zoom < 20) || std::abs(zoom - 1) < kSame) return 1;
  header.remarks.emplace_back(
      "ImagerPixelSpacing times the columns is not FieldOfViewDimensions: the ratio is taken for the zoom; "
      "compare with an object of known size");
  return zoom;
}

void check_ranges(const CArm& c_arm, XaHeader& header) {
  for (const BoundKey<CArm>& bound : c_arm_keys()) {
    const auto check = [&](const char* name, double value) {
      if (bound.key.name == name && (value < bound.key.minimum || value > bound.key.maximum)) {
        std::ostringstream words;
        words << name << " would be " << value << ", the configuration takes " << expectation(bound.key)
              << "; are these metres?";
        header.remarks.push_back(words.str());
        header.c_arm.reset();
      }
    };
    check("source_detector_mm", c_arm.source_detector_mm);
    check("source_isocentre_mm", c_arm.source_isocentre_mm);
    check("pixel_pitch_mm", c_arm.pixel_pitch_mm);
    check("primary_angle_deg", c_arm.primary_angle_deg);
    check("secondary_angle_deg", c_arm.secondary_angle_deg);
  }
  if (header.c_arm && c_arm.source_isocentre_mm >= c_arm.source_detector_mm) {
    header.remarks.emplace_back(
        "the isocentre is not nearer the source than the detector: one of them is wrong");
    header.c_arm.reset();
  }
}

void make_c_arm(XaHeader& header) {
  const XaAttribute& detector = header.attribute("DistanceSourceToDetector");
  if (!detector.is_there()) header.remarks.push_back("missing: DistanceSourceToDetector " + detector.tag);
  const auto pitch = pitch_mm(header);
  const auto isocentre = isocentre_mm(header);
  if (header.angles.empty()) header.angles = angles_of(header);
  if (header.angles.empty()) {
    header.remarks.emplace_back(
        "missing: PositionerPrimaryAngle (0018,1510) or PositionerSecondaryAngle (0018,1511); taken for 0");
  }
  for (const char* const axis :
       {"TableTopVerticalPosition", "TableTopLongitudinalPosition", "TableTopLateralPosition"}) {
    if (header.attribute(axis).is_there()) {
      header.remarks.emplace_back(
          "the table's position is printed and not offered: table_mm counts from where the world was "
          "registered");
      break;
    }
  }
  if (!detector.is_there() || !pitch || !isocentre) return;
  CArm c_arm;
  c_arm.source_detector_mm = detector.values[0];
  c_arm.source_isocentre_mm = *isocentre;
  c_arm.pixel_pitch_mm = *pitch;
  c_arm.zoom = zoom_of(header, *pitch);
  if (!header.angles.empty()) {
    c_arm.primary_angle_deg = header.angles[0].primary_deg;
    c_arm.secondary_angle_deg = header.angles[0].secondary_deg;
  }
  header.c_arm = c_arm;
  check_ranges(c_arm, header);
}

}  // namespace

const XaAttribute& XaHeader::attribute(const std::string& name) const {
  return *std::find_if(attributes.begin(), attributes.end(),
                       [&](const XaAttribute& attribute) { return attribute.name == name; });
}

XaHeader read_xa_header(const std::filesystem::path& file) {
  DcmFileFormat format;
  const OFCondition read =
      format.loadFile(file.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength, ERM_autoDetect);
  if (read.bad()) {
    throw PhantomError(file.string() + ": is no DICOM file that can be read (" + read.text() + ")");
  }
  DcmDataset& dataset = *format.getDataset();
  OFString modality;
  if (dataset.findAndGetOFString(DCM_Modality, modality).bad() || (modality != "XA" && modality != "RF")) {
    throw PhantomError(file.string() + ": is of modality \"" + modality.c_str() +
                       "\", expected XA or RF: an angiogram of the C-arm");
  }
  XaHeader header;
  header.file = file.string();
  header.rows = read_count(dataset, DCM_Rows);
  header.columns = read_count(dataset, DCM_Columns);
  Sint32 frames = 1;
  if (dataset.findAndGetSint32(DCM_NumberOfFrames, frames).good()) {
    constexpr Sint32 kMaxFrames = 100000;
    header.frames = std::clamp<Sint32>(frames, 1, kMaxFrames);
  }
  for (const Wanted& what : wanted()) header.attributes.push_back(read_attribute(dataset, what));
  header.angles = angles_of_groups(dataset, header.frames);
  make_c_arm(header);
  return header;
}

ConfigurationFragment fragment_of(const XaHeader& header, const std::string& camera) {
  if (!header.c_arm) {
    std::string words = header.file + ": no C-arm can be made of it";
    for (const std::string& remark : header.remarks) words += "; " + remark;
    throw PhantomError(words);
  }
  ConfigurationFragment fragment;
  fragment.found_by = "tubectl geometry xa";
  fragment.date = date_of_today();
  fragment.remarks = header.remarks;
  fragment.remarks.emplace_back("stated by the console, not measured: see tubectl calibrate camera");
  const std::string table = "camera[" + camera + "].c_arm.";
  fragment.values = {{table + "source_detector_mm", header.c_arm->source_detector_mm},
                     {table + "source_isocentre_mm", header.c_arm->source_isocentre_mm},
                     {table + "pixel_pitch_mm", header.c_arm->pixel_pitch_mm},
                     {table + "primary_angle_deg", header.c_arm->primary_angle_deg},
                     {table + "secondary_angle_deg", header.c_arm->secondary_angle_deg}};
  if (header.c_arm->zoom != 1) fragment.values.push_back({table + "zoom", header.c_arm->zoom});
  return fragment;
}

}  // namespace tubed
