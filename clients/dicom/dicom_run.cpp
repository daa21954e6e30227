#include "clients/dicom/dicom_run.hpp"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dctk.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>

namespace tubed {

namespace {

constexpr double kMaxPeriod_s = 60;
constexpr Sint32 kMaxFrames = 100000;

/// DCMTK's decoders and its log, which quotes values, are the process's.
void prepare_dcmtk() {
  static std::once_flag once;
  std::call_once(once, [] {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
    DcmRLEDecoderRegistration::registerCodecs();
  });
}

class RunFile {
 public:
  explicit RunFile(std::filesystem::path path) : path_(std::move(path)) {
    const OFCondition read =
        format_.loadFile(path_.c_str(), EXS_Unknown, EGL_noChange, DCM_MaxReadLength, ERM_autoDetect);
    if (read.bad()) refuse(std::string("is no DICOM file that can be read (") + read.text() + ")");
    const std::string modality = text(DCM_Modality);
    if (modality != "XA" && modality != "RF") {
      refuse("is of modality \"" + modality + "\", expected XA or RF: a run of the C-arm");
    }
    check_pixels();
  }

  [[noreturn]] void refuse(const std::string& words) const {
    throw DicomError(path_.string() + ": " + words);
  }

  [[nodiscard]] const std::filesystem::path& path() const { return path_; }
  [[nodiscard]] std::string series() { return text(DCM_SeriesInstanceUID); }
  [[nodiscard]] long number() { return std::strtol(text(DCM_InstanceNumber).c_str(), nullptr, 10); }
  [[nodiscard]] int width() const { return static_cast<int>(columns_); }
  [[nodiscard]] int height() const { return static_cast<int>(rows_); }
  [[nodiscard]] int frame_count() const { return frames_; }
  [[nodiscard]] int bits_stored() const { return stored_; }
  [[nodiscard]] PixelDepth depth() const {
    return allocated_ == 8 ? PixelDepth::kGrey8 : PixelDepth::kGrey16;
  }
  [[nodiscard]] std::uintmax_t bytes() const {
    return std::uintmax_t{rows_} * columns_ * static_cast<unsigned>(frames_) * (allocated_ / 8U);
  }
  [[nodiscard]] bool is_same_kind(const RunFile& other) const {
    return rows_ == other.rows_ && columns_ == other.columns_ && allocated_ == other.allocated_ &&
           stored_ == other.stored_;
  }

  /// Times of this file's frames since its first, s, and of the frame that would follow; nothing: not said.
  [[nodiscard]] std::optional<std::vector<double>> times_s();
  /// Frames as DicomRun has them, without times.
  [[nodiscard]] std::vector<DicomFrame> decode();
  void add_remarks(std::vector<std::string>& remarks);

 private:
  DcmDataset& dataset() { return *format_.getDataset(); }
  std::string text(const DcmTagKey& tag) {
    OFString value;
    dataset().findAndGetOFString(tag, value);
    return {value.c_str(), value.size()};
  }
  Uint16 count(const DcmTagKey& tag, Uint16 otherwise = 0) {
    Uint16 value = otherwise;
    dataset().findAndGetUint16(tag, value);
    return value;
  }
  /// Integers, decimals and binary numbers alike; NaN for what is none, empty where nothing is said.
  std::vector<double> numbers(const DcmTagKey& tag);
  std::optional<double> first_number(const DcmTagKey& tag) {
    const std::vector<double> all = numbers(tag);
    return all.empty() || std::isnan(all[0]) ? std::nullopt : std::optional(all[0]);
  }
  void check_pixels();
  std::optional<double> period_s();
  template <typename Stored>
  void take(const Stored* stored, std::vector<DicomFrame>& frames) const;

