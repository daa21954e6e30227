#include "bench/publish/own_routes.hpp"

#include "bench/peers/sample_estimate.hpp"
#include "clients/cpp/shm_tube_reader.hpp"
#include "clients/cpp/tube_subscriber.hpp"
#include "daemon/publishing/dds_publisher.hpp"
#include "daemon/publishing/shm_publisher.hpp"

namespace tubed {

namespace {

constexpr int kDomain = 40;
constexpr std::chrono::milliseconds kPatience{50};

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
  DdsSender() : publisher_(settings(), {identity()}) {}
  void send(std::uint32_t number) override { publisher_.publish(samples_.numbered(number)); }

 private:
  static DdsSettings settings() {
    DdsSettings dds;
    dds.domain = kDomain;
    return dds;
  }
  Samples samples_;
  DdsPublisher publisher_;
};

class DdsReceiver final : public Receiver {
 public:
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    Subscription subscription;
    subscription.domain = kDomain;
    subscription.max_rate_hz = 4000;  // no daemon's: the bench publishes 1000 times a second
    TubeSubscriber subscriber(subscription, Delivery::kEvery);
    while (!is_over()) {
      const TubeNews news = subscriber.wait_for(kPatience);
      if (news.sample != nullptr)
        arrived(news.sample->estimate.image_frame, news.sample->received_monotonic_ns);
    }
  }
};

class ShmSender final : public Sender {
 public:
  explicit ShmSender(const std::string& socket) : publisher_({socket, ""}, {"cath-1"}, 1) {}
  void send(std::uint32_t number) override { publisher_.publish(samples_.numbered(number)); }
  // A daemon that is silent for 200 ms is taken for dead: readers would have to come in anew at each turn.
  void rest() override { send(0); }

 private:
  Samples samples_;
  ShmPublisher publisher_;
};

class ShmReceiver final : public Receiver {
 public:
  explicit ShmReceiver(const std::string& socket) : reader_({socket, "", ShmDelivery::kEvery, {}}) {}
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    while (!is_over()) {
      const ShmTubeNews news = reader_.wait_for(kPatience);
      if (news.estimate != nullptr) arrived(news.estimate->image_frame, news.received_monotonic_ns);
    }
  }

 private:
  ShmTubeReader reader_;
};

}  // namespace

Route own_udp() {
  return {"udp", Placement::kProcesses, [] { return std::make_unique<DdsSender>(); },
          [] { return std::make_unique<DdsReceiver>(); }};
}

Route own_shared_memory(const std::filesystem::path& folder) {
  const std::string socket = (folder / "estimates.sock").string();
  return {"shm", Placement::kProcesses, [socket] { return std::make_unique<ShmSender>(socket); },
          [socket] { return std::make_unique<ShmReceiver>(socket); }};
}

}  // namespace tubed
