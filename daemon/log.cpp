#include "daemon/log.hpp"

#include <spdlog/async.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdlib>
#include <memory>
#include <mutex>
#include <utility>

#include "idl/printable_text.hpp"

namespace tubed {

namespace {

int priority_of(spdlog::level::level_enum level) {
  switch (level) {
    case spdlog::level::trace:
    case spdlog::level::debug:
      return 7;
    case spdlog::level::warn:
      return 4;
    case spdlog::level::err:
      return 3;
    case spdlog::level::critical:
      return 2;
    default:
      return 6;
  }
}

std::string_view words_of(const spdlog::details::log_msg& message) {
  return {message.payload.data(), message.payload.size()};
}

/// What comes through spdlog is sent by spdlog's thread; send() may be called by any thread, and never waits.
class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit JournalSink(JournalSocket socket) : socket_(std::move(socket)) {}

  /// False when the journal did not take it.
  bool send(spdlog::level::level_enum level, std::string_view words,
            const std::vector<JournalField>& fields) {
    return socket_.send(journal_entry(priority_of(level), words, fields));
  }

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string words = printable_text(words_of(message));
    if (!send(message.level, words, {})) {
      // Standard error ends in the journal too, by another way.
      static_cast<void>(!write(STDERR_FILENO, words.data(), words.size()));
      static_cast<void>(!write(STDERR_FILENO, "\n", 1));
    }
  }
  void flush_() override {}

 private:
  JournalSocket socket_;
};

/// The words of a line as they may be shown.
class PrintableWords final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/,
              spdlog::memory_buf_t& line) override {
    const std::string words = printable_text(words_of(message));
    line.append(words.data(), words.data() + words.size());
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<PrintableWords>();
  }
};

spdlog::sink_ptr sink_for_this_process() {
  if (auto journal = JournalSocket::of_this_service(std::getenv("JOURNAL_STREAM"), STDERR_FILENO)) {
    return std::make_shared<JournalSink>(std::move(*journal));
  }
  auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<PrintableWords>('*').set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %*");
  sink->set_formatter(std::move(formatter));
  return sink;
}

}  // namespace

void start_logging(const std::string& level) {
  const spdlog::sink_ptr sink = sink_for_this_process();
  spdlog::init_thread_pool(1024, 1);
  spdlog::set_default_logger(std::make_shared<spdlog::async_logger>(
      "tubed", sink, spdlog::thread_pool(), spdlog::async_overflow_policy::overrun_oldest));
  spdlog::set_level(spdlog::level::from_str(level));
  spdlog::flush_on(spdlog::level::warn);
}

// The journal takes fields as they are, and at once: only words go through spdlog's queue.
void log_with_fields(spdlog::level::level_enum level, std::string_view words,
                     const std::vector<JournalField>& fields) {
  spdlog::logger& logger = *spdlog::default_logger_raw();
  if (!logger.should_log(level)) {
    return;
  }
  std::vector<std::string> values;
  std::vector<JournalField> printable;
  values.reserve(fields.size());
  for (const JournalField& field : fields) {
    printable.push_back({field.name, values.emplace_back(printable_text(field.value))});
  }
  auto* journal = dynamic_cast<JournalSink*>(logger.sinks().front().get());
  if (journal == nullptr || !journal->send(level, printable_text(words), printable)) {
    logger.log(level, spdlog::string_view_t(words.data(), words.size()));
  }
}

}  // namespace tubed
