#include "drivers/simulation/simulation_driver.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "drivers/interface/monotonic_clock.hpp"
#include "drivers/interface/read_until.hpp"
#include "drivers/laboratory/simulated_world.hpp"
#include "drivers/simulation/fault_socket.hpp"
#include "tests/drivers/laboratory/simulated_room.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

MonotonicTime timeout() { return monotonic_now() + std::chrono::seconds(30); }

TEST(Faults, CommandsAreUnderstood) {
  Faults faults;
  const MonotonicTime now = from_ns(1'000'000'000);

  EXPECT_TRUE(apply_fault("stall 3.0", now, faults));
  EXPECT_TRUE(apply_fault("lose-coil 2\n", now, faults));
  EXPECT_TRUE(apply_fault("outlier 3 25", now, faults));
  EXPECT_TRUE(apply_fault("off", now, faults));
  EXPECT_TRUE(apply_fault("pan -5", now, faults));

  EXPECT_EQ(faults.stalled_until, now + std::chrono::seconds(3));
  EXPECT_TRUE(faults.lost[1]);
  EXPECT_EQ(faults.outlier_mm[2], 25);
  EXPECT_TRUE(faults.fluoroscopy_off);
  EXPECT_EQ(faults.pan_mm, -5);
  EXPECT_TRUE(apply_fault("restore-coil 2", now, faults));
  EXPECT_FALSE(faults.lost[1]);
  EXPECT_TRUE(apply_fault("clear", now, faults));
  EXPECT_FALSE(faults.fluoroscopy_off);
  EXPECT_EQ(faults.pan_mm, 0);
  EXPECT_EQ(faults.stalled_until, MonotonicTime{});
}

TEST(Faults, NonsenseChangesNothing) {
  Faults faults;
  for (const char* command :
       {"", "explode", "stall", "stall -1", "stall x", "stall nan", "lose-coil 0", "lose-coil 17",
        "lose-coil 1.5", "outlier 3", "outlier 3 inf", "pan", "pan 201"}) {
    EXPECT_FALSE(apply_fault(command, from_ns(1), faults)) << command;
  }
  EXPECT_EQ(faults.stalled_until, MonotonicTime{});
  EXPECT_EQ(std::count(faults.lost.begin(), faults.lost.end(), true), 0);
}

class SimulationDriver : public ::testing::Test {
 protected:
  SimulationDriver() { image_.reserve(400, 600); }

  RoomDescription room_ = paper_room();
  // Ten times the usual rates: the test waits for real samples.
  DriverSettings settings_ =
      default_settings().with("em_rate_hz", 400.0).with("frame_rate_hz", 100.0).with("em_latency_ms", 1.0);
  EmFrame em_;
  ImageFrame image_;
};

TEST_F(SimulationDriver, CoilsAreOffTheTruthByLambdaInTheTrackersFrame) {
  room_.T_world_em =
      Eigen::Translation3d(100, 200, 300) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.6, 0, 0.8));
  room_.instruments.push_back(paper_catheter("cath-2", 6));
  room_.instruments[1].coils[0].flipped = true;
  const SimulatedWorld world(room_, settings_);
  const auto source = make_simulation_em_source(room_, settings_);
  ASSERT_TRUE(source->open().ok);

  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);

  ASSERT_EQ(em_.coil_count, 10);
  EXPECT_EQ(em_.origin, Origin::kSimulated);
  EXPECT_GE(em_.received - em_.measured, std::chrono::milliseconds(1));
  const double t_s = world.seconds(em_.measured);
  for (int instrument = 0; instrument < 2; ++instrument) {
    for (const CoilPlacement& coil : room_.instruments[static_cast<std::size_t>(instrument)].coils) {
      const CoilSample& sample = em_.coils[static_cast<std::size_t>(coil.sensor - 1)];
      ASSERT_EQ(sample.status, CoilStatus::kOk);
      const Eigen::Vector3d truth_mm = world.point(instrument, t_s, coil.offset_from_tip_mm);
      EXPECT_NEAR((room_.T_world_em * sample.p_em_mm - truth_mm).norm(), 4, 1e-9);
      const Eigen::Vector3d tangent = world.tangent(instrument, t_s, coil.offset_from_tip_mm);
      const double cosine = (room_.T_world_em.linear() * sample.tangent_em).dot(tangent);
      EXPECT_GE(coil.flipped ? -cosine : cosine, std::cos(3.001 * 3.14159265358979 / 180));
    }
  }
}

