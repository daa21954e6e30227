#include "clients/tubectl/check/doctor_video.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>

#include "drivers/driver_registry/driver_registry.hpp"
#include "drivers/v4l2/card_words.hpp"
#include "drivers/v4l2/linux_video_device.hpp"
#include "drivers/v4l2/v4l2_settings.hpp"

namespace tubed {

namespace {

namespace fs = std::filesystem;

/// /dev/video0, /dev/video1, ... in the order of their numbers.
std::vector<fs::path> video_nodes(const Machine& machine) {
  std::vector<fs::path> nodes;
  std::error_code error;
  for (fs::directory_iterator at(machine.root / "dev", error), end; !error && at != end;
       at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with("video") && name.size() > 5 &&
        std::all_of(name.begin() + 5, name.end(), [](char c) { return c >= '0' && c <= '9'; })) {
      nodes.push_back(at->path());
    }
  }
  std::sort(nodes.begin(), nodes.end(), [](const fs::path& a, const fs::path& b) {
    const auto key = [](const fs::path& path) {
      return std::pair(path.filename().string().size(), path.filename().string());
    };
    return key(a) < key(b);
  });
  return nodes;
}

Finding card_finding(const CardOffer& offer) {
  if (offer.error != 0) {
    return {Verdict::kAdvice, std::string(describe_card_error(offer.path, "asking it", offer.error).text()),
            ""};
  }
  return {Verdict::kGood, describe(offer), ""};
}

/// Is user tubed, the service's, in group video, which udev gives every card? Nothing when there
/// is no such user.
std::vector<NamedFinding> examine_group(const Machine& machine) {
  const auto line_of = [&](const char* file, const std::string& name) {
    std::ifstream lines(machine.root / "etc" / file);
    std::string line;
    while (std::getline(lines, line) && !line.starts_with(name + ":")) {
    }
    return line.starts_with(name + ":") ? line : "";
  };
  if (line_of("passwd", "tubed").empty()) {
    return {};
  }
  const std::string members = "," + line_of("group", "video") + ",";
  const bool is_in =
      members.find(":tubed,") != std::string::npos || members.find(",tubed,") != std::string::npos;
  return {{"video group",
           is_in ? Finding{Verdict::kGood, "user tubed is in group video", ""}
                 : Finding{Verdict::kAdvice, "user tubed is not in group video, which cards belong to",
                           "sudo usermod -aG video tubed && sudo systemctl restart tubed"}}};
}

bool offers_size(const OfferedFormat& format, PictureSize size) {
  return format.sizes.empty() ||
         std::any_of(format.sizes.begin(), format.sizes.end(), [&](const OfferedSize& one) {
           return one.size == size ||
                  (one.is_largest_of_many && size.width <= one.size.width && size.height <= one.size.height);
         });
}

std::string text_of(PictureSize size) { return std::string(describe(size).text()); }

const OfferedInput* input_of(const CardOffer& offer, const CardRequest& request) {
  const auto found = std::find_if(offer.inputs.begin(), offer.inputs.end(), [&](const OfferedInput& input) {
    return input.number == request.input.value_or(offer.input);
  });
  return found == offer.inputs.end() ? nullptr : &*found;
}

/// Errno of a socket that is connected to and left again; 0: somebody serves it.
int knock(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) {
    return ENAMETOOLONG;
  }
  std::copy(path.begin(), path.end(), address.sun_path);
  const int door = ::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (door < 0) {
    return errno;
  }
  const bool is_served = ::connect(door, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0;
  const int error = is_served || errno == EAGAIN ? 0 : errno;
  ::close(door);
  return error;
}

Finding socket_finding(const std::string& path) {
  const std::string place = "socket " + path;
  switch (knock(path)) {
    case 0:
      return {Verdict::kGood, place + " is served", ""};
    case ENOENT:
    case ECONNREFUSED:
      return {
          Verdict::kWrong, place + ": nobody serves it",
          "start the frame grabber's program, or `tubectl grab --video /dev/video0 --socket " + path + "`"};
    case EACCES:
      return {Verdict::kAdvice, place + " may not be connected to by this user",
              "start the frame grabber's program with --group tubed; or ask as root"};
    default:
      return {Verdict::kAdvice, place + " cannot be connected to", "is it the socket of a frame grabber?"};
  }
}

}  // namespace

