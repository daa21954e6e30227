// A sequence folder small enough to know by heart, written by hand so that reader and writer can be tested
// apart.
#pragma once

#include <stdlib.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

#include "drivers/replay/sequence_image.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {

inline GreyImage grey_image(int width, int height, std::uint8_t first) {
  GreyImage image{width, height, PixelDepth::kGrey8, {}};
  for (int i = 0; i < width * height; ++i) {
    image.pixels.push_back(static_cast<std::uint8_t>(first + i));
  }
  return image;
}

inline constexpr const char* kSmallDescription = R"(format = 1
note = "by hand"

[catheter]
id = "cath-1"
diameter_mm = 2.33
length_mm = 3.0
sensor_offsets_from_tip_mm = [1.0, 2.0]

[registration]
T_world_em = [[0, -1, 0, 10], [1, 0, 0, 20], [0, 0, 1, 30], [0, 0, 0, 1]]

[[camera]]
name = "A"
width = 4
height = 3
fx = 2000.0
fy = 2000
cx = 2.0
cy = 1.5
distortion = [0, 0, 0, 0, 0]
T_camera_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1200], [0, 0, 0, 1]]

[[camera]]
name = "B"
width = 5
height = 2
fx = 2100.0
fy = 2100.0
cx = 2.5
cy = 1.0
distortion = [0.1, 0, 0, 0, 0]
T_camera_world = [[0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 1000], [0, 0, 0, 1]]
)";

inline constexpr const char* kSmallFrames =
    "frame,t_s,camera,file\n"
    "10,0.0,A,images/a10.png\n"
    "11,0.0,B,images/b11.png\n"
    "12,0.1,A,\n"
    "13,0.2,A,images/a13.png\n";

inline constexpr const char* kSmallEm =
    "t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n"
    "0.000,7,1,OK,1.5,-2,3,0,0,1,1,0,0,0,0.25\n"
    "0.000,7,2,MISSING,,,,,,,,,,,\n"
    "0.025,8,1,OK,1.6,-2,3,0,0,1,1,0,0,0,0.3\n"
    "0.025,8,2,OUT_OF_VOLUME,4,5,6,0,1,0,0.70711,-0.70711,0,0,0.9\n"
    "0.050,9,2,DISABLED,,,,,,,,,,,\n";

inline constexpr const char* kSmallTruth =
    "frame,s_mm,x,y,z\n"
    "10,0,0,0,0\n"
    "10,1,0,0,1\n"
    "12,0,5,0,0\n"
    "12,1,5,0,1\n"
    "12,2,5,0,2\n";

/// Camera A as it stands, and once turned by 90 deg about its depth and 5 mm further off; not part of the
/// folder.
inline constexpr const char* kSmallGeometry =
    "frame,fx,fy,cx,cy,qw,qx,qy,qz,x,y,z,sigma_rx,sigma_ry,sigma_rz,sigma_x,sigma_y,sigma_z,pivot_depth\n"
    "10,2000,2000,2,1.5,1,0,0,0,0,0,1200,0,0,0,0,0,0,0\n"
    "13,2500,2400,1,2,0.7071067811865476,0,0,0.7071067811865476,7,8,1205,0.001,0.002,0.003,1,2,3,1200\n";

inline void write_small_sequence(const TemporaryFolder& folder) {
  folder.write("sequence.toml", kSmallDescription);
  folder.write("frames.csv", kSmallFrames);
  folder.write("em.csv", kSmallEm);
  folder.write("truth.csv", kSmallTruth);
  std::filesystem::create_directory(folder.path() / "images");
  write_image(folder.path() / "images/a10.png", grey_image(4, 3, 10));
  write_image(folder.path() / "images/b11.png", grey_image(5, 2, 50));
  write_image(folder.path() / "images/a13.png", grey_image(4, 3, 130));
}

}  // namespace tubed
