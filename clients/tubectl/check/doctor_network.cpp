#include "clients/tubectl/check/doctor_network.hpp"

#include <net/if.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace tubed {
namespace {

namespace fs = std::filesystem;

constexpr const char* kListening = "0A";       // TCP_LISTEN, as /proc/net/tcp has it
constexpr const char* kUdpUnconnected = "07";  // a UDP socket that anybody may send to

constexpr const char* kForgers =
    "without DDS Security whoever is there can forge shapes: give tubed a network of its own and load "
    "/usr/share/tubed/tubed.nft";

/// A socket that others may send to.
struct OpenSocket {
  std::string protocol;  ///< "UDP", "TCP"
  std::string address;   ///< "0.0.0.0", "127.0.0.1", as the kernel binds it; "[::]" for all of IPv6
  bool is_loopback = false;
  unsigned port = 0;
};

struct Process {
  int pid = 0;
  std::string name;
};

/// Who reaches a socket, and how bad that is.
struct Reach {
  Verdict verdict = Verdict::kGood;
  std::string who;
  std::string advice;
  auto operator<=>(const Reach&) const = default;
};

unsigned hexadecimal(std::string_view text) {
  unsigned number = 0;
  std::from_chars(text.data(), text.data() + text.size(), number, 16);
  return number;
}

/// "0100007F" of /proc/net/udp is 127.0.0.1: the bytes of a word of this machine, least significant first.
std::string dotted(const std::string& hex) {
  const unsigned word = hexadecimal(hex);
  return std::to_string(word & 255U) + "." + std::to_string(word >> 8U & 255U) + "." +
         std::to_string(word >> 16U & 255U) + "." + std::to_string(word >> 24U);
}

OpenSocket socket_of(const std::string& protocol, const std::string& local) {
  const std::size_t colon = std::min(local.find(':'), local.size());
  const std::string hex = local.substr(0, colon);
  OpenSocket open;
  open.protocol = protocol;
  open.port = hexadecimal(std::string_view(local).substr(std::min(colon + 1, local.size())));
  if (hex.size() == 8) {
    open.address = dotted(hex);
    open.is_loopback = open.address.starts_with("127.");
    return open;
  }
  open.is_loopback = hex == "00000000000000000000000001000000";
  const bool is_any = hex.find_first_not_of('0') == std::string::npos;
  open.address = open.is_loopback ? "[::1]" : is_any ? "[::]" : "[" + hex + "]";
  return open;
}

/// {inode: socket} of a table such as /proc/PID/net/udp: what is connected to one partner is left out.
void read_table(const fs::path& table, const std::string& protocol, const std::string& state,
                std::map<std::string, OpenSocket>& open) {
  std::ifstream stream(table);
  std::string line;
  std::getline(stream, line);  // the heading
  while (std::getline(stream, line)) {
    std::istringstream words(line);
    std::array<std::string, 10> word;
    for (std::string& one : word) words >> one;
    if (words && word[3] == state) {
      open.emplace(word[9], socket_of(protocol, word[1]));
    }
  }
}

std::map<std::string, OpenSocket> open_sockets(const fs::path& process) {
  std::map<std::string, OpenSocket> open;
  for (const char* suffix : {"", "6"}) {
    read_table(process / (std::string("net/udp") + suffix), "UDP", kUdpUnconnected, open);
    read_table(process / (std::string("net/tcp") + suffix), "TCP", kListening, open);
  }
  return open;
}

/// One that has ended and whose parent has not asked for its exit code yet: it keeps its name and has no
/// sockets.
bool has_ended(const fs::path& process) {
  std::ifstream stream(process / "stat");
  std::string line;
  std::getline(stream, line);
  const std::size_t name_end = line.rfind(')');
  return name_end != std::string::npos && name_end + 2 < line.size() &&
         (line[name_end + 2] == 'Z' || line[name_end + 2] == 'X');
}

std::vector<Process> running(const Machine& machine) {
  std::vector<Process> found;
  std::error_code error;
  for (fs::directory_iterator at(machine.root / "proc", error), end; !error && at != end;
       at.increment(error)) {
    Process process;
    process.pid = std::atoi(at->path().filename().c_str());
    std::ifstream stream(at->path() / "comm");
    if (process.pid > 0 && std::getline(stream, process.name) &&
        (process.name == "tubed" || process.name == "tubed-exporter" || process.name == "tubed-view") &&
        !has_ended(at->path())) {
      found.push_back(process);
    }
  }
  std::sort(found.begin(), found.end(), [](const Process& a, const Process& b) { return a.pid < b.pid; });
  return found;
}

std::string name_of_interface(unsigned index) {
  std::array<char, IF_NAMESIZE> name{};
  return if_indextoname(index, name.data()) != nullptr ? name.data() : "interface " + std::to_string(index);
}

Reach only_this_host() { return {.verdict = Verdict::kGood, .who = "only this host", .advice = ""}; }

Reach hosts_on(const std::string& network_interface) {
  return {Verdict::kAdvice, "hosts on " + network_interface + " and whoever is routed through it", kForgers};
}

Reach reach_of(const OpenSocket& open, const Process& process, int fd, const FilterReader& filter_of) {
  if (open.is_loopback) {
    return only_this_host();
  }
  const Reach anybody{
      Verdict::kWrong, "anybody who can route to this machine",
      "restart it with this version of tubed, which filters its DDS ports; close others with a "
      "firewall (/usr/share/tubed/tubed.nft shows how) or bind them to 127.0.0.1"};
  if (open.protocol == "TCP") {
    return anybody;
  }
  try {
    const std::optional<AllowedInterfaces> filter = filter_of(process.pid, fd);
    if (!filter) {
      return anybody;
    }
    return filter->chosen == filter->loopback ? only_this_host()
                                              : hosts_on(name_of_interface(filter->chosen));
  } catch (const std::runtime_error& error) {
    return {Verdict::kNote, std::string("not known who: ") + error.what(), ""};
  }
}

void examine_process(const Machine& machine, const Process& process, const FilterReader& filter_of,
                     std::vector<NamedFinding>& findings) {
  const fs::path folder = machine.root / "proc" / std::to_string(process.pid);
  const std::string name = process.name + " (process " + std::to_string(process.pid) + ")";
  const std::map<std::string, OpenSocket> open = open_sockets(folder);
  std::map<Reach, std::map<std::string, std::vector<unsigned>>> groups;
  std::error_code error;
  for (fs::directory_iterator at(folder / "fd", error), end; !error && at != end; at.increment(error)) {
    std::error_code no_link;
    const std::string target = fs::read_symlink(at->path(), no_link).string();
    if (!target.starts_with("socket:[")) continue;
    const auto found = open.find(target.substr(8, target.size() - 9));
    if (found == open.end()) continue;
    const Reach reach = reach_of(found->second, process, std::atoi(at->path().filename().c_str()), filter_of);
    groups[reach][found->second.protocol + " " + found->second.address].push_back(found->second.port);
  }
  if (error) {
    findings.push_back(
        {"network",
         {Verdict::kNote, "the sockets of " + name + " are seen by root alone: sudo tubectl doctor", ""}});
  }
  for (auto& [reach, places] : groups) {
    std::string found = name;
    for (auto& [place, ports] : places) {
      std::sort(ports.begin(), ports.end());
      found += ", " + place + " port";
      for (const unsigned port : ports) found += " " + std::to_string(port);
    }
    findings.push_back({"network", {reach.verdict, found + ": reached by " + reach.who, reach.advice}});
  }
}

}  // namespace

