#include "clients/tubectl/watch/silence.hpp"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <set>
#include <sstream>

#include "clients/cpp/participant.hpp"
#include "daemon/config/load_configuration.hpp"
#include "idl/dds_contract.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kDue{2};
constexpr std::chrono::milliseconds kDiscovery{700};

std::vector<std::string> words_of_command(const fs::path& process) {
  std::ifstream stream(process / "cmdline", std::ios::binary);
  std::vector<std::string> words;
  std::string word;
  while (std::getline(stream, word, '\0')) {
    words.push_back(word);
  }
  return words;
}

/// The value of --config; where it is relative, to the daemon's own folder.
fs::path configuration_of(const fs::path& process) {
  const std::vector<std::string> words = words_of_command(process);
  fs::path config = "/etc/tubed/tubed.toml";
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--config" && i + 1 < words.size()) {
      config = words[i + 1];
    } else if (words[i].starts_with("--config=")) {
      config = words[i].substr(9);
    }
  }
  std::error_code error;
  const fs::path folder = fs::read_symlink(process / "cwd", error);
  return config.is_absolute() || error ? config : folder / config;
}

RunningDaemon daemon_of(const fs::path& process) {
  RunningDaemon daemon;
  daemon.pid = std::atoi(process.filename().c_str());
  const fs::path file = configuration_of(process);
  daemon.config = printable_text(file.string());
  try {
    std::ifstream stream(file, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    if (!stream.is_open() || stream.bad()) {
      daemon.why = "cannot be read by you: sudo may";
      return daemon;
    }
    const Configuration configuration = parse_configuration(text.str(), file);
    daemon.place.domain = configuration.dds.domain;
    daemon.place.partition = configuration.dds.partition;
    daemon.place.network_interface = configuration.dds.network_interface;
    daemon.has_keys = !configuration.dds.security.empty();
    daemon.estimates_socket = configuration.shm.estimates_socket;
    for (const InstrumentDescription& instrument : configuration.room.instruments) {
      daemon.instruments.push_back(instrument.id);
    }
  } catch (const std::exception&) {
    daemon.why = "is no configuration any more: tubed --check says why";
  }
  return daemon;
}

std::string options_of(const Subscription& place, bool has_keys) {
  std::string text;
  text += place.domain == 0 ? "" : " --domain " + std::to_string(place.domain);
  text += place.partition.empty() ? "" : " --partition '" + printable_text(place.partition) + "'";
  text += place.network_interface == "lo" ? "" : " --interface " + place.network_interface;
  return text + (has_keys ? " --security KEYS" : "");
}

bool is_same_place(const Subscription& a, const Subscription& b) {
  return a.domain == b.domain && a.partition == b.partition;
}

std::string name_of(const RunningDaemon& daemon) {
  return "a tubed runs here (process " + std::to_string(daemon.pid) + ", " + daemon.config + ")";
}

std::string words_of(const RunningDaemon& daemon, const Subscription& wanted, const std::string& verb) {
  if (!daemon.why.empty()) {
    return name_of(daemon) + "; its configuration " + daemon.why;
  }
  const bool is_wanted_instrument =
      wanted.instrument_id.empty() || std::find(daemon.instruments.begin(), daemon.instruments.end(),
                                                wanted.instrument_id) != daemon.instruments.end();
  if (!is_same_place(daemon.place, wanted) || daemon.has_keys != !wanted.security.empty()) {
    return name_of(daemon) + " and publishes elsewhere; try: tubectl " + verb +
           options_of(daemon.place, daemon.has_keys);
  }
  if (!is_wanted_instrument) {
    return name_of(daemon) + "; its instruments are " + alternatives(daemon.instruments) + ", not " +
           printable_text(wanted.instrument_id);
  }
  if (daemon.place.network_interface != wanted.network_interface) {
    return name_of(daemon) + " on interface " + daemon.place.network_interface + "; try: tubectl " + verb +
           options_of(daemon.place, daemon.has_keys);
  }
  return name_of(daemon) +
         " and publishes there, but nothing of it comes; it may be starting, stopped or hung: " +
         "systemctl status tubed, tubectl doctor";
}

/// The partition of a writer of shapes, "" for the default one; nothing for other writers.
std::optional<std::string> partition_of(const dds_builtintopic_endpoint_t& writer) {
  if (std::string_view(writer.topic_name) != contract_of<tubed_TubeEstimate>().name) {
    return {};
  }
  std::uint32_t count = 0;
  char** names = nullptr;
  std::string partition;
  if (dds_qget_partition(writer.qos, &count, &names)) {
    for (std::uint32_t i = 0; i < count; ++i) {
      partition = i == 0 ? names[i] : partition;
      dds_free(names[i]);
    }
    dds_free(names);
  }
  return partition;
}

void take_partitions(dds_entity_t reader, std::set<std::string>& partitions) {
  constexpr std::size_t kAtOnce = 16;
  void* samples[kAtOnce] = {};
  dds_sample_info_t about[kAtOnce];
  const dds_return_t count = dds_take(reader, samples, about, kAtOnce, kAtOnce);
  for (dds_return_t i = 0; i < count; ++i) {
    const auto* const writer = static_cast<const dds_builtintopic_endpoint_t*>(samples[i]);
    if (about[i].valid_data) {
      if (auto partition = partition_of(*writer)) partitions.insert(std::move(*partition));
    }
  }
  if (count > 0) dds_return_loan(reader, samples, count);
}

}  // namespace

