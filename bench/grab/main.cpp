// grab_bench: what reading a capture card costs, beside OpenCV's VideoCapture and GStreamer's v4l2src, by
// turns, each in a process of its own at a card in user space (user_space_card.cpp).
#include <dlfcn.h>
#include <unistd.h>

#include <climits>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <stdexcept>

#include "bench/grab/consumers.hpp"
#include "bench/support/benchmark_program.hpp"
#include "bench/support/child_process.hpp"
#include "bench/support/exchange.hpp"

namespace tubed {
namespace {

constexpr char kDevice[] = "/dev/video-in-user-space";
constexpr int kWarmUp = 15;    // pictures
constexpr int kPictures = 12;  // of the file

struct Choice {
  int rounds = 5;
  double seconds = 4;
};

/// One format of the issue at hand: its name in the report, and how its pictures are made.
struct Source {
  std::string name;
  CardFormat format;
};

const std::vector<Source>& sources() {
  static const std::vector<Source> all{{"mjpg-1920x1080", {kDevice, "MJPG", 1920, 1080, 30}},
                                       {"y16-1024x1024", {kDevice, "Y16 ", 1024, 1024, 30}}};
  return all;
}

/// Something like a radiograph: large shapes, edges, and noise that no picture shares with another.
cv::Mat radiograph_like(const CardFormat& format, int number) {
  cv::RNG random(static_cast<std::uint64_t>(number) + 1);
  cv::Mat picture(format.height, format.width, CV_32F);
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      picture.at<float>(y, x) = static_cast<float>(120 + 50 * std::sin(x / 90.0) * std::cos(y / 70.0));
    }
  }
  cv::line(picture, {100, 80}, {format.width - 200, format.height - 90}, cv::Scalar(60), 9, cv::LINE_AA);
  cv::Mat noise(picture.size(), CV_32F);
  random.fill(noise, cv::RNG::NORMAL, 0, 6);
  return picture + noise;
}

std::vector<std::uint8_t> bytes_of(const CardFormat& format, int number) {
  const cv::Mat picture = radiograph_like(format, number);
  cv::Mat words;
  if (format.fourcc == "MJPG") {
    cv::Mat colour;
    picture.convertTo(words, CV_8U);
    cv::cvtColor(words, colour, cv::COLOR_GRAY2BGR);  // as cards send it: with planes of colour, 4:2:0
    std::vector<std::uint8_t> jpeg;
    cv::imencode(".jpg", colour, jpeg, {cv::IMWRITE_JPEG_QUALITY, 90});
    return jpeg;
  }
  picture.convertTo(words, CV_16U, 256);
  return {words.data, words.data + words.total() * words.elemSize()};
}

std::string write_pictures(const Source& source, const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / (source.name + ".pictures");
  std::ofstream file(path, std::ios::binary);
  for (int number = 0; number < kPictures; ++number) {
    const std::vector<std::uint8_t> bytes = bytes_of(source.format, number);
    const auto size = static_cast<std::uint32_t>(bytes.size());
    file.write(reinterpret_cast<const char*>(&size), sizeof size);
    file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }
  return path;
}

/// Of all threads, to the nanosecond: getrusage() counts ticks on some machines.
double own_cpu_ms() {
  timespec used{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &used);
  return 1e3 * static_cast<double>(used.tv_sec) + 1e-6 * static_cast<double>(used.tv_nsec);
}

/// A function of the card that is preloaded here.
std::int64_t ask_card(const char* name) {
  const auto function = reinterpret_cast<std::int64_t (*)()>(dlsym(RTLD_DEFAULT, name));
  if (function == nullptr) throw std::runtime_error("the card in user space was not preloaded");
  return function();
}

/// One process, one turn: a line "cpu MS" a picture's CPU time, then a line "latency US" a picture.
int consume(const Consumer& consumer, const CardFormat& format, double seconds) {
  const int wanted = kWarmUp + static_cast<int>(seconds * format.rate_hz);
  std::vector<double> latency_us;
  int number = 0;
  double cpu_ms = 0;
  std::uint64_t sum = 0;  // of some pixels, so that they are there
  const auto costs = [] {
    return own_cpu_ms() - 1e-6 * static_cast<double>(ask_card("tubed_card_feeding_ns"));
  };
  consumer.read(format, [&](const std::uint8_t* pixels, std::size_t bytes) {
    const std::int64_t now_ns = monotonic_ns();
    const std::int64_t stamp_ns = ask_card("tubed_card_last_stamp_ns");
    sum += pixels[bytes / 2];
    if (++number == kWarmUp) cpu_ms = costs();
    if (number > kWarmUp) latency_us.push_back(1e-3 * static_cast<double>(now_ns - stamp_ns));
    if (number == wanted) cpu_ms = costs() - cpu_ms;
    return number < wanted;
  });
  std::printf("cpu %.6f\n", cpu_ms / (wanted - kWarmUp));
  for (const double us : latency_us) std::printf("latency %.3f\n", us);
  std::fflush(stdout);
  return sum == 0 ? 1 : 0;
}

