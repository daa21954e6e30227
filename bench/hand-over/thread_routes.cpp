#include "bench/hand-over/thread_routes.hpp"

#include <condition_variable>
#include <mutex>

#include "bench/peers/sample_estimate.hpp"
#include "daemon/pipeline/doorbell.hpp"
#include "daemon/pipeline/triple_buffer.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kTimeout{50};

struct Mailbox {
  TripleBuffer<TubeEstimate> buffer;
  Doorbell bell;
};

class MailboxSender final : public Sender {
 public:
  explicit MailboxSender(std::shared_ptr<Mailbox> mailbox) : mailbox_(std::move(mailbox)) {}
  void send(std::uint32_t number) override {
    mailbox_->buffer.back() = estimate_;
    mailbox_->buffer.back().image_frame = number;
    mailbox_->buffer.publish();
    mailbox_->bell.ring();
  }

 private:
  TubeEstimate estimate_ = sample_estimate();
  std::shared_ptr<Mailbox> mailbox_;
};

class MailboxReceiver final : public Receiver {
 public:
  explicit MailboxReceiver(std::shared_ptr<Mailbox> mailbox) : mailbox_(std::move(mailbox)) {}
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    while (!is_over()) {
      mailbox_->bell.wait_until(from_ns(monotonic_ns()) + kTimeout);
      if (mailbox_->buffer.fetch()) arrived(mailbox_->buffer.front().image_frame, monotonic_ns());
    }
  }

 private:
  std::shared_ptr<Mailbox> mailbox_;
};

struct LockedBox {
  std::mutex mutex;
  std::condition_variable changed;
  TubeEstimate estimate;
  bool is_new = false;
};

class LockedSender final : public Sender {
 public:
  explicit LockedSender(std::shared_ptr<LockedBox> box) : box_(std::move(box)) {}
  void send(std::uint32_t number) override {
    {
      const std::lock_guard<std::mutex> lock(box_->mutex);
      box_->estimate = estimate_;
      box_->estimate.image_frame = number;
      box_->is_new = true;
    }
    box_->changed.notify_one();
  }

 private:
  TubeEstimate estimate_ = sample_estimate();
  std::shared_ptr<LockedBox> box_;
};

class LockedReceiver final : public Receiver {
 public:
  explicit LockedReceiver(std::shared_ptr<LockedBox> box) : box_(std::move(box)) {}
  void receive(const std::function<bool()>& is_over, const Arrived& arrived) override {
    while (!is_over()) {
      std::unique_lock<std::mutex> lock(box_->mutex);
      if (!box_->changed.wait_for(lock, kTimeout, [this] { return box_->is_new; })) continue;
      box_->is_new = false;
      taken_ = box_->estimate;
      lock.unlock();
      arrived(taken_.image_frame, monotonic_ns());
    }
  }

 private:
  TubeEstimate taken_;
  std::shared_ptr<LockedBox> box_;
};

}  // namespace

Route triple_buffer() {
  const auto mailbox = std::make_shared<Mailbox>();
  return {"triple-buffer", Placement::kThreads,
          [mailbox] { return std::make_unique<MailboxSender>(mailbox); },
          [mailbox] { return std::make_unique<MailboxReceiver>(mailbox); }};
}

Route mutex_and_condition() {
  const auto box = std::make_shared<LockedBox>();
  return {"mutex-condition", Placement::kThreads, [box] { return std::make_unique<LockedSender>(box); },
          [box] { return std::make_unique<LockedReceiver>(box); }};
}

}  // namespace tubed