TEST_F(SimulationDriver, ImagesOfAViewThatMovesSayHowItStood) {
  const DriverSettings moving = settings_.with("swing_deg", 40.0)
                                    .with("swing_every_s", 0.5)
                                    .with("pose_noise_deg", 0.0)
                                    .with("pose_noise_mm", 0.0);
  const SimulatedWorld world(room_, moving);
  const auto source = make_simulation_image_source(room_, moving, 0);
  ASSERT_TRUE(source->open().ok);
  for (int k = 0; k < 5; ++k) {
    ASSERT_EQ(read_until(*source, image_, timeout()), ReadOutcome::kFrame);
    ASSERT_TRUE(image_.geometry);
    EXPECT_EQ(image_.geometry, world.view(room_.cameras.front(), world.seconds(image_.exposure)));
    EXPECT_EQ(refusal_of(*image_.geometry, room_.cameras.front()), nullptr);
  }
  const auto silent = make_simulation_image_source(room_, moving.with("announces_pose", false), 0);
  ASSERT_TRUE(silent->open().ok);
  ASSERT_EQ(read_until(*silent, image_, timeout()), ReadOutcome::kFrame);
  EXPECT_FALSE(image_.geometry);
}

TEST_F(SimulationDriver, AClockThatIsLateStampsLateAndDeliversNothingFromTheFuture) {
  const SimulatedWorld world(room_, settings_);
  const DriverSettings late = settings_.with("mistakes", "clock=30").with("lambda_mm", 0.0);
  const auto camera = make_simulation_image_source(room_, late, 0);
  ASSERT_TRUE(camera->open().ok);
  ASSERT_EQ(read_until(*camera, image_, timeout()), ReadOutcome::kFrame);
  const auto exposed = from_ns(10'000'000 * static_cast<std::int64_t>(image_.frame_number));
  EXPECT_EQ(image_.exposure - exposed, std::chrono::milliseconds(30));
  EXPECT_GE(image_.received, image_.exposure);

  const DriverSettings early = settings_.with("mistakes", "clock=-30").with("lambda_mm", 0.0);
  const auto tracker = make_simulation_em_source(room_, early);
  ASSERT_TRUE(tracker->open().ok);
  ASSERT_EQ(read_until(*tracker, em_, timeout()), ReadOutcome::kFrame);
  const auto taken = from_ns(2'500'000 * static_cast<std::int64_t>(em_.tracker_frame));
  EXPECT_EQ(em_.measured - taken, std::chrono::milliseconds(30));
  EXPECT_GE(em_.received, em_.measured);
  EXPECT_TRUE(em_.coils[2].p_em_mm.isApprox(world.point(0, world.seconds(taken), 170), 1e-9));
}

TEST_F(SimulationDriver, AMistakeThatIsNoneIsRefusedWhenTheSourceIsMade) {
  EXPECT_THROW(make_simulation_em_source(room_, settings_.with("mistakes", "focal=9")),
               std::invalid_argument);
  EXPECT_THROW(make_simulation_image_source(room_, settings_.with("mistakes", "offset=6,5"), 0),
               std::invalid_argument);
}

TEST_F(SimulationDriver, MeasurementsComeInOrderOnTheGrid) {
  const auto source = make_simulation_em_source(room_, settings_);
  ASSERT_TRUE(source->open().ok);
  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);
  const EmFrame first = em_;

  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);

  EXPECT_EQ(em_.tracker_frame, first.tracker_frame + 1);
  EXPECT_EQ(em_.measured - first.measured, std::chrono::microseconds(2500));
}

