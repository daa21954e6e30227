// tubectl register --phantom: where a phantom of balls stands in the world.
#include <gtest/gtest.h>

#include <CLI/Error.hpp>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "clients/calibration/ball_phantom.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/sample_configuration.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

using Words = std::vector<std::string>;

/// Where a tracker and a phantom stand in the world.
struct PlacedPhantom {
  PlacedPhantom() {
    T_world_em.linear() = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
    T_world_em.translation() = Eigen::Vector3d(40, -30, 120);
    phantom.T_world_phantom.linear() =
        Eigen::AngleAxisd(-0.7, Eigen::Vector3d(0, 1, 1).normalized()).toRotationMatrix();
    phantom.T_world_phantom.translation() = Eigen::Vector3d(5, 60, -20);
  }
  /// Of a room whose tracker is registered, or is not.
  [[nodiscard]] std::string configuration(bool registered = true) const {
    std::ostringstream em;
    em.precision(15);
    for (int i = 0; registered && i < 4; ++i) {
      em << (i == 0 ? "T_world_em = [[" : ", [");
      for (int j = 0; j < 4; ++j) em << (j == 0 ? "" : ", ") << T_world_em.matrix()(i, j);
      em << (i == 3 ? "]]" : "]");
    }
    std::string all = sample_configuration();
    const std::size_t begin = all.find("\nT_world_em = ") + 1;
    return all.replace(begin, all.find('\n', begin) - begin, em.str());
  }
  /// Every fourth ball, as a tracker has it.
  [[nodiscard]] std::string touched() const {
    std::ostringstream text;
    text.precision(12);
    text << "name,x,y,z\n";
    for (std::size_t i = 0; i < phantom.balls.size(); i += 4) {
      const Eigen::Vector3d p = T_world_em.inverse() * phantom.p_world_mm(i);
      text << phantom.balls[i].name << ',' << p.x() << ',' << p.y() << ',' << p.z() << '\n';
    }
    return text.str();
  }
  RigidTransform T_world_em = RigidTransform::Identity();
  BallPhantom phantom = helix_phantom();
};

class RegisterPhantomTest : public testing::Test {
 protected:
  struct Outcome {
    int exit_code = -1;
    std::string words;  ///< on standard error
  };
  static Outcome run(const Words& arguments) {
    Outcome outcome;
    testing::internal::CaptureStderr();
    outcome.exit_code = run_verb(add_register, arguments);
    outcome.words = testing::internal::GetCapturedStderr();
    return outcome;
  }
  [[nodiscard]] std::string file(const std::string& name) const { return (folder_.path() / name).string(); }
  [[nodiscard]] std::string write(const std::string& name, const std::string& text) const {
    std::ofstream(file(name)) << text;
    return file(name);
  }
  static std::string text_of(const std::string& name) {
    std::ostringstream text;
    text << std::ifstream(name).rdbuf();
    return text.str();
  }

  TemporaryFolder folder_;
};

TEST_F(RegisterPhantomTest, APhantomIsPlacedByItsBalls) {
  const PlacedPhantom placed;
  BallPhantom taken_up = placed.phantom;
  taken_up.T_world_phantom = RigidTransform::Identity();
  const std::string phantom = write("phantom.toml", to_toml(taken_up));
  const std::string config = write("tubed.toml", placed.configuration());
  const Outcome outcome =
      run({"register", "--phantom", phantom, "--touched", write("balls.csv", placed.touched()), "--config",
           config, "--out", file("p.toml")});
  ASSERT_EQ(outcome.exit_code, kExitOk) << outcome.words;
  const BallPhantom found = read_ball_phantom(file("p.toml"));
  EXPECT_TRUE(found.T_world_phantom.isApprox(placed.phantom.T_world_phantom, 1e-6))
      << found.T_world_phantom.matrix();
  EXPECT_EQ(found.balls.size(), placed.phantom.balls.size());
  EXPECT_EQ(text_of(config), placed.configuration()) << "it is read, and not written";
}

TEST_F(RegisterPhantomTest, APhantomIsNotPlacedByATrackerThatNobodyHasRegistered) {
  const PlacedPhantom placed;
  const std::string phantom = write("phantom.toml", to_toml(placed.phantom));
  const std::string config = write("tubed.toml", placed.configuration(false));
  const std::string touched = write("balls.csv", placed.touched());
  const Outcome outcome = run({"register", "--phantom", phantom, "--touched", touched, "--config", config});
  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_NE(outcome.words.find("register the tracker first"), std::string::npos) << outcome.words;
  for (const Words& misuse :
       {Words{"register", "--touched", touched},
        Words{"register", "--phantom", phantom, "--touched", touched},
        Words{"register", "--phantom", phantom, "--touched", touched, "--config", config, "--json", "-"}}) {
    EXPECT_THROW(run_verb(add_register, misuse), CLI::ValidationError) << misuse.back();
  }
}

}  // namespace
}  // namespace tubed
