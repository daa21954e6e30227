// Whoever can reach the network and knows the topic: a writer of TubeEstimate that is no tubed.
//   forger PARTITION huge INSTRUMENT START COUNT      samples with the number 2^60 under that daemon's start
//   forger PARTITION invented COUNT                   one sample each of COUNT invented instruments
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>

#include "idl/dds_contract.hpp"

namespace {

std::unique_ptr<tubed_TubeEstimate> lie(const std::string& instrument, std::uint64_t start) {
  auto sample = std::make_unique<tubed_TubeEstimate>();
  std::strncpy(sample->instrument_id, instrument.c_str(), sizeof(sample->instrument_id) - 1);
  sample->daemon_start = start;
  sample->sequence_number = std::uint64_t{1} << 60U;
  sample->validity = tubed_VALIDITY_VALID;
  sample->publish_time_ns = sample->stamps.publish_started_monotonic_ns = dds_time();
  return sample;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 64;
  const tubed::DdsEntity participant = tubed::join_domain(0, "lo");
  const tubed::DdsEntity writer =
      tubed::make_writer(participant, tubed::contract_of<tubed_TubeEstimate>(), argv[1]);
  dds_publication_matched_status_t matched{};
  while (matched.current_count == 0) {
    dds_sleepfor(DDS_MSECS(10));
    dds_get_publication_matched_status(writer.get(), &matched);
  }
  const bool is_huge = std::strcmp(argv[2], "huge") == 0;
  const int count = std::atoi(argv[argc - 1]);
  for (int k = 0; k < count; ++k) {
    auto sample =
        is_huge ? lie(argv[3], std::strtoull(argv[4], nullptr, 10)) : lie("invented-" + std::to_string(k), 7);
    if (!is_huge) sample->sequence_number = 1;
    dds_write(writer.get(), sample.get());
    dds_sleepfor(is_huge ? DDS_MSECS(33) : DDS_USECS(200));
  }
  std::puts("done");
}
