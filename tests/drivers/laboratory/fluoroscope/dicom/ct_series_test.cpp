#include "drivers/laboratory/fluoroscope/dicom/ct_series.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <vector>

namespace tubed {
namespace {

constexpr int kColumns = 6;
constexpr int kRows = 5;

/// What one slice's file says; tests change single values.
struct Slice {
  std::string modality = "CT";
  std::string series = "1.2.3";
  std::string spacing_mm = "8\\9";  ///< rows first, then columns
  std::string orientation = "1\\0\\0\\0\\1\\0";
  std::string position_mm;
  std::string intercept = "-1024";
  Uint16 bits = 16;
  std::function<Sint16(int column, int row)> stored = [](int, int) -> Sint16 { return 1024; };
};

class CtSeries : public ::testing::Test {
 protected:
  CtSeries()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("ct_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~CtSeries() override { std::filesystem::remove_all(folder_); }

  void write(const std::string& name, const Slice& slice) const {
    DcmFileFormat format;
    DcmDataset& dataset = *format.getDataset();
    dataset.putAndInsertString(DCM_SOPClassUID, UID_CTImageStorage);
    dataset.putAndInsertString(DCM_SOPInstanceUID, ("1.2.3.4." + std::to_string(name.size()) + ".1").c_str());
    dataset.putAndInsertString(DCM_Modality, slice.modality.c_str());
    dataset.putAndInsertString(DCM_SeriesInstanceUID, slice.series.c_str());
    dataset.putAndInsertString(DCM_PixelSpacing, slice.spacing_mm.c_str());
    dataset.putAndInsertString(DCM_ImageOrientationPatient, slice.orientation.c_str());
    dataset.putAndInsertString(DCM_ImagePositionPatient, slice.position_mm.c_str());
    dataset.putAndInsertString(DCM_RescaleSlope, "1");
    dataset.putAndInsertString(DCM_RescaleIntercept, slice.intercept.c_str());
    dataset.putAndInsertUint16(DCM_Columns, kColumns);
    dataset.putAndInsertUint16(DCM_Rows, kRows);
    dataset.putAndInsertUint16(DCM_SamplesPerPixel, 1);
    dataset.putAndInsertUint16(DCM_BitsAllocated, slice.bits);
    dataset.putAndInsertUint16(DCM_BitsStored, slice.bits);
    dataset.putAndInsertUint16(DCM_PixelRepresentation, 1);
    std::vector<Uint16> pixels;
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        pixels.push_back(static_cast<Uint16>(slice.stored(column, row)));
      }
    }
    dataset.putAndInsertUint16Array(DCM_PixelData, pixels.data(), static_cast<unsigned long>(pixels.size()));
    ASSERT_TRUE(format.saveFile((folder_ / name).c_str(), EXS_LittleEndianExplicit).good());
  }

  /// `count` slices of water, 3 mm apart, from z = -100 up; the names run against the positions.
  void write_water(int count) const {
    for (int i = 0; i < count; ++i) {
      Slice slice;
      slice.position_mm = "-20\\30\\" + std::to_string(-100 + 3 * i);
      write("slice" + std::to_string(90 - i) + ".dcm", slice);
    }
  }

  [[nodiscard]] std::string refusal() const {
    try {
      read_ct_series(folder_);
    } catch (const CtSeriesError& error) {
      return error.what();
    }
    return "";
  }

