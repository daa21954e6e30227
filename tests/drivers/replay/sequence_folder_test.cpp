#include "drivers/replay/sequence_folder.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/replay/small_sequence.hpp"

namespace tubed {
namespace {

class SequenceFolder : public ::testing::Test {
 protected:
  SequenceFolder() { write_small_sequence(folder_); }

  [[nodiscard]] Sequence read() const { return read_sequence(folder_.path()); }

  TemporaryFolder folder_;
};

TEST_F(SequenceFolder, SaysWhatCatheterIsTracked) {
  const Sequence sequence = read();

  EXPECT_EQ(sequence.note, "by hand");
  ASSERT_EQ(sequence.room.instruments.size(), 1U);
  const InstrumentDescription& catheter = sequence.room.instruments.front();
  EXPECT_EQ(catheter.id, "cath-1");
  EXPECT_EQ(catheter.diameter_mm, 2.33);
  EXPECT_EQ(catheter.length_mm, 3.0);
  ASSERT_EQ(catheter.coils.size(), 2U);
  EXPECT_EQ(catheter.coils[1].sensor, 2);
  EXPECT_EQ(catheter.coils[1].offset_from_tip_mm, 2.0);
}

TEST_F(SequenceFolder, GivesCamerasAndRegistrationTheirPlaces) {
  const Sequence sequence = read();

  EXPECT_TRUE((sequence.room.T_world_em * Eigen::Vector3d(1, 0, 0)).isApprox(Eigen::Vector3d(10, 21, 30)));
  ASSERT_EQ(sequence.room.cameras.size(), 2U);
  const CameraCalibration& second = sequence.room.cameras[1];
  EXPECT_EQ(second.name, "B");
  EXPECT_EQ(second.width, 5);
  EXPECT_EQ(second.height, 2);
  EXPECT_EQ(sequence.room.cameras[0].fy, 2000.0);
  EXPECT_EQ(second.distortion[0], 0.1);
  EXPECT_TRUE((second.T_camera_world * Eigen::Vector3d(1, 2, 3)).isApprox(Eigen::Vector3d(3, 2, 999)));
}

TEST_F(SequenceFolder, TwoCamerasExposedTogetherAreTwoRowsOfOneTime) {
  const Sequence sequence = read();

  ASSERT_EQ(sequence.frames.size(), 4U);
  EXPECT_EQ(sequence.frames[0].t_s, sequence.frames[1].t_s);
  EXPECT_EQ(sequence.frames[0].camera, 0);
  EXPECT_EQ(sequence.frames[1].camera, 1);
  EXPECT_EQ(sequence.frames[1].frame, 11U);
}

TEST_F(SequenceFolder, ARowWithoutAFileIsAnInstantWithoutFluoroscopy) {
  const Sequence sequence = read();

  EXPECT_TRUE(sequence.frames[0].fluoroscopy_on());
  EXPECT_FALSE(sequence.frames[2].fluoroscopy_on());
}

TEST_F(SequenceFolder, RowsOfOneMeasurementComeTogether) {
  const Sequence sequence = read();

  ASSERT_EQ(sequence.measurements.size(), 3U);
  const SequenceMeasurement& first = sequence.measurements[0];
  EXPECT_EQ(first.em_frame, 7U);
  EXPECT_EQ(first.coil_count, 2);
  EXPECT_EQ(first.coils[0].status, CoilStatus::kOk);
  EXPECT_EQ(first.coils[0].p_em_mm, Eigen::Vector3d(1.5, -2, 3));
  EXPECT_EQ(first.coils[0].tangent_em, Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(first.coils[0].indicator, 0.25);
}

TEST_F(SequenceFolder, ASensorWithoutAPoseIsNotAtTheOrigin) {
  const Sequence sequence = read();

  const CoilSample& missing = sequence.measurements[0].coils[1];
  EXPECT_EQ(missing.status, CoilStatus::kMissing);
  EXPECT_TRUE(missing.p_em_mm.array().isNaN().all());
  EXPECT_TRUE(missing.tangent_em.array().isNaN().all());
  EXPECT_EQ(sequence.measurements[1].coils[1].status, CoilStatus::kOutOfVolume);
  EXPECT_EQ(sequence.measurements[1].coils[1].p_em_mm, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(sequence.measurements[2].coils[0].status, CoilStatus::kMissing) << "no row at all";
  EXPECT_EQ(sequence.measurements[2].coils[1].status, CoilStatus::kDisabled);
}

TEST_F(SequenceFolder, AFrameMayHaveAGeometryOfItsOwn) {
  EXPECT_FALSE(read().frames[0].geometry);
  folder_.write("geometry.csv", kSmallGeometry);
  const Sequence sequence = read();
  ASSERT_TRUE(sequence.frames[0].geometry);
  EXPECT_FALSE(sequence.frames[1].geometry);
  ASSERT_TRUE(sequence.frames[3].geometry);
  const ViewGeometry& moved = *sequence.frames[3].geometry;
  EXPECT_EQ(moved.fy, 2400);
  EXPECT_EQ(moved.sigma.rotation_rad[2], 0.003);
  EXPECT_EQ(moved.sigma.translation_mm[1], 2);
  EXPECT_EQ(moved.sigma.pivot_depth_mm, 1200);
  const CameraCalibration camera = camera_of(sequence, sequence.frames[3]);
  EXPECT_TRUE((camera.T_camera_world * Eigen::Vector3d(1, 2, 3)).isApprox(Eigen::Vector3d(5, 9, 1208)));
  EXPECT_EQ(camera.cx, 1);
  EXPECT_EQ(camera_of(sequence, sequence.frames[1]).name, "B");
}

TEST_F(SequenceFolder, TruthIsFoundByFrame) {
  const Sequence sequence = read();

  const SequenceTruth* truth = find_truth(sequence, 12);
  ASSERT_NE(truth, nullptr);
  ASSERT_EQ(truth->points_world_mm.cols(), 3);
  EXPECT_EQ(Eigen::Vector3d(truth->points_world_mm.col(2)), Eigen::Vector3d(5, 0, 2));
  EXPECT_EQ(find_truth(sequence, 10)->points_world_mm.cols(), 2);
  EXPECT_EQ(find_truth(sequence, 13), nullptr);
}

TEST_F(SequenceFolder, TruthMayBeAbsent) {
  std::filesystem::remove(folder_.path() / "truth.csv");

  EXPECT_TRUE(read().truth.empty());
}

TEST_F(SequenceFolder, WindowsLineEndsAndAByteOrderMarkAreTolerated) {
  folder_.write("frames.csv",
                "\xEF\xBB\xBF"
                "frame,t_s,camera,file\r\n1,0.5,A,\r\n2,0.5,B,\r\n\r\n");
  std::filesystem::remove(folder_.path() / "truth.csv");

  const Sequence sequence = read();

  ASSERT_EQ(sequence.frames.size(), 2U);
  EXPECT_FALSE(sequence.frames[0].fluoroscopy_on());
}

TEST_F(SequenceFolder, ColumnsMayStandInAnyOrder) {
  folder_.write("frames.csv", "camera,comment,file,t_s,frame\nB,hello,,0.5,3\n");
  std::filesystem::remove(folder_.path() / "truth.csv");

  const Sequence sequence = read();

  ASSERT_EQ(sequence.frames.size(), 1U);
  EXPECT_EQ(sequence.frames[0].frame, 3U);
  EXPECT_EQ(sequence.frames[0].camera, 1);
}

TEST_F(SequenceFolder, ARotationRoundedToSevenDigitsIsMadeExact) {
  folder_.replace("sequence.toml", "[[0, -1, 0, 10], [1, 0, 0, 20]",
                  "[[0.8660254, -0.5, 0, 10], [0.5, 0.8660254, 0, 20]");

  const Eigen::Matrix3d rotation = read().room.T_world_em.linear();

  EXPECT_LT((rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).norm(), 1e-15);
  EXPECT_NEAR(rotation(0, 1), -0.5, 1e-7);
}

/// One change that makes the folder unusable, and what the message has to say.
struct Damage {
  const char* name;
  const char* file;
  const char* from;
  const char* to;
  int line;
  int column;
  const char* words;
};

void PrintTo(const Damage& damage, std::ostream* out) { *out << damage.name; }

std::string name_of(const ::testing::TestParamInfo<Damage>& test) { return test.param.name; }

class DamagedFolder : public SequenceFolder, public ::testing::WithParamInterface<Damage> {
 protected:
  DamagedFolder() { folder_.write("geometry.csv", kSmallGeometry); }
};

TEST_P(DamagedFolder, IsRefusedWithItsPlace) {
  const Damage& damage = GetParam();
  folder_.replace(damage.file, damage.from, damage.to);

  try {
    static_cast<void>(read());
    FAIL() << "was accepted";
  } catch (const SequenceError& error) {
    EXPECT_EQ(error.position().file.filename(), damage.file) << error.what();
    EXPECT_EQ(error.position().line, damage.line) << error.what();
    EXPECT_EQ(error.position().column, damage.column) << error.what();
    EXPECT_NE(std::string(error.what()).find(damage.words), std::string::npos) << error.what();
    const std::string place = std::string(damage.file) + ":" + std::to_string(damage.line) + ":";
    EXPECT_NE(std::string(error.what()).find(place), std::string::npos) << error.what();
  }
}

INSTANTIATE_TEST_SUITE_P(
    Frames, DamagedFolder,
    ::testing::Values(
        Damage{"missing_column", "frames.csv", "t_s", "t", 1, 1, "the column 't_s' is missing"},
        Damage{"column_twice", "frames.csv", "camera,file", "t_s,camera,file", 1, 11, "is there twice"},
        Damage{"row_cut_off", "frames.csv", "13,0.2,A,images/a13.png", "13,0.2", 5, 4,
               "2 fields, the header 4"},
        Damage{"not_finite", "frames.csv", "10,0.0", "10,nan", 2, 4, "'nan' is not finite"},
        Damage{"infinite", "frames.csv", "0.2", "inf", 5, 4, "'inf' is not finite"},
        Damage{"malformed", "frames.csv", "0.2", "0,2", 5, 10, "5 fields"},
        Damage{"letters_after_number", "frames.csv", "0.2", "0.2s", 5, 4, "'0.2s' is not a number"},
        Damage{"empty_number", "frames.csv", "12,0.1", "12,", 4, 4, "'' is not a number"},
        Damage{"time_backwards", "frames.csv", "0.2", "0.05", 5, 4, "backwards"},
        Damage{"time_too_great", "frames.csv", "0.2", "1e12", 5, 4, "beyond 1e9"},
        Damage{"frame_twice", "frames.csv", "13,", "11,", 5, 1, "frame 11 is there twice"},
        Damage{"frame_negative", "frames.csv", "13,", "-1,", 5, 1, "'-1' is not a whole number"},
        Damage{"unknown_camera", "frames.csv", "0.0,B", "0.0,C", 3, 8, "no [[camera]] named 'C'"},
        Damage{"file_outside", "frames.csv", "images/a13.png", "../a13.png", 5, 10, "leaves the folder"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Em, DamagedFolder,
    ::testing::Values(
        Damage{"missing_column", "em.csv", ",error", "", 1, 1, "the column 'error' is missing"},
        Damage{"unknown_status", "em.csv", "MISSING", "GONE", 3, 11, "'GONE' is none of OK"},
        Damage{"sensor_0", "em.csv", "8,1,OK", "8,0,OK", 4, 9, "sensor 0 is not one of 1 .. 16"},
        Damage{"sensor_17", "em.csv", "8,1,OK", "8,17,OK", 4, 9, "sensor 17"},
        Damage{"sensor_twice", "em.csv", "0.025,8,2", "0.025,8,1", 5, 9, "sensor 1 is there twice"},
        Damage{"not_finite", "em.csv", "1.6,", "inf,", 4, 14, "'inf' is not finite"},
        Damage{"pose_missing", "em.csv", "1.6,", ",", 4, 14, "is not a number"},
        Damage{"tangent_not_unit", "em.csv", "3,0,0,1,1,0,0,0,0.3", "3,0,0,1.1,1,0,0,0,0.3", 4, 23,
               "not of length 1"},
        Damage{"quaternion_not_unit", "em.csv", "0,0,1,1,0,0,0,0.3", "0,0,1,2,0,0,0,0.3", 4, 29,
               "quaternion"},
        Damage{"time_backwards", "em.csv", "0.050", "0.020", 6, 1, "backwards"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Truth, DamagedFolder,
    ::testing::Values(
        Damage{"unknown_frame", "truth.csv", "12,0", "99,0", 4, 1, "frame 99 is not in frames.csv"},
        Damage{"frame_again", "truth.csv", "12,2,5,0,2", "10,0,5,0,2", 6, 1, "or had its centreline before"},
        Damage{"arc_length_skipped", "truth.csv", "12,2,", "12,3,", 6, 4, "expected 2"},
        Damage{"not_finite", "truth.csv", "12,2,5", "12,2,nan", 6, 6, "not finite"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Geometry, DamagedFolder,
    ::testing::Values(
        Damage{"unknown_frame", "geometry.csv", "13,2500", "99,2500", 3, 1, "frame 99 is not in frames.csv"},
        Damage{"frame_again", "geometry.csv", "13,2500", "10,2500", 3, 1, "had its geometry before"},
        Damage{"not_finite", "geometry.csv", "0,1200,0,0", "0,nan,0,0", 2, 32, "not finite"},
        Damage{"no_rotation", "geometry.csv", "1.5,1,0,0,0", "1.5,1,1,0,0", 2, 1, "not of length 1"},
        Damage{"inverted", "geometry.csv", "0,1200,0,0", "0,-1200,0,0", 2, 1, "behind the camera"},
        Damage{"no_focal_length", "geometry.csv", "10,2000", "10,0", 2, 1, "focal lengths"},
        Damage{"column_missing", "geometry.csv", ",pivot_depth", "", 1, 1,
               "the column 'pivot_depth' is missing"}),
    name_of);

INSTANTIATE_TEST_SUITE_P(
    Description, DamagedFolder,
    ::testing::Values(
        Damage{"unknown_format", "sequence.toml", "format = 1", "format = 2", 1, 10, "format is not 1"},
        Damage{"missing_key", "sequence.toml", "length_mm", "length", 4, 1, "the key 'length_mm' is missing"},
        Damage{"not_toml", "sequence.toml", "fx = 2000.0", "fx = = 3", 17, 6, ""},
        Damage{"not_finite", "sequence.toml", "cx = 2.0", "cx = nan", 19, 6,
               "camera.cx has to be a finite number"},
        Damage{"text_for_number", "sequence.toml", "fx = 2000.0", "fx = \"2\"", 17, 6, "finite number"},
        Damage{"no_width", "sequence.toml", "width = 4", "width = 0", 15, 9, "whole number of pixels"},
        Damage{"offsets_fall", "sequence.toml", "[1.0, 2.0]", "[2.0, 1.0]", 8, 36, "grow from the tip"},
        Damage{"not_a_rotation", "sequence.toml", "[[0, -1, 0, 10]", "[[0, -1.00001, 0, 10]", 11, 14,
               "not a rotation"},
        Damage{"mirrored", "sequence.toml", "[[0, -1, 0, 10]", "[[0, 1, 0, 10]", 11, 14, "not a rotation"},
        Damage{"last_row", "sequence.toml", "[0, 0, 1, 30], [0, 0, 0, 1]", "[0, 0, 1, 30], [0, 0, 1, 1]", 11,
               14, "last row"},
        Damage{"row_too_short", "sequence.toml", "[0, 0, 1, 30]", "[0, 0, 1]", 11, 46,
               "has 3 entries, not 4"},
        Damage{"distortion_too_long", "sequence.toml", "[0.1, 0, 0, 0, 0]", "[0, 0, 0, 0, 0, 0]", 32, 14,
               "6 entries"},
        Damage{"cameras_alike", "sequence.toml", "name = \"B\"", "name = \"A\"", 25, 8,
               "two cameras named 'A'"}),
    name_of);

TEST_F(SequenceFolder, AMissingFileIsNamed) {
  for (const char* file : {"sequence.toml", "frames.csv", "em.csv"}) {
    const TemporaryFolder folder;
    write_small_sequence(folder);
    std::filesystem::remove(folder.path() / file);
    try {
      read_sequence(folder.path());
      FAIL() << file;
    } catch (const SequenceError& error) {
      EXPECT_EQ(error.position().file.filename(), file);
      EXPECT_NE(std::string(error.what()).find("there is no such file"), std::string::npos);
    }
  }
}

TEST_F(SequenceFolder, TablesTooDeepInEachOtherAreRefusedAndDoNotOverflowTheStack) {
  std::string text = "format = 1\na";
  for (int i = 0; i < 400'000; ++i) {
    text += ".a";
  }
  std::ofstream(folder_.path() / "sequence.toml") << text + " = 1\n";

  try {
    static_cast<void>(read());
    FAIL() << "was accepted";
  } catch (const SequenceError& error) {
    EXPECT_NE(std::string(error.what()).find("sequence.toml:2:1"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace tubed