std::optional<AllowedInterfaces> filter_of_process(int pid, int fd) {
  const auto process = static_cast<int>(::syscall(SYS_pidfd_open, pid, 0));
  const auto copy = static_cast<int>(process < 0 ? -1 : ::syscall(SYS_pidfd_getfd, process, fd, 0));
  const int why = errno;
  if (process >= 0) ::close(process);
  if (copy < 0) {
    throw std::runtime_error(std::string("its filter cannot be read (") + std::strerror(why) +
                             "): sudo tubectl doctor");
  }
  const std::optional<AllowedInterfaces> filter = interface_filter_of(copy);
  ::close(copy);
  return filter;
}

std::vector<NamedFinding> examine_network(const Machine& machine, const std::string& network_interface,
                                          const FilterReader& filter_of) {
  std::vector<NamedFinding> findings;
  bool runs = false;
  for (const Process& process : running(machine)) {
    runs = runs || process.name == "tubed";
    examine_process(machine, process, filter_of, findings);
  }
  if (!runs) {
    const bool is_loopback = network_interface == "lo" || network_interface.starts_with("127.");
    const Reach reach = is_loopback ? only_this_host() : hosts_on(network_interface);
    findings.push_back({"network",
                        {reach.verdict,
                         "tubed does not run; as configured it binds its UDP ports to 0.0.0.0, filtered to " +
                             network_interface + ": reached by " + reach.who,
                         reach.advice}});
  }
  return findings;
}

}  // namespace tubed
