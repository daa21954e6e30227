#include "daemon/publishing/rival_watch.hpp"

#include <algorithm>

#include "idl/dds_contract.hpp"
#include "idl/writer_description.hpp"

namespace tubed {
namespace {

constexpr std::int64_t kForgotten_ns = 1'000'000'000;
constexpr int kMaxSamplesPerInstrument = 2;  // a look is bounded, whatever a rival sends

bool is_own_instrument(const void* sample, void* ids) {
  const auto& own = *static_cast<const std::vector<std::string>*>(ids);
  return std::find(own.begin(), own.end(), static_cast<const tubed_TubeEstimate*>(sample)->instrument_id) !=
         own.end();
}

}  // namespace

struct RivalWatch::Reader {
  Reader(const DdsEntity& participant, const DdsSettings& settings, std::vector<std::string> instrument_ids)
      : ids(std::move(instrument_ids)),
        reports(ids.size()),
        heard_ns(ids.size()),
        reader(make_reader(participant, contract_of<tubed_TubeEstimate>(), settings.partition, 1,
                           {.wants = &is_own_instrument, .state = &ids}, OwnWriters::kIgnored)) {}

  void hear(std::size_t instrument, dds_instance_handle_t writer, std::int64_t now_ns) {
    RivalReport& report = reports[instrument];
    heard_ns[instrument] = now_ns;
    if (report.is_there) return;
    report.is_there = report.has_changed = true;
    report.who = description_of_writer(reader, writer);
  }

  std::vector<std::string> ids;
  std::vector<RivalReport> reports;
  std::vector<std::int64_t> heard_ns;
  tubed_TubeEstimate sample{};
  DdsEntity reader;  // its filter reads ids
};

RivalWatch::RivalWatch(const DdsEntity& participant, const DdsSettings& settings,
                       std::vector<std::string> instrument_ids)
    : reader_(std::make_unique<Reader>(participant, settings, std::move(instrument_ids))) {}

RivalWatch::~RivalWatch() = default;

bool RivalWatch::look(std::int64_t now_ns) {
  Reader& watch = *reader_;
  for (RivalReport& report : watch.reports) report.has_changed = false;
  const int most = kMaxSamplesPerInstrument * static_cast<int>(watch.ids.size());
  for (int taken = 0; taken < most; ++taken) {
    void* buffer = &watch.sample;
    dds_sample_info_t about{};
    if (dds_take(watch.reader.get(), &buffer, &about, 1, 1) <= 0) break;
    const auto id = std::find(watch.ids.begin(), watch.ids.end(), watch.sample.instrument_id);
    if (about.valid_data && id != watch.ids.end()) {
      watch.hear(static_cast<std::size_t>(id - watch.ids.begin()), about.publication_handle, now_ns);
    }
  }
  bool changed = false;
  for (std::size_t i = 0; i < watch.ids.size(); ++i) {
    RivalReport& report = watch.reports[i];
    if (report.is_there && now_ns - watch.heard_ns[i] >= kForgotten_ns) {
      report.is_there = false;
      report.has_changed = true;
    }
    changed = changed || report.has_changed;
  }
  return changed;
}

const std::vector<RivalReport>& RivalWatch::reports() const { return reader_->reports; }

}  // namespace tubed