  std::filesystem::path folder_;
};

TEST_F(CtSeries, WaterAndAirHaveTheirAttenuationWhereThePatientFrameSays) {
  for (int i = 0; i < 4; ++i) {
    Slice slice;
    slice.position_mm = "-20\\30\\" + std::to_string(-100 + 3 * i);
    // Air (-1000) everywhere but for bone (+1000) at column 4, row 2 of the second slice from below.
    slice.stored = [i](int column, int row) -> Sint16 {
      return i == 1 && column == 4 && row == 2 ? 2024 : 24;
    };
    write("slice" + std::to_string(90 - i), slice);
  }
  const AttenuationVolume volume = read_ct_series(folder_);

  EXPECT_EQ(volume.size(), Eigen::Vector3i(kColumns, kRows, 4));
  EXPECT_NEAR(volume.at(4, 2, 1), 0.041F, 2e-6F);
  EXPECT_NEAR(volume.at(3, 2, 1), 0.0F, 2e-6F);
  const Eigen::Vector3d bone =
      volume.T_room_volume() * Eigen::Vector3d(4, 2, 1).cwiseProduct(volume.spacing_mm());
  EXPECT_TRUE(bone.isApprox(Eigen::Vector3d(-20 + 4 * 9, 30 + 2 * 8, -97), 1e-9)) << bone.transpose();
}

TEST_F(CtSeries, ACoronalSeriesIsTurnedAsItsOrientationSays) {
  for (int i = 0; i < 3; ++i) {
    Slice slice;
    slice.orientation = "1\\0\\0\\0\\0\\-1";
    slice.position_mm = "0\\" + std::to_string(10 * i) + "\\50";
    slice.stored = [i](int column, int row) -> Sint16 {
      return i == 2 && column == 1 && row == 3 ? 1024 : 24;
    };
    write("s" + std::to_string(i), slice);
  }
  const AttenuationVolume volume = read_ct_series(folder_);
  Eigen::Vector3d water = Eigen::Vector3d::Constant(NAN);
  for (int k = 0; k < 3; ++k) {
    for (int j = 0; j < kRows; ++j) {
      for (int i = 0; i < kColumns; ++i) {
        if (volume.at(i, j, k) > 0.02F) {
          water = volume.T_room_volume() * Eigen::Vector3d(i, j, k).cwiseProduct(volume.spacing_mm());
        }
      }
    }
  }
  EXPECT_TRUE(water.isApprox(Eigen::Vector3d(9, 20, 50 - 3 * 8), 1e-9)) << water.transpose();
}

TEST_F(CtSeries, FilesThatAreNoDicomArePassedOver) {
  write_water(3);
  std::ofstream(folder_ / "README.txt")
      << "Notes on the series, longer than the preamble of a DICOM file would be. " << std::string(300, '.');
  EXPECT_EQ(read_ct_series(folder_).size().z(), 3);
}

TEST_F(CtSeries, AFolderWithoutASeriesIsRefused) {
  EXPECT_NE(refusal().find("is empty"), std::string::npos) << refusal();
  std::ofstream(folder_ / "a.txt") << "no DICOM";
  EXPECT_NE(refusal().find("none of the 1 files"), std::string::npos) << refusal();
  std::filesystem::remove_all(folder_);
  EXPECT_NE(refusal().find("is no folder"), std::string::npos) << refusal();
}

TEST_F(CtSeries, TwoSeriesInOneFolderAreRefusedWithBothFiles) {
  write_water(3);
  Slice other;
  other.series = "9.9.9";
  other.position_mm = "-20\\30\\-91";
  write("other.dcm", other);
  EXPECT_NE(refusal().find("two series"), std::string::npos) << refusal();
  EXPECT_NE(refusal().find("other.dcm"), std::string::npos);
}

TEST_F(CtSeries, AnotherModalityIsRefused) {
  Slice slice;
  slice.modality = "MR";
  slice.position_mm = "0\\0\\0";
  write("mr.dcm", slice);
  EXPECT_NE(refusal().find("modality MR"), std::string::npos) << refusal();
}

TEST_F(CtSeries, MetresAreRefused) {
  for (int i = 0; i < 3; ++i) {
    Slice slice;
    slice.spacing_mm = "0.0008\\0.0008";
    slice.position_mm = "0\\0\\" + std::to_string(0.003 * i);
    write("s" + std::to_string(i), slice);
  }
  EXPECT_NE(refusal().find("metres"), std::string::npos) << refusal();
}

TEST_F(CtSeries, SlicesInMetresOfPixelsInMillimetresAreRefused) {
  for (int i = 0; i < 3; ++i) {
    Slice slice;
    slice.position_mm = "0\\0\\" + std::to_string(0.003 * i);
    write("s" + std::to_string(i), slice);
  }
  EXPECT_NE(refusal().find("metres"), std::string::npos) << refusal();
}

TEST_F(CtSeries, AMissingOrDoubledSliceIsRefusedWithItsNeighbours) {
  write_water(6);
  std::filesystem::remove(folder_ / "slice87.dcm");
  EXPECT_NE(refusal().find("missing or doubled"), std::string::npos) << refusal();
  EXPECT_NE(refusal().find("slice88.dcm"), std::string::npos);
  EXPECT_NE(refusal().find("slice86.dcm"), std::string::npos);

  write_water(6);
  std::filesystem::copy_file(folder_ / "slice87.dcm", folder_ / "copy.dcm");
  EXPECT_NE(refusal().find("missing or doubled"), std::string::npos) << refusal();
}

TEST_F(CtSeries, OneSliceIsNoVolume) {
  write_water(1);
  EXPECT_NE(refusal().find("only one slice"), std::string::npos) << refusal();
}

TEST_F(CtSeries, PixelsOfEightBitAreRefused) {
  Slice slice;
  slice.bits = 8;
  slice.position_mm = "0\\0\\0";
  write("a.dcm", slice);
  EXPECT_NE(refusal().find("16 bit"), std::string::npos) << refusal();
}

}  // namespace
}  // namespace tubed
