// Angles of a DICOM run as poses in the world of a configuration.
#include "clients/tubectl/run/dicom_geometry.hpp"

#ifdef TUBED_READS_DICOM_RUNS

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "clients/tubectl/run/grab_dicom.hpp"
#include "drivers/replay/sequence_image.hpp"
#include "idl/geometry/c_arm.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"

namespace tubed {
namespace {

constexpr int kSide = 64;
constexpr int kFrames = 3;

/// What a run states of its C-arm; an empty text: nothing.
struct ArmSays {
  std::string primary_deg = "30";
  std::string secondary_deg = "-5";
  std::string primary_increments_deg = "0\\2.5\\5";
  std::string detector_mm = {};
  std::string isocentre_mm = {};
  std::string pitch_mm = {};
  std::string patient_mm = "700";
  int columns = kSide, rows = kSide;
};

class DicomGeometryTest : public ::testing::Test {
 protected:
  DicomGeometryTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("arm_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~DicomGeometryTest() override { std::filesystem::remove_all(folder_); }

  DicomRun run(const ArmSays& says, const std::string& name = "run.dcm") const {
    DcmFileFormat format;
    DcmDataset& dataset = *format.getDataset();
    const auto say = [&dataset](const DcmTagKey& tag, const std::string& value) {
      if (!value.empty()) dataset.putAndInsertString(tag, value.c_str());
    };
    say(DCM_SOPClassUID, UID_XRayAngiographicImageStorage);
    say(DCM_SOPInstanceUID, "1.2.3.4");
    say(DCM_Modality, "XA");
    say(DCM_PhotometricInterpretation, "MONOCHROME2");
    say(DCM_NumberOfFrames, std::to_string(kFrames));
    say(DCM_FrameTime, "66.6667");
    say(DCM_PositionerPrimaryAngle, says.primary_deg);
    say(DCM_PositionerSecondaryAngle, says.secondary_deg);
    say(DCM_PositionerPrimaryAngleIncrement, says.primary_increments_deg);
    say(DCM_DistanceSourceToDetector, says.detector_mm);
    say(DCM_DistanceSourceToPatient, says.patient_mm);
    if (!says.isocentre_mm.empty()) {
      dataset.putAndInsertFloat64(DCM_DistanceSourceToIsocenter, std::stod(says.isocentre_mm));
    }
    say(DCM_ImagerPixelSpacing, says.pitch_mm);
    for (const auto& [tag, value] : {std::pair{DCM_Columns, says.columns},
                                     {DCM_Rows, says.rows},
                                     {DCM_SamplesPerPixel, 1},
                                     {DCM_BitsAllocated, 8},
                                     {DCM_BitsStored, 8},
                                     {DCM_HighBit, 7},
                                     {DCM_PixelRepresentation, 0}}) {
      dataset.putAndInsertUint16(tag, static_cast<Uint16>(value));
    }
    const std::vector<Uint8> pixels(static_cast<std::size_t>(says.columns * says.rows * kFrames), 100);
    dataset.putAndInsertUint8Array(DCM_PixelData, pixels.data(), pixels.size());
    const std::filesystem::path file = folder_ / name;
    EXPECT_TRUE(format.saveFile(file.c_str(), EXS_LittleEndianExplicit).good());
    return read_dicom_run(file);
  }

  [[nodiscard]] std::string configuration(const std::string& of_camera, const std::string& after = "") const {
    const std::filesystem::path file = folder_ / "tubed.toml";
    std::ofstream(file)
        << "[em]\ndriver = \"simulation\"\nT_world_em = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], "
           "[0, 0, 0, 1]]\n[[camera]]\nname = \"A\"\nwidth = 64\nheight = 64\ncx = 32.0\ncy = 30.0\n"
           "driver = \"simulation\"\n"
        << of_camera
        << "\n[[instrument]]\nid = \"cath-1\"\n[[instrument.coil]]\nsensor = 1\noffset_from_tip_mm = "
           "10.0\n"
        << after;
    return file;
  }

  std::filesystem::path folder_;
};

constexpr char kArm[] =
    "[camera.c_arm]\nsource_detector_mm = 1200\nsource_isocentre_mm = 785\npixel_pitch_mm = 0.6\n"
    "primary_angle_deg = 12\ntable_mm = [0, 0, 40]\n"
    "T_c_arm_world = [[1, 0, 0, 5], [0, 1, 0, -6], [0, 0, 1, 7], [0, 0, 0, 1]]\n";

CArm arm_at(double primary_deg, double secondary_deg) {
  CArm arm;
  arm.source_detector_mm = 1200;
  arm.source_isocentre_mm = 785;
  arm.pixel_pitch_mm = 0.6;
  arm.primary_angle_deg = primary_deg;
  arm.secondary_angle_deg = secondary_deg;
  arm.table_mm = {0, 0, 40};
  arm.T_c_arm_world.translation() = Eigen::Vector3d(5, -6, 7);
  return arm;
}

TEST_F(DicomGeometryTest, TheConfiguredCArmTurnsWithTheAnglesOfEachImage) {
  const DicomGeometries found = geometries_of(run({}), configuration(kArm), "A");
  ASSERT_EQ(found.of_frames.size(), 3U);
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto& geometry = found.of_frames[static_cast<std::size_t>(frame)];
    ASSERT_TRUE(geometry);
    EXPECT_DOUBLE_EQ(geometry->fx, 2000);
    EXPECT_EQ(geometry->cx, 32);
    EXPECT_EQ(geometry->cy, 30);
    EXPECT_TRUE(geometry->T_camera_world().isApprox(pose_of(arm_at(30 + 2.5 * frame, -5)), 1e-9));
    EXPECT_NEAR(geometry->sigma.rotation_rad[0], 0.1 * std::numbers::pi / 180, 1e-9);
    EXPECT_EQ(geometry->sigma.pivot_depth_mm, 785);
  }
}

TEST_F(DicomGeometryTest, WholeDegreesAreKnownLessWell) {
  const DicomGeometries found = geometries_of(run({.primary_increments_deg = ""}), configuration(kArm), "A");
  ASSERT_TRUE(found.of_frames[2]);
  EXPECT_NEAR(found.of_frames[2]->sigma.rotation_rad[1], 0.3 * std::numbers::pi / 180, 1e-9);
  EXPECT_TRUE(found.of_frames[2]->T_camera_world().isApprox(pose_of(arm_at(30, -5)), 1e-9));
}

TEST_F(DicomGeometryTest, DistancesThatTheRunStatesAreTakenAndTold) {
  const DicomGeometries found =
      geometries_of(run({.detector_mm = "1100", .isocentre_mm = "785", .pitch_mm = "0.55\\0.55"}),
                    configuration(kArm), "A");
  ASSERT_TRUE(found.of_frames[0]);
  EXPECT_DOUBLE_EQ(found.of_frames[0]->fx, 2000);
  std::string all;
  for (const std::string& remark : found.remarks) all += remark + "\n";
  EXPECT_NE(all.find("source_detector_mm is 1100 in the run and 1200 in the configuration"),
            std::string::npos)
      << all;
  EXPECT_EQ(all.find("source_isocentre_mm"), std::string::npos) << all;
}

TEST_F(DicomGeometryTest, ADistanceToThePatientIsNotTakenForTheIsocentre) {
  const DicomGeometries found =
      geometries_of(run({.detector_mm = "1200", .pitch_mm = "0.6\\0.6"}), configuration(kArm), "A");
  ASSERT_TRUE(found.of_frames[0]);
  EXPECT_EQ(found.of_frames[0]->sigma.pivot_depth_mm, 785) << "700 is to the patient";
}

TEST_F(DicomGeometryTest, WithoutAnglesThereIsNoPoseAndThatIsTold) {
  const DicomGeometries found = geometries_of(run({.primary_deg = ""}), configuration(kArm), "A");
  EXPECT_FALSE(found.of_frames[0]);
  ASSERT_EQ(found.remarks.size(), 1U);
  EXPECT_NE(found.remarks[0].find("state no angles"), std::string::npos);
}

TEST_F(DicomGeometryTest, WhatIsStatedIsTakenWhateverElseIsMissing) {
  const DicomGeometries found = geometries_of(
      run({.detector_mm = "1100", .pitch_mm = "0.6\\0.6", .patient_mm = ""}), configuration(kArm), "A");
  ASSERT_TRUE(found.of_frames[0]);
  EXPECT_DOUBLE_EQ(found.of_frames[0]->fx, 1100 / 0.6);
  const DicomGeometries metres = geometries_of(run({.detector_mm = "1.1"}), configuration(kArm), "A");
  EXPECT_DOUBLE_EQ(metres.of_frames[0]->fx, 2000);
  ASSERT_FALSE(metres.remarks.empty());
  EXPECT_NE(metres.remarks[0].find("which no C-arm has"), std::string::npos) << metres.remarks[0];
  const DicomGeometries near = geometries_of(run({.detector_mm = "700"}), configuration(kArm), "A");
  EXPECT_DOUBLE_EQ(near.of_frames[0]->fx, 2000) << "the isocentre would lie behind the detector";
}

TEST_F(DicomGeometryTest, WhereIncrementsEndPosesEnd) {
  const DicomGeometries found =
      geometries_of(run({.primary_increments_deg = "0\\2.5"}), configuration(kArm), "A");
  EXPECT_TRUE(found.of_frames[1]);
  EXPECT_FALSE(found.of_frames[2]) << "it has not turned back";
}

TEST_F(DicomGeometryTest, EachFrameOfEnhancedXaHasAnglesOfItsOwn) {
  (void)run({});
  DcmFileFormat format;
  ASSERT_TRUE(format.loadFile((folder_ / "run.dcm").c_str()).good());
  DcmDataset& dataset = *format.getDataset();
  for (const DcmTagKey& tag :
       {DCM_PositionerPrimaryAngle, DCM_PositionerSecondaryAngle, DCM_PositionerPrimaryAngleIncrement}) {
    dataset.findAndDeleteElement(tag);
  }
  for (int frame = 0; frame < kFrames; ++frame) {
    DcmItem* group = nullptr;
    ASSERT_TRUE(dataset.findOrCreateSequenceItem(DCM_PerFrameFunctionalGroupsSequence, group, frame).good());
    DcmItem* position = nullptr;
    ASSERT_TRUE(group->findOrCreateSequenceItem(DCM_PositionerPositionSequence, position, 0).good());
    ASSERT_TRUE(
        position->putAndInsertString(DCM_PositionerPrimaryAngle, std::to_string(10 * frame).c_str()).good());
    ASSERT_TRUE(position->putAndInsertString(DCM_PositionerSecondaryAngle, "-5").good());
  }
  ASSERT_TRUE(format.saveFile((folder_ / "enhanced.dcm").c_str(), EXS_LittleEndianExplicit).good());
  const DicomGeometries found =
      geometries_of(read_dicom_run(folder_ / "enhanced.dcm"), configuration(kArm), "A");
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto& geometry = found.of_frames[static_cast<std::size_t>(frame)];
    ASSERT_TRUE(geometry);
    EXPECT_TRUE(geometry->T_camera_world().isApprox(pose_of(arm_at(10 * frame, -5)), 1e-9)) << frame;
  }
}

TEST_F(DicomGeometryTest, ACameraOfAnotherSizeIsRefused) {
  const DicomRun wide = run({.columns = 128});
  EXPECT_THROW(geometries_of(wide, configuration(kArm), "A"), std::runtime_error);
}

TEST_F(DicomGeometryTest, WhatDoesNotGoTogetherIsRefusedInWords) {
  const auto refusal_of = [&](const std::string& config, const std::string& camera,
                              const ArmSays& says = {}) -> std::string {
    try {
      geometries_of(run(says), config, camera);
      return "";
    } catch (const std::exception& error) {
      return error.what();
    }
  };
  EXPECT_NE(refusal_of(configuration(kArm), "B").find("has no camera 'B'"), std::string::npos);
  const std::string own_pose =
      "fx = 2000.0\nfy = 2000.0\nT_camera_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1200], [0, 0, 0, "
      "1]]\n";
  EXPECT_NE(refusal_of(configuration(own_pose), "A").find("has no [camera.c_arm]"), std::string::npos);
  EXPECT_NE(refusal_of(configuration("geometry = \"configuration\"\n" + std::string(kArm)), "A")
                .find("leaves out what images bring"),
            std::string::npos);
}

TEST_F(DicomGeometryTest, WithRecordedCoilsItBecomesASequenceFolder) {
  const StraightSequence coils(2);
  run({.columns = 101, .rows = 201});
  DicomFolderArguments arguments{.run = folder_ / "run.dcm",
                                 .rate_hz = 0,
                                 .camera = "A",
                                 .config = "",
                                 .coils = coils.path(),
                                 .at_s = -0.05,
                                 .into = folder_ / "both"};
  EXPECT_EQ(write_dicom_folder(arguments), 3U);
  const Sequence both = read_sequence(arguments.into);
  ASSERT_EQ(both.frames.size(), 3U);
  EXPECT_NEAR(both.frames[1].t_s, -0.05 + 1 / 15.0, 1e-5);
  EXPECT_EQ(read_image(both, both.frames[2]).pixels, std::vector<std::uint8_t>(101 * 201, 100));
  EXPECT_EQ(both.measurements.size(), read_sequence(coils.path()).measurements.size());
  EXPECT_THROW(write_dicom_folder(arguments), std::runtime_error) << "the folder is not empty";
  arguments.into = folder_ / "other";
  arguments.at_s = 12.5;
  EXPECT_THROW(write_dicom_folder(arguments), std::runtime_error) << "no coil was measured then";
  arguments.at_s = 0;
  arguments.camera = "B";
  EXPECT_THROW(write_dicom_folder(arguments), std::runtime_error);
  run({}, "small.dcm");
  arguments.camera = "A";
  arguments.run = folder_ / "small.dcm";
  try {
    write_dicom_folder(arguments);
    FAIL() << "images of another size";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(std::string(error.what()).find("is 64 x 64, camera 'A'"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tubed

#endif
