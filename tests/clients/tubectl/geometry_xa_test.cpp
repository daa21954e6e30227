// `tubectl geometry xa` on a header as a C-arm writes it, beside a configuration.
#ifdef TUBED_READS_XA

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>
#include <gtest/gtest.h>

#include <CLI/Error.hpp>
#include <fstream>
#include <sstream>

#include "clients/tubectl/verbs.hpp"
#include "daemon/config/sample_configuration.hpp"
#include "tests/clients/tubectl/straight_sequence.hpp"
#include "tests/support/temporary_folder.hpp"

namespace tubed {
namespace {

class GeometryXaTest : public ::testing::Test {
 protected:
  struct Outcome {
    int exit_code = -1;
    std::string out, err;
  };

  void SetUp() override { folder_.write("tubed.toml", sample_configuration({})); }

  [[nodiscard]] std::string angiogram(int columns, int rows) const {
    DcmFileFormat format;
    DcmDataset& dataset = *format.getDataset();
    dataset.putAndInsertString(DCM_SOPClassUID, UID_XRayAngiographicImageStorage);
    dataset.putAndInsertString(DCM_SOPInstanceUID, "1.2.3.4");
    dataset.putAndInsertString(DCM_Modality, "XA");
    dataset.putAndInsertString(DCM_DistanceSourceToDetector, "1100");
    dataset.putAndInsertString(DCM_DistanceSourceToPatient, "750");
    dataset.putAndInsertString(DCM_ImagerPixelSpacing, "0.2\\0.2");
    dataset.putAndInsertUint16(DCM_Columns, static_cast<Uint16>(columns));
    dataset.putAndInsertUint16(DCM_Rows, static_cast<Uint16>(rows));
    const std::string file = (folder_.path() / "angiogram.dcm").string();
    EXPECT_TRUE(format.saveFile(file.c_str(), EXS_LittleEndianExplicit).good());
    return file;
  }

  [[nodiscard]] Outcome geometry_xa(const std::string& file, std::vector<std::string> further) const {
    std::vector<std::string> words{"geometry", "xa", file, "--camera", "A"};
    words.insert(words.end(), further.begin(), further.end());
    testing::internal::CaptureStdout();
    testing::internal::CaptureStderr();
    Outcome outcome;
    try {
      outcome.exit_code = run_verb(add_geometry, words);
    } catch (const CLI::ParseError& error) {
      outcome.exit_code = kExitUsage;
      std::cerr << error.what();
    }
    outcome.out = testing::internal::GetCapturedStdout();
    outcome.err = testing::internal::GetCapturedStderr();
    return outcome;
  }

  [[nodiscard]] std::string config() const { return (folder_.path() / "tubed.toml").string(); }

  TemporaryFolder folder_;
};

TEST_F(GeometryXaTest, IsWrittenIntoTheSampleConfiguration) {
  const Outcome outcome = geometry_xa(angiogram(400, 600), {"--config", config(), "--yes"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  EXPECT_NE(outcome.err.find("commented out: [camera.c_arm] takes its place"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(outcome.err.find("WARNING"), std::string::npos) << outcome.err;
  std::ostringstream text;
  text << std::ifstream(config()).rdbuf();
  EXPECT_NE(text.str().find("source_detector_mm = 1100.0"), std::string::npos);
}

TEST_F(GeometryXaTest, ImagesOfAnotherSizeThanTheCamerasAreWarnedOf) {
  const Outcome outcome = geometry_xa(angiogram(1024, 1024), {"--config", config(), "--yes"});
  EXPECT_EQ(outcome.exit_code, kExitOk) << outcome.err;
  for (const std::string& stream : {outcome.out, outcome.err}) {
    EXPECT_NE(stream.find("has images of 1024 x 1024 px, camera \"A\" of " + config() + " of 400 x 600 px"),
              std::string::npos)
        << stream;
  }
}

TEST_F(GeometryXaTest, APageThatItDoesNotMakeIsNotOffered) {
  const Outcome outcome =
      geometry_xa(angiogram(400, 600), {"--report", (folder_.path() / "page.svg").string()});
  EXPECT_EQ(outcome.exit_code, kExitUsage);
  EXPECT_EQ(outcome.out, "");
}

}  // namespace
}  // namespace tubed

#endif
