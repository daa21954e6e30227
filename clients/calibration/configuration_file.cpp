// Replaces a configuration file in one step and keeps what it was before.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <ctime>
#include <system_error>

#include "clients/calibration/configuration_fragment.hpp"

namespace tubed {

namespace {

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& what) {
  throw FragmentError(file.string() + " " + what + ": " + std::generic_category().message(errno));
}

void write_all(const std::filesystem::path& file, const std::string& text, mode_t permissions) {
  const int handle = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, permissions);
  if (handle < 0) {
    refuse(file, "cannot be made");
  }
  std::size_t written = 0;
  bool is_well = true;
  while (is_well && written < text.size()) {
    const ssize_t count = ::write(handle, text.data() + written, text.size() - written);
    is_well = count > 0 || (count < 0 && errno == EINTR);
    written += count > 0 ? static_cast<std::size_t>(count) : 0;
  }
  is_well = is_well && ::fchmod(handle, permissions) == 0 && ::fsync(handle) == 0;
  const int error = errno;
  ::close(handle);
  if (!is_well) {
    ::unlink(file.c_str());
    errno = error;
    refuse(file, "cannot be written");
  }
}

std::filesystem::path copy_beside(const std::filesystem::path& file) {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  std::string stamp(32, '\0');
  stamp.resize(std::strftime(stamp.data(), stamp.size(), ".before-%Y%m%d-%H%M%S", &local));
  std::filesystem::path copy = file.string() + stamp;
  for (int i = 2; std::filesystem::exists(copy); ++i) {
    copy = file.string() + stamp + "-" + std::to_string(i);
  }
  return copy;
}

}  // namespace

std::filesystem::path replace_configuration(const std::filesystem::path& file, const std::string& text) {
  // A link stays one: what it points to is replaced.
  std::error_code error;
  const std::filesystem::path target = std::filesystem::canonical(file, error);
  struct stat about {};
  if (error || ::stat(target.c_str(), &about) != 0) {
    errno = error ? error.value() : errno;
    refuse(file, "cannot be replaced");
  }
  const std::filesystem::path copy = copy_beside(target);
  const std::filesystem::path fresh = target.string() + ".new";
  std::filesystem::remove(fresh, error);
  write_all(fresh, text, about.st_mode & 07777U);
  if (::chown(fresh.c_str(), about.st_uid, about.st_gid) != 0 || ::link(target.c_str(), copy.c_str()) != 0 ||
      ::rename(fresh.c_str(), target.c_str()) != 0) {
    const int reason = errno;
    ::unlink(fresh.c_str());
    errno = reason;
    refuse(file, "cannot be replaced");
  }
  return copy;
}

}  // namespace tubed
