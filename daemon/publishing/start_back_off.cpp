#include "daemon/publishing/start_back_off.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>
#include <system_error>

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kFirst{200};
constexpr std::chrono::milliseconds kLast{2000};

}  // namespace

std::chrono::milliseconds back_off_after(unsigned failed_starts) {
  if (failed_starts == 0) return std::chrono::milliseconds{0};
  return std::min(kLast, kFirst * (1 << (std::min(failed_starts, kMaxCountedStarts) - 1)));
}

std::filesystem::path runtime_directory_of_environment() {
  const char* const folders = std::getenv("RUNTIME_DIRECTORY");  // several are parted by colons
  const std::string text = folders == nullptr ? "" : folders;
  return text.substr(0, text.find(':'));
}

StartBackOff::StartBackOff(const std::filesystem::path& folder)
    : file_(folder.empty() ? folder : folder / "failed-starts") {}

unsigned StartBackOff::begin() {
  if (file_.empty()) return 0;
  unsigned failed = 0;
  if (std::ifstream file(file_); !(file >> failed) || failed > kMaxCountedStarts + 1) failed = 0;
  std::ofstream(file_, std::ios::trunc) << std::min(failed, kMaxCountedStarts) + 1 << '\n';
  return failed;
}

void StartBackOff::succeed() const noexcept {
  std::error_code ignored;
  if (!file_.empty()) std::filesystem::remove(file_, ignored);
}

}  // namespace tubed
