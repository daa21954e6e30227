#include "idl/shm_segment.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string>

#include "idl/shm_layout.hpp"
#include "idl/shm_ring.hpp"
#include "tests/idl/shm_bed.hpp"

namespace tubed {
namespace {

TEST(ShmSegment, WhatIsNotSealedIsNotBelieved) {
  const int descriptor = memfd_create("unsealed", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(ftruncate(descriptor, 8192), 0);
  EXPECT_THROW(ShmSegment::adopt(descriptor), ShmError);
}

TEST(ShmSegment, MemoryWithHolesIsNotBelieved) {
  const int descriptor = memfd_create("hollow", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(ftruncate(descriptor, 8192), 0);
  ASSERT_EQ(fcntl(descriptor, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE), 0);
  EXPECT_THROW(ShmSegment::adopt(descriptor), ShmError);
}

TEST(ShmSegment, MemoryThatTheWriterCouldTakeAwayLaterIsNotBelieved) {
  const int descriptor = memfd_create("sealed too little", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(fallocate(descriptor, 0, 0, 8192), 0);
  ASSERT_EQ(fcntl(descriptor, F_ADD_SEALS, F_SEAL_SHRINK | F_SEAL_GROW), 0);
  EXPECT_THROW(ShmSegment::adopt(descriptor), ShmError);
}

constexpr int kWriterSeals = F_SEAL_SHRINK | F_SEAL_GROW | F_SEAL_FUTURE_WRITE;

std::string complaint_about(int descriptor, std::uint64_t max_bytes = kShmMaxSegmentBytes) {
  try {
    ShmSegment::adopt(descriptor, max_bytes);
  } catch (const ShmError& error) {
    return error.what();
  }
  return "";
}

TEST(ShmSegment, HolesAreSeenBehindBlocksBeyondTheEnd) {
  constexpr off_t kBytes = 64 * 4096;
  const int descriptor = memfd_create("hollow", MFD_CLOEXEC | MFD_ALLOW_SEALING);
  ASSERT_EQ(ftruncate(descriptor, kBytes), 0);
  ASSERT_EQ(fallocate(descriptor, FALLOC_FL_KEEP_SIZE, kBytes, kBytes), 0);
  struct stat status {};
  ASSERT_EQ(fstat(descriptor, &status), 0);
  ASSERT_GE(status.st_blocks * 512, kBytes) << "the blocks make up for the holes";
  ASSERT_EQ(fcntl(descriptor, F_ADD_SEALS, kWriterSeals), 0);
  EXPECT_NE(complaint_about(descriptor).find("has holes"), std::string::npos);
}

TEST(ShmSegment, MoreThanTheReaderExpectsIsRefusedBeforeItIsMapped) {
  const ShmSegment segment = ShmSegment::create("large", 1U << 20U);
  const std::string words = complaint_about(dup(segment.descriptor()), (1U << 20U) - 1);
  EXPECT_NE(words.find("has 1048576 bytes, expected at most 1048575"), std::string::npos) << words;
}

TEST(ShmSegment, AHeaderThatDoesNotFitIsRefusedBeforeAnythingIsMapped) {
  const ShmSegment segment = ShmSegment::create("blank", 8192);
  EXPECT_EQ(complaint_about(dup(segment.descriptor())), "the shared memory is none of tubed's");
  ShmRingWriter ring(segment.memory(), {2, 64}, {TUBED_SHM_IMAGES, 1, "A", 1}, 0);
  EXPECT_EQ(complaint_about(dup(segment.descriptor())), "");
  reinterpret_cast<tubed_shm_header*>(segment.memory())->slot_count = 1000;
  EXPECT_EQ(complaint_about(dup(segment.descriptor())), "the shared memory is smaller than its header says");
}

TEST(ShmSegment, OnlyWhatTheHeaderNamesIsMapped) {
  const ShmSegment segment = ShmSegment::create("more than its header says", 1U << 20U);
  const ShmGeometry geometry{2, 64};
  ShmRingWriter ring(segment.memory(), geometry, {TUBED_SHM_IMAGES, 1, "A", 1}, 0);
  EXPECT_EQ(ShmSegment::adopt(dup(segment.descriptor())).bytes(), geometry.segment_bytes());
}

long page_faults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

/// Page faults of writing all of a new segment and reading it through another mapping, in a process that
/// locks its memory as the daemon does; -1 when this user may not.
int faults_of_using_a_segment() {
  if (mlockall(MCL_CURRENT) != 0 || mlockall(MCL_FUTURE | MCL_ONFAULT) != 0) {
    return -1;
  }
  const ShmGeometry geometry{4, 1U << 18U};
  const ShmSegment written = ShmSegment::create("used", geometry.segment_bytes());
  ShmRingWriter ring(written.memory(), geometry, {TUBED_SHM_IMAGES, 1, "A", 1}, 0);
  const ShmSegment read = ShmSegment::adopt(dup(written.descriptor()));
  std::byte sum{};
  const long before = page_faults();
  for (std::size_t at = 0; at < read.bytes(); at += 4096) {
    static_cast<volatile std::byte&>(written.memory()[at + 8]) = std::byte{1};
    sum ^= read.memory()[at + 8];
  }
  const long faults = page_faults() - before;
  return static_cast<int>(std::min(faults, 200L)) + (sum == std::byte{2} ? 1 : 0);
}

TEST(ShmSegment, ARealTimeThreadThatWritesOrReadsWaitsForNoPage) {
  const pid_t child = fork();
  if (child == 0) {
    _exit(faults_of_using_a_segment() & 0xff);
  }
  int status = 0;
  waitpid(child, &status, 0);
  if (WEXITSTATUS(status) == 0xff) {
    GTEST_SKIP() << "SKIPPED: locking memory is refused; ulimit -l unlimited";
  }
  EXPECT_LE(WEXITSTATUS(status), 2) << "of 257 pages, both ways";
}

TEST(ShmSegment, AFileIsNotBelieved) {
  const ShmFolder folder;
  const int descriptor = open((folder.path() + "/file").c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0600);
  EXPECT_THROW(ShmSegment::adopt(descriptor), ShmError);
}

}  // namespace
}  // namespace tubed