std::unique_ptr<VideoDevice> make_linux_video_device() { return std::make_unique<LinuxVideoDevice>(); }

std::vector<NamedFinding> examine_cards(const Machine& machine, const MakeVideoDevice& make_device) {
  std::vector<NamedFinding> findings;
  const std::vector<fs::path> nodes = video_nodes(machine);
  for (const fs::path& node : nodes) {
    const CardOffer offer = survey_card(*make_device(), node.string());
    if (offer.error != 0 || offer.captures) {
      findings.push_back({"card " + node.string(), card_finding(offer)});
    }
  }
  if (findings.empty()) {
    return {{"cards", {Verdict::kNote, "no capture card at /dev/video*", ""}}};
  }
  const std::vector<NamedFinding> group = examine_group(machine);
  findings.insert(findings.end(), group.begin(), group.end());
  return findings;
}

Finding camera_finding(const CardOffer& offer, const DriverSettings& settings) {
  const CardRequest request = v4l2_settings_of(settings).request;
  if (offer.error != 0 || !offer.captures) {
    return {Verdict::kWrong,
            offer.error != 0 ? std::string(describe_card_error(offer.path, "asking it", offer.error).text())
                             : offer.path + " captures no video: correct device",
            ""};
  }
  const OfferedInput* const input = input_of(offer, request);
  if (request.input && input == nullptr) {
    return {Verdict::kWrong, offer.path + " has no input " + std::to_string(*request.input), "correct input"};
  }
  const bool is_any = !request.format.has_value();
  const auto fits = [&](const OfferedFormat& format) {
    const bool is_wanted = is_any ? format.is_read : format.name == facts_of(*request.format).word;
    return is_wanted && (request.size.width == 0 || offers_size(format, request.size));
  };
  const auto found = std::find_if(offer.formats.begin(), offer.formats.end(), fits);
  if (found == offer.formats.end()) {
    const std::string asked =
        is_any ? "any format that is read" : std::string(facts_of(*request.format).word);
    return {Verdict::kWrong,
            offer.path + " does not offer " + asked +
                (request.size.width > 0 ? " with " + text_of(request.size) + " pixels" : ""),
            "correct format, size or [[camera]]; above stands what it offers"};
  }
  if (input != nullptr && !input->has_signal) {
    return {Verdict::kWrong, offer.path + " has no signal at input " + std::to_string(input->number),
            "is the console on, and the cable in?"};
  }
  if (input != nullptr && input->signal_size.width > 0 && request.size.width > 0 &&
      !(input->signal_size == request.size)) {
    return {Verdict::kWrong,
            offer.path + " has a signal of " + text_of(input->signal_size) + " pixels, asked for are " +
                text_of(request.size),
            "correct size and [[camera]], or the console's output"};
  }
  return {Verdict::kGood, offer.path + " offers what is asked for", ""};
}

std::vector<NamedFinding> examine_cameras(const Configuration& configuration,
                                          const MakeVideoDevice& make_device) {
  std::vector<NamedFinding> findings;
  for (std::size_t index = 0; index < configuration.image_sources.size(); ++index) {
    const SourceChoice& source = configuration.image_sources[index];
    const std::string& camera = configuration.room.cameras.at(index).name;
    const DriverDescription* const driver = find_driver(drivers(), source.driver);
    if (source.driver == "v4l2") {
      const CardOffer offer = survey_card(*make_device(), source.device);
      findings.push_back({"camera " + camera, camera_finding(offer, source.settings)});
    } else if (driver != nullptr && driver->device_socket) {
      findings.push_back({"camera " + camera, socket_finding(driver->device_socket(
                                                  source.device, camera, configuration.file.parent_path()))});
    }
  }
  return findings;
}

}  // namespace tubed
