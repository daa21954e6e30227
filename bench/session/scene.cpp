#include "bench/session/scene.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <utility>

#include "drivers/interface/driver_settings.hpp"
#include "drivers/laboratory/simulated_view.hpp"
#include "drivers/replay/sequence_writer.hpp"
#include "drivers/simulation/simulation_driver.hpp"

namespace tubed {

namespace {

constexpr double kDistinctS = 2;
constexpr double kMaxPictureBytes = 256e6;
constexpr double kFocalLengthPx = 2000;
constexpr double kDistanceMm = 1200;

DriverSettings simulation() {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& setting : simulation_settings()) values[setting.name] = setting.default_value;
  return DriverSettings(values);
}

CameraCalibration camera_of(const SceneSettings& settings, int index) {
  CameraCalibration camera{index == 0 ? "A" : "B",
                           settings.width,
                           settings.height,
                           kFocalLengthPx,
                           kFocalLengthPx,
                           settings.width / 2.0,
                           settings.height / 2.0,
                           {},
                           RigidTransform::Identity()};
  if (index == 1) {
    camera.T_camera_world.linear() = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY()).toRotationMatrix();
  }
  camera.T_camera_world.translation().z() = kDistanceMm;
  return camera;
}

RoomDescription room_of(const SceneSettings& settings) {
  RoomDescription room;
  for (int i = 0; i < settings.cameras; ++i) room.cameras.push_back(camera_of(settings, i));
  InstrumentDescription catheter;
  catheter.id = "cath-1";
  int sensor = 0;
  for (const double offset_mm : {10.0, 90.0, 170.0, 270.0, 370.0}) {
    catheter.coils.push_back({++sensor, offset_mm, false, 0, 0});
  }
  room.instruments.push_back(catheter);
  return room;
}

void write_matrix(std::ostream& text, const RigidTransform& transform) {
  text << '[';
  for (int row = 0; row < 4; ++row) {
    text << (row == 0 ? "[" : ", [");
    for (int column = 0; column < 4; ++column)
      text << (column == 0 ? "" : ", ") << transform.matrix()(row, column);
    text << ']';
  }
  text << "]\n";
}

void write_instrument(std::ostream& text, const InstrumentDescription& instrument, int number) {
  text << "[[instrument]]\nid = \"cath-" << number << "\"\ndiameter_mm = " << instrument.diameter_mm
       << "\nlength_mm = " << instrument.length_mm << '\n';
  for (const CoilPlacement& coil : instrument.coils) {
    text << "[[instrument.coil]]\nsensor = " << coil.sensor
         << "\noffset_from_tip_mm = " << coil.offset_from_tip_mm << '\n';
  }
}

}  // namespace

Scene::Scene(const SceneSettings& settings)
    : settings_(settings),
      room_(room_of(settings)),
      world_(room_, simulation()),
      tracker_(world_, simulation(), 1 / settings.em_rate_hz) {
  const double picture_bytes = static_cast<double>(settings.width) * settings.height * settings.cameras;
  distinct_ = std::max<std::int64_t>(
      4,
      static_cast<std::int64_t>(std::min(kDistinctS * settings.rate_hz, kMaxPictureBytes / picture_bytes)));
  const DriverSettings values = simulation();
  for (const CameraCalibration& camera : room_.cameras) {
    SimulatedView view(camera, world_, values.get<std::int64_t>("seed"), values.get<double>("cnr"));
    auto& pictures = pictures_.emplace_back();
    for (std::int64_t k = 0; k < distinct_; ++k) {
      pictures.emplace_back(static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height));
      view.render(world_, static_cast<double>(k) / settings.rate_hz, k, pictures.back());
    }
  }
}

const std::vector<std::uint8_t>& Scene::picture(int camera, std::int64_t k) const {
  const std::int64_t place = k % (2 * (distinct_ - 1));
  const std::int64_t shown = place < distinct_ ? place : 2 * (distinct_ - 1) - place;
  return pictures_[static_cast<std::size_t>(camera)][static_cast<std::size_t>(shown)];
}

