#include "drivers/laboratory/fluoroscope/dicom/ct_slice.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <Eigen/Geometry>
#include <cmath>
#include <sstream>

#include "drivers/laboratory/fluoroscope/dicom/ct_series.hpp"

namespace tubed {

namespace {

/// Reads attributes of one file; what is missing is an error that names file and attribute.
class Attributes {
 public:
  Attributes(DcmDataset& dataset, const std::filesystem::path& file) : dataset_(dataset), file_(file) {}

  [[noreturn]] void refuse(const std::string& why) const {
    throw CtSeriesError("CT series: " + file_.string() + ": " + why);
  }
  std::string text(const DcmTagKey& tag, const char* name) const {
    OFString value;
    if (dataset_.findAndGetOFString(tag, value).bad() || value.empty()) {
      refuse(std::string("has no ") + name);
    }
    return value.c_str();
  }
  double number(const DcmTagKey& tag, const char* name, unsigned long index = 0) const {
    Float64 value = 0;
    if (dataset_.findAndGetFloat64(tag, value, index).bad() || !std::isfinite(value)) {
      refuse(std::string("has no usable ") + name);
    }
    return value;
  }
  double number_or(const DcmTagKey& tag, double otherwise) const {
    Float64 value = otherwise;
    return dataset_.findAndGetFloat64(tag, value).good() ? value : otherwise;
  }
  int count(const DcmTagKey& tag, const char* name) const {
    Uint16 value = 0;
    if (dataset_.findAndGetUint16(tag, value).bad()) {
      refuse(std::string("has no ") + name);
    }
    return value;
  }
  Eigen::Vector3d vector(const DcmTagKey& tag, const char* name, unsigned long first = 0) const {
    return {number(tag, name, first), number(tag, name, first + 1), number(tag, name, first + 2)};
  }

 private:
  DcmDataset& dataset_;
  const std::filesystem::path& file_;
};

void read_geometry(const Attributes& attributes, CtSlice& slice) {
  slice.columns = attributes.count(DCM_Columns, "Columns");
  slice.rows = attributes.count(DCM_Rows, "Rows");
  // DICOM gives the spacing of the rows first.
  slice.spacing_mm = {attributes.number(DCM_PixelSpacing, "PixelSpacing", 1),
                      attributes.number(DCM_PixelSpacing, "PixelSpacing", 0)};
  slice.along_row = attributes.vector(DCM_ImageOrientationPatient, "ImageOrientationPatient");
  slice.along_column = attributes.vector(DCM_ImageOrientationPatient, "ImageOrientationPatient", 3);
  slice.first_voxel_mm = attributes.vector(DCM_ImagePositionPatient, "ImagePositionPatient");
  constexpr double kTolerance = 1e-3;
  if (std::abs(slice.along_row.norm() - 1) > kTolerance ||
      std::abs(slice.along_column.norm() - 1) > kTolerance ||
      std::abs(slice.along_row.dot(slice.along_column)) > kTolerance) {
    attributes.refuse("ImageOrientationPatient is no pair of unit vectors at right angles");
  }
  if (slice.columns < 2 || slice.rows < 2) {
    attributes.refuse("has fewer than 2 x 2 pixels");
  }
  // The finest CT scanners have voxels of 0.05 mm or so, and no chest fits into a metre of 10 mm voxels.
  const double widest_mm = std::max(slice.spacing_mm.x() * slice.columns, slice.spacing_mm.y() * slice.rows);
  if (slice.spacing_mm.minCoeff() < 0.02 || slice.spacing_mm.maxCoeff() > 20 || widest_mm < 20) {
    std::ostringstream why;
    why << "PixelSpacing is " << slice.spacing_mm.y() << " \\ " << slice.spacing_mm.x() << " for "
        << slice.columns << " x " << slice.rows
        << " pixels, which is no patient in mm; DICOM wants mm (are these metres?)";
    attributes.refuse(why.str());
  }
}

void read_pixels(DcmDataset& dataset, const Attributes& attributes, CtSlice& slice) {
  if (attributes.count(DCM_BitsAllocated, "BitsAllocated") != 16 ||
      attributes.count(DCM_SamplesPerPixel, "SamplesPerPixel") != 1) {
    attributes.refuse("pixels are not one sample of 16 bit each, as CT's are");
  }
  const DcmXfer transfer(dataset.getOriginalXfer());
  if (transfer.isEncapsulated()) {
    attributes.refuse(std::string("pixels are compressed (") + transfer.getXferName() +
                      "); decompress the series first, e.g. with gdcmconv --raw or dcmdjpeg");
  }
  const Uint16* words = nullptr;
  unsigned long count = 0;
  const auto wanted = static_cast<std::size_t>(slice.columns) * static_cast<std::size_t>(slice.rows);
  if (dataset.findAndGetUint16Array(DCM_PixelData, words, &count).bad() || words == nullptr ||
      count < wanted) {
    attributes.refuse("has fewer pixels than Rows x Columns; is the file cut off?");
  }
  const double slope = attributes.number_or(DCM_RescaleSlope, 1);
  const double intercept = attributes.number_or(DCM_RescaleIntercept, 0);
  const bool is_signed = attributes.count(DCM_PixelRepresentation, "PixelRepresentation") == 1;
  slice.hounsfield.reserve(wanted);
  for (std::size_t i = 0; i < wanted; ++i) {
    const double stored = is_signed ? static_cast<double>(static_cast<std::int16_t>(words[i])) : words[i];
    slice.hounsfield.push_back(static_cast<float>(slope * stored + intercept));
  }
}

}  // namespace

Eigen::Vector3d CtSlice::normal() const { return along_row.cross(along_column).normalized(); }

std::optional<CtSlice> read_ct_slice(const std::filesystem::path& file) {
  DcmFileFormat format;
  // A file without DICOM's preamble and meta header is taken for something else that lies in the folder.
  if (format.loadFile(file.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength, ERM_fileOnly).bad()) {
    return std::nullopt;
  }
  DcmDataset& dataset = *format.getDataset();
  const Attributes attributes(dataset, file);
  const std::string modality = attributes.text(DCM_Modality, "Modality");
  if (modality != "CT") {
    attributes.refuse("is of modality " + modality +
                      ", not CT; leave only the slices of one CT series in the folder");
  }
  CtSlice slice;
  slice.file = file;
  slice.series = attributes.text(DCM_SeriesInstanceUID, "SeriesInstanceUID");
  read_geometry(attributes, slice);
  read_pixels(dataset, attributes, slice);
  return slice;
}

}  // namespace tubed
