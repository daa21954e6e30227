#include "bench/session/session.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <memory>
#include <stdexcept>

#include "bench/session/listeners.hpp"
#include "bench/session/paper_loop.hpp"
#include "bench/support/child_process.hpp"
#include "bench/support/exchange.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

constexpr int kDomain = 50;
constexpr std::int64_t kSecondNs = 1'000'000'000;
constexpr double kStartUpS = 1.5;
constexpr int kSlowPauseMs = 500;
constexpr int kContestantCpu = 0;

std::int64_t in_ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

fs::path new_folder() {
  std::string name = "/tmp/session-XXXXXX";
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make a folder in /tmp");
  return name;
}

std::string words_of(const fs::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// The file into which the library before the daemon writes.
class WrittenFile {
 public:
  WrittenFile(fs::path path, std::size_t most)
      : path_(std::move(path)), bytes_(sizeof(WrittenEstimatesHead) + most * sizeof(WrittenEstimate)) {
    const int file = open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
    if (file < 0 || ftruncate(file, static_cast<off_t>(bytes_)) != 0)
      throw std::runtime_error("cannot write " + path_.string());
    void* memory = mmap(nullptr, bytes_, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (memory == MAP_FAILED) throw std::runtime_error("cannot map " + path_.string());
    head_ = static_cast<WrittenEstimatesHead*>(memory);
    head_->most = most;
  }
  ~WrittenFile() { munmap(head_, bytes_); }
  WrittenFile(const WrittenFile&) = delete;
  WrittenFile& operator=(const WrittenFile&) = delete;

  [[nodiscard]] const fs::path& path() const { return path_; }
  [[nodiscard]] double mb() const { return static_cast<double>(bytes_) / 1e6; }
  void add(const WrittenEstimate& entry) {
    if (head_->count < head_->most) entries()[head_->count++] = entry;
  }
  [[nodiscard]] std::vector<WrittenEstimate> between(std::int64_t from_ns, std::int64_t to_ns) const {
    // acquire: pairs with the release of the library, so that counted entries are whole.
    const std::uint64_t count = __atomic_load_n(&head_->count, __ATOMIC_ACQUIRE);
    std::vector<WrittenEstimate> kept;
    for (std::uint64_t i = 0; i < count; ++i) {
      const WrittenEstimate& entry = entries()[i];
      if (entry.write_called_ns >= from_ns && entry.write_called_ns < to_ns) kept.push_back(entry);
    }
    return kept;
  }

 private:
  [[nodiscard]] WrittenEstimate* entries() const { return reinterpret_cast<WrittenEstimate*>(head_ + 1); }
  fs::path path_;
  std::size_t bytes_;
  WrittenEstimatesHead* head_ = nullptr;
};

class Session {
 public:
  Session(const Scene& scene, const SessionPlan& plan)
      : scene_(scene),
        plan_(plan),
        folder_(new_folder()),
        images_(images_count()),
        written_(folder_ / "written",
                 2 * images_count() * static_cast<std::size_t>(scene.settings().instruments) + 256),
        health_(plan.watches_health ? 16 * static_cast<std::size_t>(duration_s() + 10) : 1),
        over_(sizeof(bool)) {
    for (int i = 0; i < plan.dds_subscribers + plan.slow_subscribers; ++i)
      over_dds_.emplace_back(2 * images_count() + 4096);
    for (int i = 0; i < plan.shm_subscribers; ++i) over_shm_.emplace_back(2 * images_count() + 4096);
    scene.write_em(folder_ / "em", duration_s() + 1);
  }
  ~Session() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  SessionRecord run() {
    start_ns_ = monotonic_ns() + in_ns(kStartUpS);
    start_others();
    start_contestant();
    SessionRecord record;
    record.start_ns = start_ns_ + in_ns(plan_.warm_up_s);
    const std::int64_t end_ns = record.start_ns + in_ns(plan_.seconds);
    for (std::int64_t due_ns = record.start_ns; due_ns <= end_ns; due_ns += kSecondNs) {
      sleep_until_ns(due_ns);
      if (!contestant_.is_running())
        throw std::runtime_error("the contestant ended:\n" + words_of(log_file()));
      record.costs.push_back(
          costs_of(contestant_.id(), static_cast<double>(monotonic_ns() - record.start_ns) / 1e9));
      record.costs.back().resident_mb -= written_.mb();  // ours, not the daemon's
    }
    sleep_until_ns(end_ns + kSecondNs / 4);
    __atomic_store_n(over_.as<bool>(), true, __ATOMIC_RELEASE);  // pairs with is_over()
    contestant_.stop();
    for (ChildProcess& other : others_) other.stop();
    collect(record, end_ns);
    return record;
  }

 private:
  [[nodiscard]] double duration_s() const { return plan_.warm_up_s + plan_.seconds; }
  [[nodiscard]] std::size_t images_count() const {
    return static_cast<std::size_t>((duration_s() + 0.2) * scene_.settings().rate_hz);
  }
  [[nodiscard]] fs::path log_file() const { return folder_ / "contestant.log"; }

  void add_other(std::function<void(const IsOver&)> work, int cpu) {
    others_.emplace_back([this, work = std::move(work), cpu] {
      if (plan_.keep_to_one_cpu && usable_cpus() > 1) stay_on_cpu(cpu);
      work([this] { return __atomic_load_n(over_.as<bool>(), __ATOMIC_ACQUIRE); });
    });
  }

  void start_others() {
    const int cpu = usable_cpus() - 1;
    add_other(
        [this](const IsOver&) {
          grab_images(scene_, folder_, start_ns_, static_cast<std::int64_t>(images_count()), images_);
        },
        cpu);
    for (std::size_t i = 0; i < over_dds_.size(); ++i) {
      const int pause_ms = i < static_cast<std::size_t>(plan_.dds_subscribers) ? 0 : kSlowPauseMs;
      add_other(
          [this, i, pause_ms](const IsOver& over) { listen_to_dds(kDomain, pause_ms, over, over_dds_[i]); },
          cpu);
    }
    for (std::size_t i = 0; i < over_shm_.size(); ++i) {
      add_other([this, i](const IsOver& over) { listen_to_shm(folder_, over, over_shm_[i]); }, cpu);
    }
    for (int i = 0; i < plan_.hogs; ++i) add_other([](const IsOver& over) { hog_cpu(over); }, kContestantCpu);
    if (plan_.watches_health) {
      add_other([this](const IsOver& over) { listen_to_health(kDomain, over, health_); }, cpu);
    }
  }

  void start_contestant() {
    if (plan_.contestant == Contestant::kPaperLoop) {
      contestant_ = ChildProcess([this] {
        if (plan_.keep_to_one_cpu) stay_on_cpu(kContestantCpu);
        const std::int64_t until_ns = start_ns_ + in_ns(duration_s() + 1);
        run_paper_loop(scene_, folder_, kDomain, start_ns_, until_ns,
                       [this](const WrittenEstimate& entry) { written_.add(entry); });
      });
      return;
    }
    const fs::path programs = fs::read_symlink("/proc/self/exe").parent_path();
    const fs::path configuration = folder_ / "tubed.toml";
    std::ofstream(configuration) << scene_configuration(scene_, folder_, kDomain, start_ns_);
    contestant_ =
        ChildProcess({(programs / "tubed").string(), "--config", configuration.string()}, log_file(), [&] {
          if (plan_.keep_to_one_cpu) stay_on_cpu(kContestantCpu);
          setenv("LD_PRELOAD", (programs / "libdds_write_stamps.so").c_str(), 1);
          setenv(kWrittenEstimatesVariable, written_.path().c_str(), 1);
        });
  }

  void collect(SessionRecord& record, std::int64_t end_ns) const {
    for (std::size_t i = 0; i < images_.size(); ++i) {
      if (images_[i].exposure_ns >= record.start_ns && images_[i].exposure_ns < end_ns)
        record.images.push_back(images_[i]);
    }
    record.written = written_.between(record.start_ns, end_ns + kSecondNs / 4);
    collect_received(over_dds_, record.start_ns, record.over_dds);
    collect_received(over_shm_, record.start_ns, record.over_shm);
    std::map<std::string, double> first;
    for (std::size_t i = 0; i < health_.size() && plan_.watches_health; ++i) {
      if (health_[i].received_ns < record.start_ns) continue;
      const auto now = static_cast<double>(health_[i].allocations);
      const double before = first.emplace(health_[i].stage.data(), now).first->second;
      record.thread_allocations[health_[i].stage.data()] = now - before;
    }
  }

  static void collect_received(const std::vector<SharedLog<ReceivedEstimate>>& logs, std::int64_t from_ns,
                               std::vector<std::vector<ReceivedEstimate>>& to) {
    for (const SharedLog<ReceivedEstimate>& log : logs) {
      auto& kept = to.emplace_back();
      for (std::size_t i = 0; i < log.size(); ++i) {
        if (log[i].received_ns >= from_ns) kept.push_back(log[i]);
      }
    }
  }

  const Scene& scene_;
  SessionPlan plan_;
  fs::path folder_;
  std::int64_t start_ns_ = 0;  ///< of exposure 0
  SharedLog<InjectedImage> images_;
  WrittenFile written_;
  SharedLog<StageAllocations> health_;
  SharedMemory over_;
  std::vector<SharedLog<ReceivedEstimate>> over_dds_;
  std::vector<SharedLog<ReceivedEstimate>> over_shm_;
  std::vector<ChildProcess> others_;
  ChildProcess contestant_;
};

}  // namespace

SessionRecord run_session(const Scene& scene, const SessionPlan& plan) { return Session(scene, plan).run(); }

}  // namespace tubed
