// `tubectl calibrate coils|noise` used rightly and wrongly, on folders as a recording writes them.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "clients/tubectl/verbs.hpp"
#include "tests/clients/tubectl/calibrate_outcome.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

const char* const kRoom = R"(format = 1
note = "groove"
[catheter]
id = "cath-1"
diameter_mm = 2.33
length_mm = 380.0
sensor_offsets_from_tip_mm = [10.0, 90.0, 170.0, 270.0, 370.0]
[registration]
T_world_em = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[[camera]]
name = "A"
width = 400
height = 600
fx = 2000.0
fy = 2000.0
cx = 200.0
cy = 300.0
distortion = [0, 0, 0, 0, 0]
T_camera_world = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1200], [0, 0, 0, 1]]
)";

/// Coils along z of the tracker's frame, tip at z = 0, `scale` mm a stated mm; 10 s at 20 Hz; noise 0.2 mm.
void write_groove(const TemporaryFolder& folder, double scale, double period_s = 0.05) {
  folder.write("sequence.toml", kRoom);
  folder.write("frames.csv", "frame,t_s,camera,file\n1,0.0,A,\n");
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 0.2);
  std::ostringstream em;
  em << "t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n";
  const std::vector<double> offsets{12, 90, 170, 270, 370};
  for (int i = 0; i < 200; ++i) {
    for (std::size_t k = 0; k < offsets.size(); ++k) {
      em << i * period_s << ',' << i << ',' << k + 1 << ",OK," << noise(random) << ',' << noise(random) << ','
         << scale * (offsets[k] + noise(random)) << ",0,0,-1,0,1,0,0,0.1\n";
    }
  }
  folder.write("em.csv", em.str());
}

TEST(CalibrateCoils, AGrooveWithATouchedTipGivesAFragmentWithBeforeAndAfter) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  const CalibrateOutcome outcome = calibrate({"coils", "--tip", "0,0,0", folder.path().string()});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_NE(outcome.out.find("offset_from_tip_mm"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("offset_sigma_mm"), std::string::npos);
  EXPECT_NE(outcome.out.find("coil 1 (sensor 1): 10.0 mm before, 1"), std::string::npos);
}

TEST(CalibrateCoils, AFragmentIsWrittenBesideJsonToo) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  const CalibrateOutcome outcome = calibrate({"coils", "--tip", "0,0,0", folder.path().string(), "--json",
                                              "-", "--out", (folder.path() / "coils.toml").string()});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["coils"].size(), 5U);
  EXPECT_NE(folder.read("coils.toml").find("offset_from_tip_mm"), std::string::npos);
}

TEST(CalibrateCoils, AChangeOfMoreThanTwoMillimetresIsWarnedOf) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  const CalibrateOutcome outcome = calibrate({"coils", "--tip", "0,0,-5", folder.path().string()});
  EXPECT_NE(outcome.out.find("WARNING: by more than 2 mm"), std::string::npos) << outcome.out;
}

TEST(CalibrateCoils, MetresInsteadOfMillimetresAreToldByTheDistances) {
  const TemporaryFolder folder;
  write_groove(folder, 0.001);
  const CalibrateOutcome outcome = calibrate({"coils", folder.path().string()});
  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_NE(outcome.err.find("units"), std::string::npos) << outcome.err;
}

TEST(CalibrateCoils, TimeStampsThatStandStillAreRefused) {
  const TemporaryFolder folder;
  write_groove(folder, 1, 0);
  const CalibrateOutcome outcome = calibrate({"coils", folder.path().string()});
  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_NE(outcome.err.find("stand still"), std::string::npos) << outcome.err;
}

TEST(CalibrateCoils, AFolderThatIsNotThereIsBadDataAndNoCrash) {
  EXPECT_EQ(calibrate({"coils", "/nowhere"}).exit_code, kExitBadData);
  EXPECT_EQ(calibrate({"noise", "/nowhere"}).exit_code, kExitBadData);
}

TEST(CalibrateCoils, AReversedOrderIsBadDataAndNothingIsOffered) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  const CalibrateOutcome outcome =
      calibrate({"coils", "--tip", "0,0,380", "--json", "-", folder.path().string()});
  EXPECT_EQ(outcome.exit_code, kExitBadData);
  EXPECT_NE(outcome.err.find("order is reversed"), std::string::npos) << outcome.err;
  EXPECT_EQ(nlohmann::json::parse(outcome.out)["mistakes"].size(), 1U);
}

TEST(CalibrateCoils, ATipThatIsNoPlaceIsRefused) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  for (const char* const tip : {"1,2", "1,2,x", "1,2,3,4", "nan,0,0"}) {
    const CalibrateOutcome outcome = calibrate({"coils", "--tip", tip, folder.path().string()});
    EXPECT_EQ(outcome.exit_code, kExitBadData) << tip;
    EXPECT_NE(outcome.err.find("expected X,Y,Z"), std::string::npos) << outcome.err;
  }
}

TEST(CalibrateCoils, AReportIsAnSvgPage) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  const std::string page = (folder.path() / "page.svg").string();
  EXPECT_EQ(calibrate({"coils", folder.path().string(), "--report", page}).exit_code, kExitOk);
  EXPECT_NE(folder.read("page.svg").find("</svg>"), std::string::npos);
}

TEST(CalibrateNoise, StillCoilsGiveNumbersAndSetNoSigmaOfTheirOwn) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  const CalibrateOutcome json = calibrate({"noise", folder.path().string(), "--json", "-"});
  ASSERT_EQ(json.exit_code, kExitOk) << json.err;
  EXPECT_NEAR(nlohmann::json::parse(json.out)["position_mm"], 0.2, 0.02);
  const CalibrateOutcome fragment = calibrate({"noise", folder.path().string()});
  EXPECT_EQ(fragment.out.find("sigma_position_mm ="), std::string::npos) << fragment.out;
  EXPECT_NE(fragment.out.find("still coils do not show the field"), std::string::npos);
}

TEST(CalibrateNoise, WithTheFieldsErrorKnownSigmaIsBothTogether) {
  const TemporaryFolder folder;
  write_groove(folder, 1);
  const CalibrateOutcome outcome = calibrate({"noise", folder.path().string(), "--field-mm", "0.9"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_NE(outcome.out.find("sigma_position_mm = 0.92"), std::string::npos)
      << outcome.out;  // hypot(0.2, 0.9)
}

}  // namespace
}  // namespace tubed
