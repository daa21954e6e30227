#include "clients/tubectl/check/doctor_rivals.hpp"

#include <chrono>
#include <map>

#include "clients/cpp/tube_subscriber.hpp"
#include "idl/dds_entity.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

constexpr std::chrono::milliseconds kListening{1000};

/// What was heard of one instrument.
struct Heard {
  std::string rival;
  bool daemon_says_so = false;
};

std::map<std::string, Heard> listen(const Configuration& configuration) {
  Subscription subscription;
  subscription.domain = configuration.dds.domain;
  subscription.partition = configuration.dds.partition;
  subscription.network_interface = configuration.dds.network_interface;
  subscription.security = configuration.dds.security;
  TubeSubscriber subscriber(subscription, Delivery::kEvery);
  std::map<std::string, Heard> heard;
  const auto until = std::chrono::steady_clock::now() + kListening;
  while (std::chrono::steady_clock::now() < until) {
    const TubeNews news = subscriber.wait_for(std::chrono::milliseconds{20});
    if (news.event == TubeEvent::kTimeout) continue;
    Heard& instrument = heard[std::string(news.instrument_id)];
    if (news.event == TubeEvent::kRivalSeen) instrument.rival = news.rival;
    if (news.sample != nullptr) {
      instrument.daemon_says_so = Reasons(news.sample->estimate.reasons).has(Reason::kRivalWriter);
    }
  }
  return heard;
}

Finding finding_of(const std::string& id, const Heard& heard) {
  if (heard.rival.empty() && !heard.daemon_says_so) {
    return {Verdict::kGood, id + " is published by one writer", ""};
  }
  return {
      Verdict::kWrong,
      id + " is published by two writers (RIVAL_WRITER)" +
          (heard.rival.empty() ? std::string() : "; one of them: " + heard.rival),
      "end one of the two: each instrument has one tubed; a second room needs another [dds] partition, and "
      "a network that is not trusted DDS Security"};
}

}  // namespace

std::vector<NamedFinding> examine_rivals(const Configuration& configuration) {
  try {
    const std::map<std::string, Heard> heard = listen(configuration);
    std::vector<NamedFinding> findings;
    for (const InstrumentDescription& instrument : configuration.room.instruments) {
      const auto found = heard.find(instrument.id);
      if (found != heard.end()) {
        findings.push_back({"writers of " + instrument.id, finding_of(instrument.id, found->second)});
      }
    }
    return findings;
  } catch (const DdsError& error) {
    return {{"writers", {Verdict::kAdvice, "cannot listen to what is published", error.what()}}};
  }
}

}  // namespace tubed