std::vector<RunningDaemon> running_daemons(const fs::path& proc) {
  std::vector<RunningDaemon> found;
  std::error_code error;
  for (fs::directory_iterator at(proc, error), end; !error && at != end; at.increment(error)) {
    std::ifstream stream(at->path() / "comm");
    std::string name;
    if (std::getline(stream, name) && name == "tubed" && !words_of_command(at->path()).empty()) {
      found.push_back(daemon_of(at->path()));
    }
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.pid < b.pid; });
  return found;
}

std::vector<std::string> partitions_heard(const Subscription& subscription) {
  const DdsEntity participant = join(subscription, contract_of<tubed_TubeEstimate>().name);
  const DdsEntity reader(
      dds_create_reader(participant.get(), DDS_BUILTIN_TOPIC_DCPSPUBLICATION, nullptr, nullptr),
      "a reader of who publishes");
  std::set<std::string> partitions;
  const auto until = std::chrono::steady_clock::now() + kDiscovery;
  while (partitions.empty() && std::chrono::steady_clock::now() < until) {
    dds_sleepfor(DDS_MSECS(50));
    take_partitions(reader.get(), partitions);
  }
  return {partitions.begin(), partitions.end()};
}

std::vector<std::string> words_of_silence(const Subscription& wanted, const std::string& verb,
                                          const Surroundings& found) {
  std::vector<std::string> lines;
  for (const RunningDaemon& daemon : found.daemons) {
    lines.push_back(words_of(daemon, wanted, verb));
  }
  for (const std::string& partition : found.partitions) {
    const bool is_told =
        std::any_of(found.daemons.begin(), found.daemons.end(), [&](const RunningDaemon& daemon) {
          return daemon.why.empty() && daemon.place.domain == wanted.domain &&
                 daemon.place.partition == partition;
        });
    if (partition != wanted.partition && !is_told) {
      Subscription there = wanted;
      there.partition = partition;
      lines.push_back(
          "shapes are published in this domain in " +
          (partition.empty() ? "the default partition" : "partition '" + printable_text(partition) + "'") +
          "; try: tubectl " + verb + options_of(there, !wanted.security.empty()));
    }
  }
  if (found.daemons.empty()) {
    const bool is_local = wanted.network_interface == "lo" || wanted.network_interface.starts_with("127.");
    lines.push_back(
        "no tubed runs on this machine" +
        std::string(is_local ? ", and interface lo hears no other; try: --interface NAME of the network "
                               "that the daemon is in, `systemctl start tubed`, or `tubectl demo`"
                             : "; one on another host needs the same --domain, --partition and keys"));
  }
  return lines;
}

std::vector<std::string> words_of_silent_socket(const std::string& socket, const std::string& verb,
                                                const std::vector<RunningDaemon>& daemons) {
  std::vector<std::string> lines;
  for (const RunningDaemon& daemon : daemons) {
    const std::string name = name_of(daemon);
    if (!daemon.why.empty()) {
      lines.push_back(name + "; its configuration " + daemon.why);
    } else if (daemon.estimates_socket.empty()) {
      lines.push_back(name +
                      " and offers no shared memory: [shm] estimates_socket is not set; try: tubectl " +
                      verb + options_of(daemon.place, daemon.has_keys));
    } else if (daemon.estimates_socket != socket) {
      lines.push_back(name + "; try: tubectl " + verb + " --shm " + printable_text(daemon.estimates_socket));
    } else {
      lines.push_back(name + " and offers this socket: are you in its [shm] readers?");
    }
  }
  if (daemons.empty()) {
    lines.emplace_back("no tubed runs on this machine: `systemctl start tubed`, or `tubectl demo`");
  }
  return lines;
}

SilenceTeller::SilenceTeller(Subscription subscription, std::string verb)
    : subscription_(std::move(subscription)),
      verb_(std::move(verb)),
      due_(std::chrono::steady_clock::now() + kDue) {}

SilenceTeller::SilenceTeller(std::string socket, std::string verb)
    : socket_(std::move(socket)), verb_(std::move(verb)), due_(std::chrono::steady_clock::now() + kDue) {}

void SilenceTeller::tell_when_due() {
  if (!is_over_ && std::chrono::steady_clock::now() >= due_) {
    tell();
  }
}

void SilenceTeller::tell() {
  if (is_over_) {
    return;
  }
  is_over_ = true;
  std::cerr << "tubectl: nothing was heard "
            << (socket_.empty() ? "in domain " + std::to_string(subscription_.domain) + ", " +
                                      (subscription_.partition.empty()
                                           ? "the default partition"
                                           : "partition '" + printable_text(subscription_.partition) + "'") +
                                      ", on interface " + subscription_.network_interface
                                : "at " + printable_text(socket_))
            << " so far\n";
  const auto lines = socket_.empty() ? words_of_silence(subscription_, verb_,
                                                        {running_daemons(), partitions_heard(subscription_)})
                                     : words_of_silent_socket(socket_, verb_, running_daemons());
  for (const std::string& line : lines) {
    std::cerr << "  " << line << '\n';
  }
  std::cerr << std::flush;
}

}  // namespace tubed
