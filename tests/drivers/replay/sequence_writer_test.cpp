#include "drivers/replay/sequence_writer.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/replay/small_sequence.hpp"

namespace tubed {
namespace {

TEST(SequenceWriter, WhatIsWrittenIsReadBackToTheLastBit) {
  const TemporaryFolder source;
  write_small_sequence(source);
  source.write("geometry.csv", kSmallGeometry);
  Sequence original = read_sequence(source.path());
  original.frames[3].geometry->t_camera_world_mm[1] = 100.0 / 3;
  original.note = "a \"quoted\" note";
  original.room.cameras[1].masks = {1, 0, 2, 1};
  original.room.instruments[0].marks_mm = {0.25, 2.0 / 3};
  original.room.instruments[0].mark_length_mm = 0.4;
  original.measurements[0].coils[0].p_em_mm.x() = 1.0 / 3;
  original.truth[0].points_world_mm(0, 1) = 1e-17;
  std::vector<GreyImage> images;
  for (const int row : {0, 1, 3}) {
    images.push_back(read_image(original, original.frames[static_cast<std::size_t>(row)]));
  }
  const TemporaryFolder target;

  write_sequence(target.path() / "new", original, images);
  const Sequence copy = read_sequence(target.path() / "new");

  EXPECT_EQ(copy.note, original.note);
  EXPECT_EQ(copy.room.T_world_em.matrix(), original.room.T_world_em.matrix());
  EXPECT_EQ(copy.room.cameras[1].distortion, original.room.cameras[1].distortion);
  EXPECT_TRUE(copy.room.cameras[0].masks.empty());
  EXPECT_EQ(copy.room.instruments[0].marks_mm, original.room.instruments[0].marks_mm);
  EXPECT_EQ(copy.room.instruments[0].mark_length_mm, 0.4);
  EXPECT_EQ(copy.room.cameras[1].masks, original.room.cameras[1].masks);
  EXPECT_EQ(copy.measurements[0].coils[0].p_em_mm.x(), 1.0 / 3);
  EXPECT_EQ(copy.measurements[1].coils[1].status, CoilStatus::kOutOfVolume);
  EXPECT_EQ(copy.truth[0].points_world_mm, original.truth[0].points_world_mm);
  ASSERT_EQ(copy.frames.size(), 4U);
  EXPECT_FALSE(copy.frames[2].fluoroscopy_on());
  EXPECT_EQ(copy.frames[3].frame, 13U);
  EXPECT_EQ(read_image(copy, copy.frames[3]).pixels, images[2].pixels);
  EXPECT_EQ(copy.frames[0].geometry, original.frames[0].geometry);
  EXPECT_FALSE(copy.frames[1].geometry);
  EXPECT_EQ(copy.frames[3].geometry, original.frames[3].geometry);
  EXPECT_EQ(copy.frames[3].geometry->sigma.translation_mm, original.frames[3].geometry->sigma.translation_mm);
}

TEST(SequenceWriter, TheWholeRotationOfASensorIsKept) {
  const TemporaryFolder source;
  write_small_sequence(source);
  Sequence original = read_sequence(source.path());
  for (SequenceFrame& frame : original.frames) frame.file.clear();
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1.3, Eigen::Vector3d(1, -2, 3).normalized()));
  CoilSample& sensor = original.measurements[0].coils[0];
  sensor.tangent_em = turn * Eigen::Vector3d::UnitZ();
  sensor.x_axis_em = turn * Eigen::Vector3d::UnitX();
  const TemporaryFolder target;

  write_sequence(target.path() / "new", original, {});
  const CoilSample copy = read_sequence(target.path() / "new").measurements[0].coils[0];

  EXPECT_LT((copy.x_axis_em - sensor.x_axis_em).norm(), 1e-12);
  EXPECT_LT((copy.tangent_em - sensor.tangent_em).norm(), 1e-12);
}

TEST(SequenceWriter, ANoteMayHoldAnyCharacter) {
  const TemporaryFolder source;
  write_small_sequence(source);
  Sequence sequence = read_sequence(source.path());
  sequence.note = "a \"quoted\" C:\\path\nand = [another line]";
  for (SequenceFrame& frame : sequence.frames) frame.file.clear();
  const TemporaryFolder target;

  write_sequence(target.path(), sequence, {});

  EXPECT_EQ(read_sequence(target.path()).note, sequence.note);
}

TEST(SequenceWriter, WithoutTruthThereIsNoTruthFile) {
  const TemporaryFolder source;
  write_small_sequence(source);
  Sequence sequence = read_sequence(source.path());
  sequence.truth.clear();
  sequence.frames.clear();
  const TemporaryFolder target;

  write_sequence(target.path(), sequence, {});

  EXPECT_FALSE(std::filesystem::exists(target.path() / "truth.csv"));
  EXPECT_FALSE(std::filesystem::exists(target.path() / "geometry.csv"));
}

TEST(SequenceWriter, AFolderThatCannotBeMadeIsRefused) {
  const TemporaryFolder source;
  write_small_sequence(source);

  EXPECT_THROW(write_sequence(source.path() / "em.csv" / "below-a-file", read_sequence(source.path()), {}),
               SequenceError);
}

}  // namespace
}  // namespace tubed
