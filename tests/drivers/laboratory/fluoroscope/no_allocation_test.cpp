// Counts calls of operator new in this executable: an exposure may not make any.
#include <gtest/gtest.h>

#include "drivers/laboratory/fluoroscope/clutter.hpp"
#include "tests/drivers/laboratory/fluoroscope/small_patient.hpp"
#include "tests/support/counted_allocations.hpp"

namespace tubed {
namespace {

TEST(Exposures, AllocateNothingWhateverIsInThePicture) {
  RadiographSettings settings;
  add_default_clutter(settings);
  add_lumen(settings, mean_aorta());
  settings.motion.heart_phases = 1;
  settings.motion.breathing_phases = 1;
  Radiograph radiograph(small_view(), water_patient(), settings, 1);
  std::vector<std::uint8_t> pixels(radiograph.bytes_per_image());
  RadiographScene scene;
  scene.catheters.push_back(bent_catheter());
  scene.catheters.front().electrodes.resize(2);
  ASSERT_GT(allocations, 0) << "the counter counts";

  allocations = 0;
  for (scene.exposure = 0; scene.exposure < 6; ++scene.exposure) {
    const bool odd = scene.exposure % 2 == 1;
    scene.time_s += 0.3;
    scene.clutter = {odd, true, odd, true, true, 0.5};
    scene.fluoroscopy_on = scene.exposure != 3;
    radiograph.render(scene, pixels);
  }
  const long counted = allocations;

  EXPECT_EQ(counted, 0);
}

}  // namespace
}  // namespace tubed