std::string own_path() {
  std::string path(PATH_MAX, '\0');
  const ssize_t length = readlink("/proc/self/exe", path.data(), path.size());
  path.resize(length < 0 ? 0 : static_cast<std::size_t>(length));
  return path;
}

struct Costs {
  std::vector<double> cpu_ms, latency_us;
};

/// One turn of one consumer in a process of its own.
void take_turn(const Source& source, const std::string& pictures, const Consumer& consumer,
               const Choice& choice, const std::filesystem::path& folder, Costs& costs) {
  const std::filesystem::path log = folder / "turn";
  std::filesystem::remove(log);  // a process's words are added to what is there
  const std::string program = own_path();
  std::ostringstream card;
  card << source.format.device << ',' << source.format.width << ',' << source.format.height << ','
       << source.format.fourcc << ',' << source.format.rate_hz << ',' << pictures;
  const std::string library = std::filesystem::path(program).parent_path() / "libuser_space_card.so";
  ChildProcess child(
      {program, "--consume", source.name + "/" + consumer.name, std::to_string(choice.seconds)}, log, [&] {
        setenv("TUBED_CARD", card.str().c_str(), 1);
        setenv("LD_PRELOAD", library.c_str(), 1);
      });
  const int code = child.wait();
  std::ifstream lines(log);
  std::string word, words;
  double value = 0;
  while (lines >> word >> value) (word == "cpu" ? costs.cpu_ms : costs.latency_us).push_back(value);
  if (code != 0 || costs.cpu_ms.empty()) {
    std::ifstream again(log);
    std::ostringstream text;
    text << again.rdbuf();
    throw std::runtime_error(consumer.name + " ended with " + std::to_string(code) + ": " + text.str());
  }
}

void measure_source(const Source& source, const Choice& choice, Report& report) {
  const std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("grab_bench." + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const std::string pictures = write_pictures(source, folder);
  std::vector<Costs> costs(consumers().size());
  for (int round = 0; round < choice.rounds; ++round) {
    for (std::size_t i = 0; i < consumers().size(); ++i) {
      if (consumers()[i].read != nullptr)
        take_turn(source, pictures, consumers()[i], choice, folder, costs[i]);
    }
  }
  std::filesystem::remove_all(folder);
  for (std::size_t i = 1; i < consumers().size(); ++i) {
    const Consumer& peer = consumers()[i];
    if (peer.read == nullptr) {
      std::cerr << peer.name << " was not measured: apt-get install " << peer.missing
                << ", and build again\n";
    }
    const std::string name = peer.read == nullptr ? "" : peer.name;
    report.add({source.name + "/cpu/" + peer.name, "ms", costs[0].cpu_ms, name, costs[i].cpu_ms, {}, {}});
    report.add({source.name + "/latency/" + peer.name,
                "us",
                costs[0].latency_us,
                name,
                costs[i].latency_us,
                {},
                {}});
  }
}

/// grab_bench --consume SOURCE/CONSUMER SECONDS.
int consume_as_told(const std::string& what, double seconds) {
  for (const Source& source : sources()) {
    for (const Consumer& consumer : consumers()) {
      if (what == source.name + "/" + consumer.name && consumer.read != nullptr) {
        return consume(consumer, source.format, seconds);
      }
    }
  }
  throw std::runtime_error("nothing is called " + what);
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  using namespace tubed;
  if (argc == 4 && std::string(argv[1]) == "--consume") {
    try {
      return consume_as_told(argv[2], std::atof(argv[3]));
    } catch (const std::exception& error) {
      std::cerr << error.what() << '\n';
      return 1;
    }
  }
  Choice choice;
  BenchmarkProgram program;
  program.name = "grab";
  program.meaning =
      "CPU time and latency a picture of the driver v4l2 beside OpenCV's VideoCapture and GStreamer's "
      "v4l2src";
  program.surroundings = Surroundings::kAsTheyAre;
  program.add_options = [&](CommandLine app) {
    app.add_option("--rounds", choice.rounds, "turns of each").in_range(1, 1000).capture_default_str();
    app.add_option("--seconds", choice.seconds, "of a turn").in_range(0.5, 3600.0).capture_default_str();
  };
  program.draw = [](const nlohmann::json&) { return std::map<std::string, std::string>{}; };
  program.measure = [&](Report& report) {
    for (const Source& source : sources()) measure_source(source, choice, report);
  };
  return run_benchmark(program, argc, argv);
}
