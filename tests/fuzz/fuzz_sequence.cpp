// A sequence folder whose files are anything: lines "=== NAME" say which file follows; what is not given is
// as it should be. Check sums of a PNG's chunks are put right, which a fuzzer would hardly guess.
#include <png.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include "drivers/replay/sequence_folder.hpp"
#include "drivers/replay/sequence_image.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

constexpr const char* kDescription = R"(format = 1
[catheter]
id = "c"
diameter_mm = 2.0
length_mm = 100.0
sensor_offsets_from_tip_mm = [1.0, 20.0]
[registration]
T_world_em = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]
[[camera]]
name = "A"
width = 8
height = 4
fx = 100.0
fy = 100.0
cx = 4.0
cy = 2.0
distortion = [0,0,0,0,0]
T_camera_world = [[1,0,0,0],[0,1,0,0],[0,0,1,500],[0,0,0,1]]
)";

std::uint32_t crc32_of(std::string_view bytes) {
  std::uint32_t crc = 0xFFFFFFFFU;
  for (const char c : bytes) {
    crc ^= static_cast<std::uint8_t>(c);
    for (int bit = 0; bit < 8; ++bit) {
      crc = crc >> 1U ^ ((crc & 1U) != 0 ? 0xEDB88320U : 0U);
    }
  }
  return ~crc;
}

std::uint32_t big_endian(std::string_view bytes) {
  std::uint32_t value = 0;
  for (const char c : bytes.substr(0, 4)) {
    value = value << 8U | static_cast<std::uint8_t>(c);
  }
  return value;
}

void put_check_sums_right(std::string& png) {
  for (std::size_t at = 8; at + 12 <= png.size();) {
    const std::size_t length = big_endian(std::string_view(png).substr(at));
    if (length > png.size() - at - 12) {
      return;
    }
    const std::uint32_t crc = crc32_of(std::string_view(png).substr(at + 4, 4 + length));
    for (std::size_t i = 0; i < 4; ++i) {
      png[at + 8 + length + i] = static_cast<char>(crc >> (24 - 8 * i));
    }
    at += 12 + length;
  }
}

std::map<std::string, std::string> files_of(std::string_view input) {
  std::map<std::string, std::string> files{
      {"sequence.toml", kDescription},
      {"frames.csv", "frame,t_s,camera,file\n0,0.0,A,0.png\n1,0.1,A,\n"},
      {"em.csv",
       "t_s,frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n0,1,1,OK,1,2,3,0,0,1,1,0,0,0,0.1\n"}};
  for (std::size_t at = input.find("=== "); at != std::string_view::npos;) {
    const std::size_t next = input.find("\n=== ", at);
    const std::string_view part = input.substr(at + 4, next == std::string_view::npos ? next : next - at - 4);
    const std::size_t line = std::min(part.find('\n'), part.size());
    for (const char* name : {"sequence.toml", "frames.csv", "em.csv", "geometry.csv", "truth.csv", "0.png"}) {
      if (part.substr(0, line) == name) {
        files[name] = part.substr(std::min(line + 1, part.size()));
      }
    }
    at = next == std::string_view::npos ? next : next + 1;
  }
  put_check_sums_right(files["0.png"]);
  return files;
}

const std::filesystem::path& folder() {
  static const std::filesystem::path path = [] {
    std::string name =
        std::filesystem::exists("/dev/shm") ? "/dev/shm/tubed-fuzz-XXXXXX" : "/tmp/tubed-fuzz-XXXXXX";
    demand(mkdtemp(name.data()) != nullptr);
    static const std::string made = name;
    std::atexit([] { std::filesystem::remove_all(made); });
    return std::filesystem::path(name);
  }();
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::filesystem::remove(folder() / "truth.csv");
  std::filesystem::remove(folder() / "geometry.csv");
  for (const auto& [name, content] : files_of({reinterpret_cast<const char*>(data), size})) {
    std::ofstream(folder() / name, std::ios::binary) << content;
  }
  try {
    const Sequence sequence = read_sequence(folder());
    demand(sequence.room.instruments.size() == 1 && !sequence.room.cameras.empty());
    for (std::size_t i = 0; i < sequence.frames.size() && i < 4; ++i) {
      const SequenceFrame& frame = sequence.frames[i];
      demand(static_cast<std::size_t>(frame.camera) < sequence.room.cameras.size());
      const CameraCalibration& camera = sequence.room.cameras[static_cast<std::size_t>(frame.camera)];
      const RigidTransform pose = camera_of(sequence, frame).T_camera_world;
      demand(pose.matrix().allFinite());
      demand((pose.linear().transpose() * pose.linear()).isIdentity(1e-9));
      if (frame.fluoroscopy_on() && camera.width * camera.height <= 1 << 20) {
        static_cast<void>(read_image(sequence, frame));
      }
    }
  } catch (const SequenceError& error) {
    demand(std::string_view(error.what()).find("tubed-fuzz-") != std::string_view::npos);
  }
  return 0;
}
