// A sequence folder whose every error can be worked out in the head: the true catheter lies straight along
// world +z from (0, 0, 0), 371 points, at every instant. The camera looks along world +x from 1000 mm away:
// camera x = world y, camera y = world z, camera z = world x; with f = 1000 px one mm of the truth is one
// pixel, and s = 0 .. 200 mm are in view.
#pragma once

#include <unistd.h>

#include <Eigen/Core>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "idl/command_line/command_line.hpp"

namespace tubed {

/// A temporary folder with the sequence; gone with the object.
class StraightSequence {
 public:
  explicit StraightSequence(int instant_count)
      : folder_(std::filesystem::temp_directory_path() /
                ("straight-sequence-" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(folder_);
    write("sequence.toml", R"(format = 1
note = "straight"
[catheter]
id = "cath-1"
diameter_mm = 2.33
length_mm = 380.0
sensor_offsets_from_tip_mm = [10.0, 370.0]
[registration]
T_world_em = [[0, 1, 0, 0.1], [-1, 0, 0, 20], [0, 0, 1, 0], [0, 0, 0, 1]]
[[camera]]
name = "A"
width = 101
height = 201
fx = 1000.0
fy = 1000.0
cx = 50.0
cy = 0.0
distortion = [0, 0, 0, 0, 0]
T_camera_world = [[0, 1, 0, 0], [0, 0, 1, 0], [1, 0, 0, 1000], [0, 0, 0, 1]]
)");
    std::string frames = "frame,t_s,camera,file\n";
    std::string truth = "frame,s_mm,x,y,z\n";
    for (int frame = 0; frame < instant_count; ++frame) {
      frames += std::to_string(frame) + "," + std::to_string(frame) + ".0,A,\n";
      for (int s = 0; s <= 370; ++s) {
        truth += std::to_string(frame) + "," + std::to_string(s) + ",0,0," + std::to_string(s) + "\n";
      }
    }
    write("frames.csv", frames);
    write("truth.csv", truth);
    write("em.csv",
          "t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n"
          "0.0,0,1,OK,0,0,10,0,0,-1,0,1,0,0,0.1\n"
          "0.0,0,2,OK,0,0,370,0,0,-1,0,1,0,0,0.1\n");
  }
  ~StraightSequence() { std::filesystem::remove_all(folder_); }
  StraightSequence(const StraightSequence&) = delete;
  StraightSequence& operator=(const StraightSequence&) = delete;

  /// Estimates of the given frames: the truth moved by `off_world_mm`, sigma 2 mm an axis. Returns the file.
  std::string write_estimates(const std::string& name, const std::vector<int>& frames,
                              const Eigen::Vector3d& off_world_mm) const {
    std::string text = "frame,s_mm,x,y,z,sigma_x,sigma_y,sigma_z,validity\n";
    for (const int frame : frames) {
      for (int s = 0; s <= 380; ++s) {
        text += std::to_string(frame) + "," + std::to_string(s) + "," + std::to_string(off_world_mm.x()) +
                "," + std::to_string(off_world_mm.y()) + "," + std::to_string(s + off_world_mm.z()) +
                ",2,2,2,VALID\n";
      }
    }
    return write(name, text);
  }

  std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return (folder_ / name).string();
  }

  [[nodiscard]] std::string path() const { return folder_.string(); }

 private:
  std::filesystem::path folder_;
};

/// Runs one verb as main does and returns its exit code. What the verb throws comes through.
inline int run_verb(CommandLine (*add)(CommandLine, int&), std::vector<std::string> arguments) {
  int exit_code = -1;
  Program program("");
  add(program.command_line(), exit_code);
  program.parse(std::move(arguments));
  return exit_code;
}

}  // namespace tubed
