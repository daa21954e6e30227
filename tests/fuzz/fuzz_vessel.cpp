// Any file as a vessel: STL or a centreline in a table. The first byte says which.
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>

#include "drivers/laboratory/vessel/surface_mesh.hpp"
#include "drivers/laboratory/vessel/vessel_file.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

const std::string& folder() {
  static const std::string path = [] {
    std::string name =
        std::filesystem::exists("/dev/shm") ? "/dev/shm/tubed-fuzz-XXXXXX" : "/tmp/tubed-fuzz-XXXXXX";
    demand(mkdtemp(name.data()) != nullptr);
    static const std::string made = name;
    std::atexit([] { std::filesystem::remove_all(made); });
    return name;
  }();
  return path;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::filesystem::path file = folder() + (data[0] % 2 == 0 ? "/vessel.stl" : "/vessel.csv");
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(data + 1), static_cast<std::streamsize>(size - 1));
  try {
    if (data[0] % 2 == 0) {
      SurfaceMesh mesh = read_stl(file);
      check_lumen(mesh, "vessel.stl");  // the field of distances takes seconds: another test's
    } else {
      static_cast<void>(read_vessel(file));
    }
  } catch (const std::invalid_argument& error) {
    demand(std::string_view(error.what()).find("vessel.") != std::string_view::npos);
  }
  return 0;
}
