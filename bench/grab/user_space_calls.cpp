// Calls of the C library that a program at a capture card makes, loaded in front of it (LD_PRELOAD): the path
// in TUBED_CARD is a card in user space, for machines without one; everything else is handed on.
//
// TUBED_CARD = PATH,WIDTH,HEIGHT,FOURCC,RATE_HZ,PICTURES: pictures from that file, each as its length (32
// bits of this machine) and its bytes, over and over.
#include <fcntl.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>

#include <cerrno>
#include <cstdarg>
#include <cstdlib>

#include "bench/grab/user_space_card.hpp"

using namespace tubed;

namespace {

UserSpaceCard* card() {
  static UserSpaceCard* const only = [] {
    const char* const words = std::getenv("TUBED_CARD");
    return words == nullptr ? nullptr : new UserSpaceCard(words);
  }();
  return only;
}

bool is_card(const char* path) { return card() != nullptr && card()->path() == path; }

}  // namespace

extern "C" {

/// Stamp of the picture that was handed out last; time of a CPU that handing them out has taken so far.
std::int64_t tubed_card_last_stamp_ns() { return card() == nullptr ? 0 : card()->last_stamp_ns(); }
std::int64_t tubed_card_feeding_ns() { return card() == nullptr ? 0 : card()->feeding_ns(); }

int open(const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const auto mode = static_cast<mode_t>(va_arg(rest, int));
  va_end(rest);
  return is_card(path) ? card()->open(flags)
                       : next_of<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

int open64(const char* path, int flags, ...) {
  std::va_list rest;
  va_start(rest, flags);
  const auto mode = static_cast<mode_t>(va_arg(rest, int));
  va_end(rest);
  return is_card(path) ? card()->open(flags)
                       : next_of<int (*)(const char*, int, ...)>("open64")(path, flags, mode);
}

int __open_2(const char* path, int flags) { return open(path, flags); }
int __open64_2(const char* path, int flags) { return open64(path, flags); }

int stat(const char* path, struct stat* out) {
  return next_of<int (*)(const char*, struct stat*)>("stat")(is_card(path) ? "/dev/null" : path, out);
}

int stat64(const char* path, struct stat64* out) {
  return next_of<int (*)(const char*, struct stat64*)>("stat64")(is_card(path) ? "/dev/null" : path, out);
}

int close(int file) {
  if (card() != nullptr && card()->is_original(file)) card()->close();
  return next_of<int (*)(int)>("close")(file);
}

int ioctl(int file, unsigned long request, ...) {
  std::va_list rest;
  va_start(rest, request);
  void* const argument = va_arg(rest, void*);
  va_end(rest);
  if (card() == nullptr || !card()->is(file) || _IOC_TYPE(request) != 'V') {
    return next_of<int (*)(int, unsigned long, ...)>("ioctl")(file, request, argument);
  }
  const int error = card()->control(request & 0xFFFFFFFFUL, argument);
  errno = error == 0 ? errno : error;
  return error == 0 ? 0 : -1;
}

void* mmap(void* where, std::size_t bytes, int protection, int flags, int file, off_t offset) {
  if (file >= 0 && card() != nullptr && card()->is(file)) return card()->map(offset);
  return next_of<void* (*)(void*, std::size_t, int, int, int, off_t)>("mmap")(where, bytes, protection, flags,
                                                                              file, offset);
}

void* mmap64(void* where, std::size_t bytes, int protection, int flags, int file, off64_t offset) {
  if (file >= 0 && card() != nullptr && card()->is(file)) return card()->map(offset);
  return next_of<void* (*)(void*, std::size_t, int, int, int, off64_t)>("mmap64")(where, bytes, protection,
                                                                                  flags, file, offset);
}

int munmap(void* memory, std::size_t bytes) {
  if (card() != nullptr && card()->owns(memory)) return 0;
  return next_of<int (*)(void*, std::size_t)>("munmap")(memory, bytes);
}
}