  std::filesystem::path path_;
  DcmFileFormat format_;
  unsigned rows_ = 0, columns_ = 0, allocated_ = 0;
  int stored_ = 0, shift_ = 0, frames_ = 1;
  bool is_signed_ = false, is_inverted_ = false;
};

std::vector<double> RunFile::numbers(const DcmTagKey& tag) {
  OFString words;
  dataset().findAndGetOFStringArray(tag, words, OFTrue);
  std::istringstream text(std::string(words.c_str(), words.size()));
  std::vector<double> all;
  for (std::string word; std::getline(text, word, '\\');) {
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    const bool is_number = end != word.c_str() && std::isfinite(value);
    all.push_back(is_number ? value : std::numeric_limits<double>::quiet_NaN());
  }
  return all;
}

void RunFile::check_pixels() {
  rows_ = count(DCM_Rows);
  columns_ = count(DCM_Columns);
  Sint32 frames = 1;
  if (dataset().findAndGetSint32(DCM_NumberOfFrames, frames).good() && (frames < 1 || frames > kMaxFrames)) {
    refuse("has " + std::to_string(frames) + " frames, expected 1 to " + std::to_string(kMaxFrames));
  }
  frames_ = frames;
  if (rows_ == 0 || columns_ == 0) refuse("has no picture: Rows (0028,0010) or Columns (0028,0011) is 0");
  const std::string meaning = text(DCM_PhotometricInterpretation);
  is_inverted_ = meaning == "MONOCHROME1";
  if ((!is_inverted_ && meaning != "MONOCHROME2") || count(DCM_SamplesPerPixel, 1) != 1) {
    refuse("is " + meaning + ", expected grey levels, MONOCHROME1 or MONOCHROME2: a screen capture?");
  }
  allocated_ = count(DCM_BitsAllocated);
  stored_ = count(DCM_BitsStored, static_cast<Uint16>(allocated_));
  const int high = count(DCM_HighBit, static_cast<Uint16>(stored_ - 1));
  is_signed_ = count(DCM_PixelRepresentation) == 1;
  shift_ = high + 1 - stored_;
  if ((allocated_ != 8 && allocated_ != 16) || stored_ < 1 || shift_ < 0 ||
      high >= static_cast<int>(allocated_)) {
    refuse("has pixels of " + std::to_string(stored_) + " bits in " + std::to_string(allocated_) +
           ", the highest is " + std::to_string(high) +
           "; expected at most as many in 8 or in 16, the highest below that");
  }
}

std::optional<double> RunFile::period_s() {
  if (const auto ms = first_number(DCM_FrameTime); ms && *ms > 0) return *ms / 1000;
  for (const DcmTagKey& rate : {DCM_CineRate, DCM_RecommendedDisplayFrameRate}) {
    if (const auto hz = first_number(rate); hz && *hz > 0) return 1 / *hz;
  }
  return {};
}

std::optional<std::vector<double>> RunFile::times_s() {
  std::vector<double> times{0};
  const auto period = period_s();
  const std::vector<double> increments_ms = numbers(DCM_FrameTimeVector);  // the first is 0
  if (increments_ms.size() > 1) {
    for (std::size_t i = 1; i < static_cast<std::size_t>(frames_); ++i) {
      const double ms =
          i < increments_ms.size() ? increments_ms[i] : std::numeric_limits<double>::quiet_NaN();
      if (!(ms >= 0 && ms <= kMaxPeriod_s * 1000)) {
        refuse("FrameTimeVector (0018,1065) has no usable time for frame " + std::to_string(i + 1) +
               "; give --rate");
      }
      times.push_back(times.back() + ms / 1000);
    }
    const double mean_s = frames_ > 1 ? times.back() / (frames_ - 1) : period.value_or(0);
    if (!(mean_s > 0)) refuse("FrameTimeVector (0018,1065) says that no time passes; give --rate");
    times.push_back(times.back() + mean_s);
    return times;
  }
  if (!period || *period > kMaxPeriod_s) return {};
  for (int i = 1; i <= frames_; ++i) times.push_back(i * *period);
  return times;
}

template <typename Stored>
void RunFile::take(const Stored* stored, std::vector<DicomFrame>& frames) const {
  const std::size_t pixels = std::size_t{rows_} * columns_;
  const unsigned most = (1U << stored_) - 1;
  const unsigned sign = is_signed_ ? 1U << (stored_ - 1) : 0;  // signed levels begin at the lowest
  const unsigned flip = is_inverted_ ? most : 0;
  for (int i = 0; i < frames_; ++i) {
    DicomFrame& frame = frames.emplace_back();
    frame.pixels.resize(pixels * sizeof(Stored));
    const Stored* const from = stored + static_cast<std::size_t>(i) * pixels;
    for (std::size_t k = 0; k < pixels; ++k) {
      const auto level = static_cast<Stored>((((unsigned{from[k]} >> shift_) & most) ^ sign) ^ flip);
      std::memcpy(&frame.pixels[k * sizeof(Stored)], &level, sizeof(Stored));
    }
  }
}

std::vector<DicomFrame> RunFile::decode() {
  const OFString syntax = DcmXfer(dataset().getOriginalXfer()).getXferName();
  if (dataset().chooseRepresentation(EXS_LittleEndianExplicit, nullptr).bad()) {
    refuse(std::string("is compressed as \"") + syntax.c_str() +
           "\", which cannot be decoded here: JPEG, JPEG-LS, RLE and none can; convert it first, by gdcmconv "
           "--raw");
  }
  check_pixels();  // a decoder may say anew how they are stored
  const std::size_t wanted = bytes();
  std::vector<DicomFrame> frames;
  unsigned long there = 0;
  if (allocated_ == 8) {
    const Uint8* stored = nullptr;
    if (dataset().findAndGetUint8Array(DCM_PixelData, stored, &there).good() && there >= wanted) {
      take(stored, frames);
    }
  } else {
    const Uint16* stored = nullptr;
    if (dataset().findAndGetUint16Array(DCM_PixelData, stored, &there).good() && 2 * there >= wanted) {
      take(stored, frames);
    }
    there *= 2;
  }
  if (frames.empty()) {
    refuse("its pixels end early: " + std::to_string(there) + " bytes of " + std::to_string(wanted) +
           "; was it copied whole?");
  }
  return frames;
}

void RunFile::add_remarks(std::vector<std::string>& remarks) {
  const std::string relation = text(DCM_PixelIntensityRelationship);
  if (relation == "LIN" || relation == "LOG") {
    remarks.push_back("the detector's response is " + relation + ": response = \"" +
                      (relation == "LIN" ? "linear" : "log") + "\" of [[camera]]");
  }
  for (const DcmTagKey& turn : {DCM_PositionerPrimaryAngleIncrement, DCM_PositionerSecondaryAngleIncrement}) {
    const std::vector<double> turned_deg = numbers(turn);
    if (std::any_of(turned_deg.begin(), turned_deg.end(), [](double deg) { return std::abs(deg) > 0.1; })) {
      remarks.emplace_back("the C-arm turns during this run");
      return;
    }
  }
}

std::vector<std::filesystem::path> files_of(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_directory(path, error)) return {path};
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(path)) {
    if (entry.is_regular_file() && entry.path().filename() != "DICOMDIR") files.push_back(entry.path());
  }
  if (files.empty()) throw DicomError(path.string() + ": has no files; expected those of one DICOM series");
  std::sort(files.begin(), files.end());
  return files;
}

