#include "clients/dicom/dicom_run.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcrleerg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djencode.h>
#include <dcmtk/dcmjpeg/djrplol.h>
#include <dcmtk/dcmjpeg/djrploss.h>
#include <dcmtk/dcmjpls/djencode.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace tubed {
namespace {

constexpr int kColumns = 24;
constexpr int kRows = 17;

/// What a file says; tests change single values.
struct RunSays {
  std::string modality = "XA";
  std::string series = "1.2.3";
  std::string number = "1";
  std::string meaning = "MONOCHROME2";
  std::string frames = "3";
  std::string frame_time_ms = "66.6667";
  std::string frame_times_ms;
  std::string cine_rate;
  std::string relation;
  std::string turns_deg;
  int columns = kColumns;
  int allocated = 16, stored = 12, high = 11;
  int representation = 0;
  int channels = 1;
  int frames_written = 3;
  Uint16 overlay = 0;  ///< in the bits that no level uses
  E_TransferSyntax syntax = EXS_LittleEndianExplicit;
};

/// The level of a pixel, of 12 bits: smooth, so that lossy compression keeps it, and from 0 to 4095, so that
/// DCMTK's encoder, which stretches levels, keeps them as well.
unsigned level(int frame, int column, int row) {
  const bool is_last = frame == 2 && column == kColumns - 1 && row == kRows - 1;
  return static_cast<unsigned>(120 * column + 70 * row + 107 * frame + (is_last ? 1 : 0));
}

unsigned at(const DicomRun& run, int frame, int column, int row) {
  const std::vector<std::uint8_t>& pixels = run.frames[static_cast<std::size_t>(frame)].pixels;
  const auto pixel = static_cast<std::size_t>(row * run.width + column);
  if (run.depth == PixelDepth::kGrey8) return pixels[pixel];
  return pixels[2 * pixel] + 256U * pixels[2 * pixel + 1];
}

class DicomRunTest : public ::testing::Test {
 protected:
  DicomRunTest()
      : folder_(std::filesystem::path(::testing::TempDir()) /
                ("run_" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    DJEncoderRegistration::registerCodecs();
    DJLSEncoderRegistration::registerCodecs();
    DcmRLEEncoderRegistration::registerCodecs();
  }
  ~DicomRunTest() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path write(const std::string& name, const RunSays& says = {}) const {
    DcmFileFormat format;
    DcmDataset& dataset = *format.getDataset();
    const auto say = [&dataset](const DcmTagKey& tag, const std::string& value) {
      if (!value.empty()) dataset.putAndInsertString(tag, value.c_str());
    };
    say(DCM_SOPClassUID, UID_XRayAngiographicImageStorage);
    say(DCM_SOPInstanceUID, "1.2.3.4." + std::to_string(name.size()));
    say(DCM_PatientName, "Secret^Patient");
    say(DCM_Modality, says.modality);
    say(DCM_SeriesInstanceUID, says.series);
    say(DCM_InstanceNumber, says.number);
    say(DCM_PhotometricInterpretation, says.meaning);
    say(DCM_NumberOfFrames, says.frames);
    say(DCM_FrameTime, says.frame_time_ms);
    say(DCM_FrameTimeVector, says.frame_times_ms);
    say(DCM_CineRate, says.cine_rate);
    say(DCM_PixelIntensityRelationship, says.relation);
    say(DCM_PositionerPrimaryAngleIncrement, says.turns_deg);
    const auto count = [&dataset](const DcmTagKey& tag, int value) {
      dataset.putAndInsertUint16(tag, static_cast<Uint16>(value));
    };
    count(DCM_Columns, says.columns);
    count(DCM_Rows, kRows);
    count(DCM_SamplesPerPixel, says.channels);
    count(DCM_BitsAllocated, says.allocated);
    count(DCM_BitsStored, says.stored);
    count(DCM_HighBit, says.high);
    count(DCM_PixelRepresentation, says.representation);
    put_pixels(says, dataset);
    if (says.syntax != EXS_LittleEndianExplicit) {
      const DJ_RPLossy lossy(95);
      const DJ_RPLossless lossless;
      const DcmRepresentationParameter* how = nullptr;
      if (says.syntax == EXS_JPEGProcess1 || says.syntax == EXS_JPEGProcess2_4) how = &lossy;
      if (says.syntax == EXS_JPEGProcess14SV1) how = &lossless;
      EXPECT_TRUE(dataset.chooseRepresentation(says.syntax, how).good());
      format.loadAllDataIntoMemory();
    }
    const std::filesystem::path file = folder_ / name;
    EXPECT_TRUE(format.saveFile(file.c_str(), says.syntax).good());
    return file;
  }

  static void put_pixels(const RunSays& says, DcmDataset& dataset) {
    std::vector<Uint16> wide;
    std::vector<Uint8> narrow;
    for (int frame = 0; frame < says.frames_written; ++frame) {
      for (int row = 0; row < kRows; ++row) {
        for (int column = 0; column < says.columns; ++column) {
          const unsigned all = level(frame, column, row);
          narrow.push_back(static_cast<Uint8>(all >> 4));
          wide.push_back(static_cast<Uint16>(all << (says.high + 1 - says.stored) | says.overlay));
        }
      }
    }
    if (says.allocated == 8) {
      dataset.putAndInsertUint8Array(DCM_PixelData, narrow.data(), narrow.size());
    } else {
      dataset.putAndInsertUint16Array(DCM_PixelData, wide.data(), wide.size());
    }
  }

  static std::string refusal_of(const std::filesystem::path& path, const DicomRunOptions& options = {}) {
    try {
      read_dicom_run(path, options);
    } catch (const DicomError& error) {
      const std::string words = error.what();
      EXPECT_NE(words.find(path.string()), std::string::npos) << words;
      EXPECT_EQ(words.find("Secret"), std::string::npos) << words;
      return words;
    }
    return {};
  }

  std::filesystem::path folder_;
};

TEST_F(DicomRunTest, FramesAndTimesAreAsStored) {
  const DicomRun run = read_dicom_run(write("run.dcm"));
  EXPECT_EQ(run.width, kColumns);
  EXPECT_EQ(run.height, kRows);
  EXPECT_EQ(run.depth, PixelDepth::kGrey16);
  EXPECT_EQ(run.bits_stored, 12);
  ASSERT_EQ(run.frames.size(), 3U);
  EXPECT_NEAR(run.period_s, 1 / 15.0, 1e-6);
  for (int frame = 0; frame < 3; ++frame) {
    EXPECT_NEAR(run.frames[static_cast<std::size_t>(frame)].t_s, frame / 15.0, 1e-5);
    for (int row = 0; row < kRows; ++row) {
      for (int column = 0; column < kColumns; ++column) {
        ASSERT_EQ(at(run, frame, column, row), level(frame, column, row));
      }
    }
  }
  EXPECT_TRUE(run.remarks.empty());
}

TEST_F(DicomRunTest, EveryCompressionGivesThePixelsBack) {
  struct Case {
    const char* name;
    E_TransferSyntax syntax;
    int allocated;
    double most_off;  ///< grey levels
  };
  for (const Case& one :
       {Case{"rle", EXS_RLELossless, 16, 0}, Case{"rle8", EXS_RLELossless, 8, 0},
        Case{"lossless", EXS_JPEGProcess14SV1, 16, 0}, Case{"JPEG-LS", EXS_JPEGLSLossless, 16, 0},
        Case{"JPEG-LS 8", EXS_JPEGLSLossless, 8, 0}, Case{"baseline", EXS_JPEGProcess1, 8, 3},
        Case{"extended", EXS_JPEGProcess2_4, 16, 30}, Case{"big endian", EXS_BigEndianExplicit, 16, 0},
        Case{"implicit", EXS_LittleEndianImplicit, 16, 0}}) {
    RunSays says;
    says.syntax = one.syntax;
    says.allocated = one.allocated;
    says.stored = one.allocated == 8 ? 8 : 12;
    says.high = says.stored - 1;
    const DicomRun run = read_dicom_run(write(one.name, says));
    ASSERT_EQ(run.frames.size(), 3U) << one.name;
    double most_off = 0;
    for (int frame = 0; frame < 3; ++frame) {
      for (int row = 0; row < kRows; ++row) {
        for (int column = 0; column < kColumns; ++column) {
          const double wanted = level(frame, column, row) >> (one.allocated == 8 ? 4 : 0);
          most_off = std::max(most_off, std::abs(at(run, frame, column, row) - wanted));
        }
      }
    }
    EXPECT_LE(most_off, one.most_off) << one.name;
  }
}

TEST_F(DicomRunTest, BitsLieWhereTheFileSays) {
  RunSays high;  // 10 bits, left-aligned in 12
  high.stored = 12;
  high.high = 15;
  EXPECT_EQ(at(read_dicom_run(write("high.dcm", high)), 1, 3, 4), level(1, 3, 4));
  RunSays overlaid;
  overlaid.overlay = 0xF000;
  EXPECT_EQ(at(read_dicom_run(write("overlaid.dcm", overlaid)), 1, 3, 4), level(1, 3, 4));
  RunSays inverted;
  inverted.meaning = "MONOCHROME1";
  EXPECT_EQ(at(read_dicom_run(write("inverted.dcm", inverted)), 1, 3, 4), 4095 - level(1, 3, 4));
  RunSays with_sign;  // -2048 is the darkest
  with_sign.representation = 1;
  EXPECT_EQ(at(read_dicom_run(write("sign.dcm", with_sign)), 1, 3, 4), level(1, 3, 4) ^ 2048U);
}

TEST_F(DicomRunTest, TimesAreWhatTheFileOrThePersonSays) {
  RunSays uneven;
  uneven.frame_times_ms = "0\\40\\120";
  const DicomRun run = read_dicom_run(write("uneven.dcm", uneven));
  EXPECT_NEAR(run.frames[1].t_s, 0.04, 1e-9);
  EXPECT_NEAR(run.frames[2].t_s, 0.16, 1e-9);
  EXPECT_NEAR(run.period_s, 0.08, 1e-9);
  RunSays cine;
  cine.frame_time_ms = "";
  cine.cine_rate = "25";
  EXPECT_NEAR(read_dicom_run(write("cine.dcm", cine)).period_s, 0.04, 1e-9);
  RunSays none;
  none.frame_time_ms = "";
  EXPECT_NE(refusal_of(write("none.dcm", none)).find("give --rate"), std::string::npos);
  EXPECT_NEAR(read_dicom_run(folder_ / "none.dcm", {.rate_hz = 10}).frames[2].t_s, 0.2, 1e-9);
  RunSays still;
  still.frame_times_ms = "0\\0\\0";
  EXPECT_NE(refusal_of(write("still.dcm", still)).find("no time passes"), std::string::npos);
  RunSays backwards;
  backwards.frame_times_ms = "0\\40\\-40";
  EXPECT_NE(refusal_of(write("backwards.dcm", backwards)).find("for frame 3"), std::string::npos);
}

TEST_F(DicomRunTest, AFolderIsOneRunInTheOrderOfItsNumbers) {
  RunSays second;
  second.number = "2";
  RunSays first;
  first.number = "1";
  first.frames = "1";
  first.frames_written = 1;
  write("a.dcm", second);
  write("b.dcm", first);
  const DicomRun run = read_dicom_run(folder_);
  ASSERT_EQ(run.frames.size(), 4U);
  EXPECT_EQ(at(run, 1, 0, 0), level(0, 0, 0));  // the first of the second file
  EXPECT_EQ(at(run, 3, 0, 0), level(2, 0, 0));
  EXPECT_NEAR(run.frames[3].t_s, 3 / 15.0, 1e-5);

  RunSays other;
  other.series = "1.2.4";
  write("c.dcm", other);
  EXPECT_THROW(read_dicom_run(folder_), DicomError);
  RunSays wider;
  wider.columns = 32;
  write("c.dcm", wider);
  EXPECT_THROW(read_dicom_run(folder_), DicomError);
}

TEST_F(DicomRunTest, WhatAPersonShouldKnowIsRemarked) {
  RunSays says;
  says.relation = "LOG";
  says.turns_deg = "0\\0.4\\0.8";
  const DicomRun run = read_dicom_run(write("turns.dcm", says));
  ASSERT_EQ(run.remarks.size(), 2U);
  EXPECT_NE(run.remarks[0].find("C-arm turns"), std::string::npos);
  EXPECT_NE(run.remarks[1].find("response = \"log\""), std::string::npos);
}

TEST_F(DicomRunTest, WhatIsNoRunIsRefusedInWords) {
  const auto refused = [this](const std::function<void(RunSays&)>& change, const std::string& words) {
    RunSays says;
    change(says);
    const std::string refusal = refusal_of(write("bad.dcm", says));
    EXPECT_NE(refusal.find(words), std::string::npos) << refusal << ", expected " << words;
  };
  refused([](RunSays& s) { s.modality = "CT"; }, "modality \"CT\"");
  refused([](RunSays& s) { s.meaning = "RGB", s.channels = 3; }, "is RGB");
  refused([](RunSays& s) { s.frames = "0"; }, "has 0 frames");
  refused([](RunSays& s) { s.frames = "-4"; }, "has -4 frames");
  refused([](RunSays& s) { s.frames = "7"; }, "end early");
  refused([](RunSays& s) { s.columns = 0; }, "has no picture");
  refused([](RunSays& s) { s.allocated = 32; }, "pixels of 12 bits in 32");
  refused([](RunSays& s) { s.high = 16; }, "the highest is 16");
  EXPECT_NE(refusal_of(write("good.dcm"), {.rate_hz = 0, .memory_limit = 1 << 10}).find("is too large"),
            std::string::npos);
  EXPECT_NE(refusal_of(folder_ / "missing.dcm").find("is no DICOM file"), std::string::npos);
  std::ofstream(folder_ / "text.dcm") << "no pictures here";
  EXPECT_FALSE(refusal_of(folder_ / "text.dcm").empty());
  std::filesystem::create_directories(folder_ / "empty");
  EXPECT_NE(refusal_of(folder_ / "empty").find("has no files"), std::string::npos);
}

TEST_F(DicomRunTest, WhatIsPackedSmallIsRefusedByWhatItBecomes) {
  RunSays says;
  says.frames = "100";
  says.frames_written = 1;  // decoded, 81,600 bytes
  const auto file = write("packed.dcm", says);
  EXPECT_NE(refusal_of(file, {.rate_hz = 0, .memory_limit = 64 << 10}).find("makes the run larger"),
            std::string::npos);
}

/// DCMTK's own log quotes values.
TEST_F(DicomRunTest, NothingOfABrokenFileIsLogged) {
  std::ifstream whole(write("whole.dcm"), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(whole)), std::istreambuf_iterator<char>());
  std::ofstream(folder_ / "cut.dcm", std::ios::binary) << bytes.substr(0, bytes.size() / 2);
  ::testing::internal::CaptureStderr();
  EXPECT_FALSE(refusal_of(folder_ / "cut.dcm").empty());
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

/// Cut anywhere and with bytes turned over anywhere: a run, or words.
TEST_F(DicomRunTest, BrokenFilesAreReadOrRefused) {
  std::mt19937 random(17);
  int refused = 0, read = 0;
  for (const E_TransferSyntax syntax : {EXS_LittleEndianExplicit, EXS_RLELossless, EXS_JPEGProcess14SV1}) {
    RunSays says;
    says.syntax = syntax;
    std::ifstream whole(write("whole.dcm", says), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(whole)), std::istreambuf_iterator<char>());
    for (int i = 0; i < 400; ++i) {
      std::string broken = bytes.substr(0, i % 4 == 0 ? random() % bytes.size() : bytes.size());
      const int turned = i % 4 == 0 ? 0 : 1 + static_cast<int>(random() % 4);
      for (int k = 0; k < turned; ++k)
        broken[random() % broken.size()] ^= static_cast<char>(1U << random() % 8);
      const std::filesystem::path file = folder_ / "broken.dcm";
      std::ofstream(file, std::ios::binary) << broken;
      try {
        const DicomRun run = read_dicom_run(file, {.rate_hz = 0, .memory_limit = 64 << 20});
        for (const DicomFrame& frame : run.frames) {
          ASSERT_EQ(frame.pixels.size(), static_cast<std::size_t>(run.width) *
                                             static_cast<std::size_t>(run.height) *
                                             (run.depth == PixelDepth::kGrey8 ? 1 : 2));
        }
        ++read;
      } catch (const DicomError&) {
        ++refused;
      }
    }
  }
  EXPECT_GT(refused, 100);
  EXPECT_GT(read, 100);  // most bits are pixels
}

}  // namespace
}  // namespace tubed
