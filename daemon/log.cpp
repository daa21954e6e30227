#include "daemon/log.hpp"

#include <spdlog/async.h>
#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <utility>

namespace tubed {

namespace {

// spdlog hands on one text: words, then fields, each behind this byte (ASCII's unit separator).
constexpr char kSeparator = '\x1f';

std::string_view words_of(std::string_view text) { return text.substr(0, text.find(kSeparator)); }

std::vector<JournalField> fields_of(std::string_view text) {
  std::vector<JournalField> fields;
  for (std::size_t at = text.find(kSeparator); at != std::string_view::npos;) {
    const std::size_t end = std::min(text.find(kSeparator, at + 1), text.size());
    const std::string_view field = text.substr(at + 1, end - at - 1);
    const std::size_t equals = std::min(field.find('='), field.size() - 1);
    fields.push_back({field.substr(0, equals), field.substr(equals + 1)});
    at = end == text.size() ? std::string_view::npos : end;
  }
  return fields;
}

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

/// Called by spdlog's thread alone.
class JournalSink final : public spdlog::sinks::base_sink<std::mutex> {
 public:
  explicit JournalSink(JournalSocket socket) : socket_(std::move(socket)) {}

 protected:
  void sink_it_(const spdlog::details::log_msg& message) override {
    const std::string_view text(message.payload.data(), message.payload.size());
    if (!socket_.send(journal_entry(priority_of(message.level), words_of(text), fields_of(text)))) {
      // Standard error ends in the journal too, by another way.
      static_cast<void>(!write(STDERR_FILENO, text.data(), words_of(text).size()));
      static_cast<void>(!write(STDERR_FILENO, "\n", 1));
    }
  }
  void flush_() override {}

 private:
  JournalSocket socket_;
};

/// The words of a text with fields.
class WordsOnly final : public spdlog::custom_flag_formatter {
 public:
  void format(const spdlog::details::log_msg& message, const std::tm& /*time*/,
              spdlog::memory_buf_t& line) override {
    const std::string_view words = words_of({message.payload.data(), message.payload.size()});
    line.append(words.data(), words.data() + words.size());
  }
  [[nodiscard]] std::unique_ptr<custom_flag_formatter> clone() const override {
    return std::make_unique<WordsOnly>();
  }
};

spdlog::sink_ptr sink_for_this_process() {
  if (auto journal = JournalSocket::of_this_service(std::getenv("JOURNAL_STREAM"), STDERR_FILENO)) {
    return std::make_shared<JournalSink>(std::move(*journal));
  }
  auto sink = std::make_shared<spdlog::sinks::stderr_sink_mt>();
  auto formatter = std::make_unique<spdlog::pattern_formatter>();
  formatter->add_flag<WordsOnly>('*').set_pattern("%Y-%m-%dT%H:%M:%S.%e %l %*");
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

void log_with_fields(spdlog::level::level_enum level, std::string_view words,
                     const std::vector<JournalField>& fields) {
  std::string text(words);
  for (const JournalField& field : fields) {
    text += kSeparator;
    text.append(field.name).append("=").append(field.value);
  }
  spdlog::log(level, spdlog::string_view_t(text));
}

}  // namespace tubed