TEST_F(SimulationDriver, AReadEndsAtItsDeadline) {
  const auto tracker = make_simulation_em_source(room_, settings_.with("em_rate_hz", 1.0));
  const auto fluoroscope = make_simulation_image_source(room_, settings_.with("image_latency_ms", 5000.0), 0);
  ASSERT_TRUE(tracker->open().ok);
  ASSERT_TRUE(fluoroscope->open().ok);

  EXPECT_EQ(fluoroscope->read(image_), ReadOutcome::kNothing);
  EXPECT_EQ(make_simulation_em_source(room_, settings_)->read(em_), ReadOutcome::kLost);
}

TEST_F(SimulationDriver, AnImageShowsTheWorldAtItsExposure) {
  const auto source = make_simulation_image_source(room_, settings_.with("cnr", 1e6), 0);
  const SimulatedWorld world(room_, settings_);
  ASSERT_TRUE(source->open().ok);

  ASSERT_EQ(read_until(*source, image_, timeout()), ReadOutcome::kFrame);

  EXPECT_EQ(image_.origin, Origin::kSimulated);
  EXPECT_TRUE(image_.fluoroscopy_on);
  EXPECT_EQ(image_.depth, PixelDepth::kGrey8);
  EXPECT_GE(image_.received - image_.exposure, std::chrono::milliseconds(8));
  const auto projected = Camera(paper_camera()).project(world.point(0, world.seconds(image_.exposure), 200));
  const auto x = std::lround(projected->p_image_px.x());
  const auto row = std::lround(projected->p_image_px.y()) * 400;
  const int on_catheter = image_.pixels[static_cast<std::size_t>(row + x)];
  const int beside = image_.pixels[static_cast<std::size_t>(row + x + 8)];
  EXPECT_GT(beside - on_catheter, 12);
}

/// Sources that take commands, and a way to send them.
class ControlledSimulation : public SimulationDriver {
 protected:
  ControlledSimulation() { settings_ = settings_.with("control_folder", folder_.string()); }

  void send(const std::string& socket_name, const std::string& command) const {
    const int sender = ::socket(AF_UNIX, SOCK_DGRAM, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    (folder_ / socket_name).string().copy(address.sun_path, sizeof(address.sun_path) - 1);
    const auto sent = ::sendto(sender, command.data(), command.size(), 0,
                               reinterpret_cast<const sockaddr*>(&address), sizeof(address));
    ::close(sender);
    ASSERT_EQ(sent, static_cast<ssize_t>(command.size()));
  }

  const TemporaryFolder temporary_;
  const std::filesystem::path folder_ = temporary_.path();
};

TEST_F(ControlledSimulation, ALostCoilIsMissingInTheNextSampleUntilItIsRestored) {
  const auto source = make_simulation_em_source(room_, settings_);
  ASSERT_TRUE(source->open().ok);

  send("em.sock", "lose-coil 2");
  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);
  EXPECT_EQ(em_.coils[1].status, CoilStatus::kMissing);
  EXPECT_TRUE(em_.coils[1].p_em_mm.array().isNaN().all());
  EXPECT_EQ(em_.coils[0].status, CoilStatus::kOk);

  send("em.sock", "restore-coil 2");
  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);
  EXPECT_EQ(em_.coils[1].status, CoilStatus::kOk);
}

TEST_F(ControlledSimulation, AnOutlierIsFarOffYetOk) {
  const DriverSettings exact = settings_.with("lambda_mm", 0.0);
  const SimulatedWorld world(room_, exact);
  const auto source = make_simulation_em_source(room_, exact);
  ASSERT_TRUE(source->open().ok);

  send("em.sock", "outlier 3 25");
  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);

  const Eigen::Vector3d truth_mm = world.point(0, world.seconds(em_.measured), 170);
  EXPECT_EQ(em_.coils[2].status, CoilStatus::kOk);
  EXPECT_NEAR((em_.coils[2].p_em_mm - truth_mm).norm(), 25, 1e-9);
}

