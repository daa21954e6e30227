#include "drivers/interface/view_in_shm.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

TEST(ViewInShm, WhatIsWrittenIsRead) {
  const ViewGeometry written{.fx = 1500,
                             .fy = 1501,
                             .cx = 255.5,
                             .cy = 250.25,
                             .q_camera_world = {0.5, -0.5, 0.25, 0.75},
                             .t_camera_world_mm = {1, -2, 1200},
                             .sigma = {{0.5, 0.25, 0.125}, {1, 2, 3}, 785}};
  tubed_shm_image image{};
  write_geometry(written, image);
  const auto read = geometry_of(image);
  ASSERT_TRUE(read);
  EXPECT_EQ(*read, written);
  EXPECT_EQ(read->sigma.rotation_rad, written.sigma.rotation_rad);
  EXPECT_EQ(read->sigma.translation_mm, written.sigma.translation_mm);
  EXPECT_EQ(read->sigma.pivot_depth_mm, 785);
}

TEST(ViewInShm, AnImageThatBringsNoneHasNone) { EXPECT_FALSE(geometry_of(tubed_shm_image{})); }

}  // namespace
}  // namespace tubed
