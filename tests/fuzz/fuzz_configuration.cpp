// Any text as a configuration: it is one, or what is wrong with it is said with its place. The drivers are
// those of the daemon but for the simulation, which is as large as all others together (targets.cmake).
#include <memory>
#include <string_view>
#include <vector>

#include "daemon/config/changed_keys.hpp"
#include "daemon/config/load_configuration.hpp"
#include "drivers/driver_registry/driver_registry.hpp"
#include "tests/fuzz/fuzz_input.hpp"

using namespace tubed;
using namespace tubed::fuzz;

namespace {

/// Every driver is taken for tracker and fluoroscope.
void make_useful_for_everything(DriverDescription& driver) {
  driver.make_em_source = [](const SourceContext&) { return std::unique_ptr<EmSource>(); };
  driver.make_image_source = [](const SourceContext&, int) { return std::unique_ptr<ImageSource>(); };
  driver.device_socket = {};
}

std::vector<DriverDescription> with_an_empty_simulation() {
  std::vector<DriverDescription> all = drivers();
  all.push_back({"simulation", "a device", Origin::kDevice, {}, {}, {}});
  for (DriverDescription& driver : all) {
    make_useful_for_everything(driver);
  }
  return all;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::vector<DriverDescription> available = with_an_empty_simulation();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  try {
    const Configuration configuration = parse_configuration(text, "/etc/tubed/tubed.toml", available);
    demand(!configuration.room.instruments.empty());
    demand(configuration.estimators.size() == configuration.room.instruments.size());
    demand(configuration.image_sources.size() == configuration.room.cameras.size());
  } catch (const ConfigurationError& error) {
    demand(!error.problems().empty());
    for (const ConfigurationProblem& problem : error.problems()) {
      demand(problem.position.line >= 1 && problem.position.column >= 1 && !problem.message.empty());
    }
  }
  return 0;
}