TEST_F(ControlledSimulation, AStuckTrackerRepeatsItsPoses) {
  const auto source = make_simulation_em_source(room_, settings_);
  ASSERT_TRUE(source->open().ok);
  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);
  const EmFrame before = em_;

  send("em.sock", "stuck");
  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);

  EXPECT_EQ(em_.coils[4].p_em_mm, before.coils[4].p_em_mm);
  EXPECT_GT(em_.measured, before.measured);
}

TEST_F(ControlledSimulation, AStallDeliversNothingAndClearEndsIt) {
  const auto source = make_simulation_em_source(room_, settings_);
  ASSERT_TRUE(source->open().ok);

  send("em.sock", "stall 1000");
  source->wait(timeout());
  EXPECT_EQ(source->read(em_), ReadOutcome::kNothing);
  EXPECT_EQ(source->read(em_), ReadOutcome::kNothing);
  send("em.sock", "clear");
  const MonotonicTime cleared = monotonic_now();
  EXPECT_EQ(source->read(em_), ReadOutcome::kNothing) << "takes the command";
  ASSERT_EQ(read_until(*source, em_, timeout()), ReadOutcome::kFrame);
  EXPECT_GE(em_.received, cleared);
}

TEST_F(ControlledSimulation, RadiationOffAndBlackAndStuckPictures) {
  const auto source = make_simulation_image_source(room_, settings_, 0);
  ASSERT_TRUE(source->open().ok);
  send("image-A.sock", "off");
  ASSERT_EQ(read_until(*source, image_, timeout()), ReadOutcome::kFrame);
  EXPECT_FALSE(image_.fluoroscopy_on);

  send("image-A.sock", "on");
  ASSERT_EQ(read_until(*source, image_, timeout()), ReadOutcome::kFrame);
  EXPECT_TRUE(image_.fluoroscopy_on);
  const ImageFrame before = image_;

  send("image-A.sock", "stuck");
  ASSERT_EQ(read_until(*source, image_, timeout()), ReadOutcome::kFrame);
  EXPECT_EQ(image_.pixels, before.pixels);
  EXPECT_GT(image_.exposure, before.exposure);

  send("image-A.sock", "black");
  ASSERT_EQ(read_until(*source, image_, timeout()), ReadOutcome::kFrame);
  EXPECT_EQ(*std::max_element(image_.pixels.begin(), image_.pixels.begin() + 400 * 600), 0);
}

TEST_F(ControlledSimulation, TheSocketIsGoneAfterCloseAndAnOldOneIsNoHindrance) {
  const auto source = make_simulation_em_source(room_, settings_);
  ASSERT_TRUE(source->open().ok);
  source->close();
  EXPECT_FALSE(std::filesystem::exists(folder_ / "em.sock"));
  EXPECT_TRUE(source->open().ok);
  const auto other = make_simulation_em_source(room_, settings_);
  EXPECT_TRUE(other->open().ok);
}

TEST_F(ControlledSimulation, AControlFolderThatIsNotThereIsSaidInWords) {
  const auto source =
      make_simulation_em_source(room_, settings_.with("control_folder", (folder_ / "nowhere").string()));
  const OpenResult result = source->open();
  EXPECT_FALSE(result.ok);
  EXPECT_NE(result.why.find("does control_folder exist"), std::string::npos) << result.why;
}

TEST_F(SimulationDriver, WaitingEndsWhenASampleIsDueAndTakesNone) {
  const auto tracker = make_simulation_em_source(room_, settings_);
  const auto fluoroscope = make_simulation_image_source(room_, settings_, 0);
  ASSERT_TRUE(tracker->open().ok);
  ASSERT_TRUE(fluoroscope->open().ok);
  ASSERT_EQ(read_until(*tracker, em_, timeout()), ReadOutcome::kFrame);
  const std::uint32_t number = em_.tracker_frame;
  for (int i = 0; i < 3; ++i) {
    tracker->wait(timeout());
    fluoroscope->wait(timeout());
  }
  ASSERT_EQ(tracker->read(em_), ReadOutcome::kFrame);
  EXPECT_EQ(em_.tracker_frame, number + 1);
  EXPECT_EQ(fluoroscope->read(image_), ReadOutcome::kFrame);
}

}  // namespace
}  // namespace tubed