double Scene::scene_time_s(double t_s) const {
  const double one_way_s = static_cast<double>(distinct_ - 1) / settings_.rate_hz;
  const double place_s = std::fmod(t_s, 2 * one_way_s);
  return place_s < one_way_s ? place_s : 2 * one_way_s - place_s;
}

EmFrame Scene::measurement(std::int64_t k) const {
  EmFrame frame;
  const double t_s = static_cast<double>(k) / settings_.em_rate_hz;
  frame.measured = frame.received = from_ns(static_cast<std::int64_t>(t_s * 1e9));
  frame.tracker_frame = static_cast<std::uint32_t>(k);
  frame.origin = Origin::kSimulated;
  for (const CoilPlacement& coil : room_.instruments.front().coils) {
    frame.coils[static_cast<std::size_t>(coil.sensor - 1)] =
        tracker_.measure(world_, 0, coil, k, scene_time_s(t_s));
    frame.coil_count = std::max(frame.coil_count, coil.sensor);
  }
  return frame;
}

void Scene::write_em(const std::filesystem::path& folder, double duration_s) const {
  SequenceWriter writer(folder, "SIMULATED: coils of a benchmark", room_);
  writer.add_instant_without_fluoroscopy(1, 0, 0);
  const auto count = static_cast<std::int64_t>(duration_s * settings_.em_rate_hz);
  for (std::int64_t k = 0; k < count; ++k) {
    const EmFrame frame = measurement(k);
    writer.add_measurement(
        {static_cast<double>(k) / settings_.em_rate_hz, frame.tracker_frame, frame.coil_count, frame.coils});
  }
  writer.finish();
}

std::string image_socket(const std::filesystem::path& folder, const CameraCalibration& camera) {
  return (folder / ("image-" + camera.name + ".sock")).string();
}

std::string estimates_socket(const std::filesystem::path& folder) {
  return (folder / "estimates.sock").string();
}

std::string scene_configuration(const Scene& scene, const std::filesystem::path& folder, int domain,
                                std::int64_t start_ns) {
  std::ostringstream text;
  text.precision(15);
  text << std::showpoint;
  // A slot waits for its image as long as by default, but has to end before the next one.
  const double tick_grace_ms = std::min(10.0, 600 / scene.settings().rate_hz);
  text << "[daemon]\nrate_hz = " << scene.settings().rate_hz << "\ntick_grace_ms = " << tick_grace_ms
       << "\n[dds]\ndomain = " << domain << "\n[shm]\nestimates_socket = \"" << estimates_socket(folder)
       << "\"\n[estimator]\ncoefficient_count = " << scene.settings().coefficient_count
       << "\n[frangi]\narea = \"" << scene.settings().frangi_area
       << "\"\n[em]\ndriver = \"replay\"\nT_world_em = ";
  write_matrix(text, scene.room().T_world_em);
  text << "[replay]\nfolder = \"" << (folder / "em").string() << "\"\nstart_monotonic_ns = " << start_ns
       << '\n';
  for (const CameraCalibration& camera : scene.room().cameras) {
    text << "[[camera]]\nname = \"" << camera.name << "\"\nwidth = " << camera.width
         << "\nheight = " << camera.height << "\nfx = " << camera.fx << "\nfy = " << camera.fy
         << "\ncx = " << camera.cx << "\ncy = " << camera.cy << "\ndriver = \"image_shm\"\ndevice = \""
         << image_socket(folder, camera) << "\"\nT_camera_world = ";
    write_matrix(text, camera.T_camera_world);
  }
  for (int i = 1; i <= scene.settings().instruments; ++i)
    write_instrument(text, scene.room().instruments.front(), i);
  return text.str();
}

}  // namespace tubed
