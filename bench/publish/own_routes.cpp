#include "bench/publish/own_routes.hpp"

#include <atomic>
#include <thread>

#include "bench/peers/sample_estimate.hpp"
#include "clients/cpp/shm_tube_reader.hpp"
#include "clients/cpp/tube_subscriber.hpp"
#include "daemon/pipeline/doorbell.hpp"
#include "daemon/publishing/dds_publisher.hpp"
#include "daemon/publishing/shm_publisher.hpp"

namespace tubed {

namespace {

constexpr int kDomain = 40;
constexpr int kSecuredDomain = 41;
constexpr std::chrono::milliseconds kTimeout{50};

TubeIdentityValues identity() {
  TubeIdentityValues values;
  values.instrument_id = "cath-1";
  return values;
}

/// Sets what changes from sample to sample.
class Samples {
 public:
  const TubeEstimate& numbered(std::uint32_t number) {
    estimate_.image_frame = number;
    ++estimate_.sequence_number;
    estimate_.stamps.optimizer_started_ns = monotonic_ns();
    return estimate_;
  }

 private:
  TubeEstimate estimate_ = sample_estimate();
};

class DdsSender final : public Sender {
 public:
  DdsSender(int domain, const std::string& keys) : publisher_(settings(domain, keys), {identity()}) {}
  void send(std::uint32_t number) override { publisher_.publish(samples_.numbered(number)); }

 private:
  static DdsSettings settings(int domain, const std::string& keys) {
    DdsSettings dds;
    dds.domain = domain;
    dds.security = keys;
    return dds;
  }
  Samples samples_;
  DdsPublisher publisher_;
};

class DdsReceiver final : public Receiver {
 public:
  DdsReceiver(int domain, std::string keys) : domain_(domain), keys_(std::move(keys)) {}
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    Subscription subscription;
    subscription.domain = domain_;
    subscription.security = keys_;
    subscription.max_rate_hz = 4000;  // no daemon's: the bench publishes 1000 times a second
    TubeSubscriber subscriber(subscription, Delivery::kEvery);
    while (!is_over()) {
      const TubeNews news = subscriber.wait_for(kTimeout);
      if (news.sample != nullptr)
        arrived(news.sample->estimate.image_frame, news.sample->received_monotonic_ns);
    }
  }

 private:
  int domain_;
  std::string keys_;
};

/// With a second thread for the readers that the publisher leaves asleep, as in the daemon.
class ShmSender final : public Sender {
 public:
  explicit ShmSender(const std::string& socket)
      : publisher_({socket, ""}, {"cath-1"}, 1), waker_([this] { wake_until_the_end(); }) {}
  ~ShmSender() override {
    is_over_ = true;
    bell_.ring();
    waker_.join();
  }
  void send(std::uint32_t number) override {
    if (publisher_.publish(samples_.numbered(number))) bell_.ring();
  }
  // A daemon that is silent for 200 ms is taken for dead: readers would have to come in anew at each turn.
  void rest() override { send(0); }

 private:
  void wake_until_the_end() {
    while (!is_over_) {
      if (bell_.wait_until(from_ns(monotonic_ns()) + kTimeout)) publisher_.wake_sleepers();
    }
  }

  Samples samples_;
  ShmPublisher publisher_;
  Doorbell bell_;
  std::atomic<bool> is_over_{false};
  std::thread waker_;
};

class ShmReceiver final : public Receiver {
 public:
  explicit ShmReceiver(const std::string& socket) : reader_({socket, "", ShmDelivery::kEvery, {}}) {}
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    while (!is_over()) {
      const ShmTubeNews news = reader_.wait_for(kTimeout);
      if (news.estimate != nullptr) arrived(news.estimate->image_frame, news.received_monotonic_ns);
    }
  }

 private:
  ShmTubeReader reader_;
};

}  // namespace

Route own_udp() {
  return {"udp", Placement::kProcesses, [] { return std::make_unique<DdsSender>(kDomain, ""); },
          [] { return std::make_unique<DdsReceiver>(kDomain, ""); }};
}

Route own_udp_secured(const std::filesystem::path& room) {
  return {"udp-security", Placement::kProcesses,
          [room] { return std::make_unique<DdsSender>(kSecuredDomain, (room / "daemon").string()); },
          [room] { return std::make_unique<DdsReceiver>(kSecuredDomain, (room / "subscriber").string()); }};
}

Route own_shared_memory(const std::filesystem::path& folder) {
  const std::string socket = (folder / "estimates.sock").string();
  return {"shm", Placement::kProcesses, [socket] { return std::make_unique<ShmSender>(socket); },
          [socket] { return std::make_unique<ShmReceiver>(socket); }};
}

}  // namespace tubed