void check_one_run(RunFile& first, RunFile& file) {
  if (file.series() != first.series()) {
    file.refuse("belongs to another series than the files before it; give one series, or one file");
  }
  if (!file.is_same_kind(first)) {
    file.refuse("is " + std::to_string(file.width()) + " x " + std::to_string(file.height()) + " of " +
                std::to_string(file.bits_stored()) + " bits, the files before it " +
                std::to_string(first.width()) + " x " + std::to_string(first.height()) + " of " +
                std::to_string(first.bits_stored()));
  }
}

void append(RunFile& file, const DicomRunOptions& options, DicomRun& run, double& end_s) {
  std::optional<std::vector<double>> times = file.times_s();
  if (options.rate_hz > 0) {
    times.emplace();
    for (int i = 0; i <= file.frame_count(); ++i) times->push_back(i / options.rate_hz);
  } else if (!times) {
    file.refuse(
        "says nothing of time: FrameTimeVector, FrameTime, CineRate and RecommendedDisplayFrameRate are "
        "missing; give --rate");
  }
  std::vector<DicomFrame> frames = file.decode();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    frames[i].t_s = end_s + (*times)[i];
    frames[i].file = run.files.size();
    frames[i].number_in_file = static_cast<int>(i);
    run.frames.push_back(std::move(frames[i]));
  }
  run.files.push_back(file.path());
  end_s += times->back();
}

}  // namespace

DicomRun read_dicom_run(const std::filesystem::path& path, const DicomRunOptions& options) {
  prepare_dcmtk();
  std::vector<std::unique_ptr<RunFile>> files;
  std::uintmax_t bytes = 0;
  for (const std::filesystem::path& file : files_of(path)) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (!error && size > options.memory_limit) throw DicomError(file.string() + ": is too large to be read");
    files.push_back(std::make_unique<RunFile>(file));
    check_one_run(*files.front(), *files.back());
    bytes += files.back()->bytes();
    if (bytes > options.memory_limit) {
      files.back()->refuse("makes the run larger than " + std::to_string(options.memory_limit >> 20) +
                           " MB: cut it, or play a part of it");
    }
  }
  std::stable_sort(files.begin(), files.end(),
                   [](const auto& a, const auto& b) { return a->number() < b->number(); });
  RunFile& first = *files.front();
  DicomRun run;
  run.width = first.width();
  run.height = first.height();
  run.depth = first.depth();
  run.bits_stored = first.bits_stored();
  double end_s = 0;
  for (auto& file : files) {
    append(*file, options, run, end_s);
    file->add_remarks(run.remarks);
    if (file.get() != &first) file.reset();  // its pixels have been copied
  }
  std::sort(run.remarks.begin(), run.remarks.end());
  run.remarks.erase(std::unique(run.remarks.begin(), run.remarks.end()), run.remarks.end());
  run.period_s = end_s / static_cast<double>(run.frames.size());
  return run;
}

}  // namespace tubed
