// Processes that a benchmark starts, and memory it shares with them.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace tubed {

/// A process that ends with its owner, at the latest. Move-only.
class ChildProcess {
 public:
  ChildProcess() = default;
  /// Forks; the child runs `work` and ends, 1 with its words on stderr when it throws. Call it before this
  /// process has threads. Throws std::system_error.
  explicit ChildProcess(const std::function<void()>& work);
  /// Starts another program, its output into `log`; `prepare` runs in the new process before it.
  ChildProcess(const std::vector<std::string>& command, const std::filesystem::path& log,
               const std::function<void()>& prepare = {});
  /// Asks it to end with SIGTERM, and after 3 s it has to.
  ~ChildProcess();
  ChildProcess(ChildProcess&& other) noexcept : id_(std::exchange(other.id_, -1)) {}
  ChildProcess& operator=(ChildProcess&& other) noexcept {
    std::swap(id_, other.id_);
    return *this;
  }

  [[nodiscard]] pid_t id() const { return id_; }
  /// Waits for its end; its exit code, 128 + signal when one killed it.
  int wait();
  /// As the destructor.
  void stop();
  /// False once it has ended by itself.
  [[nodiscard]] bool is_running() const;

 private:
  pid_t id_ = -1;
};

/// Zeroed memory that this process and the children it forks later share.
class SharedMemory {
 public:
  explicit SharedMemory(std::size_t bytes);
  ~SharedMemory();
  SharedMemory(SharedMemory&& other) noexcept
      : memory_(std::exchange(other.memory_, nullptr)), bytes_(other.bytes_) {}
  SharedMemory& operator=(SharedMemory&&) = delete;

  template <typename T>
  [[nodiscard]] T* as() const {
    return static_cast<T*>(memory_);
  }

 private:
  void* memory_;
  std::size_t bytes_;
};

/// One writer in one process, one reader in another, after the writer has ended or between its entries:
/// entries up to `most`, those beyond are counted only.
template <typename Entry>
class SharedLog {
 public:
  explicit SharedLog(std::size_t most) : memory_(sizeof(Head) + most * sizeof(Entry)), most_(most) {}

  void add(const Entry& entry) {
    Head& head = *memory_.as<Head>();
    if (head.count < most_) entries()[head.count] = entry;
    // release: a reader that sees the count sees the entry.
    __atomic_store_n(&head.count, head.count + 1, __ATOMIC_RELEASE);
  }
  [[nodiscard]] std::size_t size() const {
    const std::size_t count = __atomic_load_n(&memory_.as<Head>()->count, __ATOMIC_ACQUIRE);
    return count < most_ ? count : most_;
  }
  [[nodiscard]] const Entry& operator[](std::size_t i) const { return entries()[i]; }

 private:
  struct alignas(64) Head {
    std::size_t count;
  };
  [[nodiscard]] Entry* entries() const { return reinterpret_cast<Entry*>(memory_.as<Head>() + 1); }

  SharedMemory memory_;
  std::size_t most_;
};

/// Keeps this process, and what it starts, on one CPU (counted from 0; taken modulo the number of those
/// allowed). False when the system refuses.
bool stay_on_cpu(int cpu);

/// Number of CPUs this process may use.
int usable_cpus();

}  // namespace tubed
