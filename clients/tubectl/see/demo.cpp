// tubectl demo: a catheter being tracked, without any hardware. A real tubed process in a private DDS domain,
// simulated sources, this process as subscriber.
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <optional>

#include "clients/cpp/topic_reader.hpp"
#include "clients/tubectl/see/demo_daemon.hpp"
#include "clients/tubectl/see/demo_figures.hpp"
#include "clients/tubectl/see/demo_image.hpp"
#include "clients/tubectl/see/demo_options.hpp"
#include "clients/tubectl/see/demo_picture.hpp"
#include "clients/tubectl/see/demo_view.hpp"
#include "clients/tubectl/see/progress_line.hpp"
#include "clients/tubectl/verbs.hpp"
#include "daemon/config/load_configuration.hpp"
#include "drivers/laboratory/simulated_world.hpp"

namespace tubed {

namespace {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr std::size_t kLastWords = 20;

volatile std::sig_atomic_t interrupted = 0;  // NOLINT: what a signal handler may touch

/// One running demonstration.
class Demo {
 public:
  explicit Demo(const DemoOptions& options)
      : scene_(scene_of(options)),
        daemon_(scene_),
        figures_(parse_configuration(daemon_.configuration(), daemon_.folder() / "tubed.toml")),
        subscriber_(Subscription{.domain = scene_.domain}, Delivery::kEvery),
        health_(Subscription{.domain = scene_.domain}),
        image_((daemon_.folder() / ("preview-" + figures_.camera().calibration().name + ".sock")).string()) {
    shapes_.waiting = "preparing preset " + options.preset + ", waiting for the first shape ...";
  }

  /// Takes whatever comes within `time`.
  void listen(milliseconds time) {
    const auto until = steady_clock::now() + time;
    while (steady_clock::now() < until) {
      const auto left = std::chrono::ceil<milliseconds>(until - steady_clock::now());
      const TubeNews news = subscriber_.wait_for(left);
      if (news.event == TubeEvent::kEstimate) {
        figures_.take(*news.sample);
        const bool fused = news.instrument_id == "cath-1";
        (fused ? shapes_.fused : shapes_.em) = news.sample->estimate;
        if (fused && !shapes_.side_depth_mm) {
          shapes_.side_depth_mm = mean_depth_mm(figures_.camera(), news.sample->estimate);
        }
        shapes_.notice.clear();
      } else if (news.event != TubeEvent::kTimeout) {
        figures_.count_event(news.event);
        shapes_.notice = "was told: " + std::string(name_of(news.event));
      }
      while (const tubed_TubeHealth* health = health_.take()) {
        figures_.take(*health);
      }
    }
  }

  void press(char key) {
    switch (key) {
      case 's':
        daemon_.command("image-A", "stall 3.0");
        break;
      case 'o':
        off_ = !off_;
        daemon_.command("image-A", off_ ? "off" : "on");
        break;
      case 'c':
        coil_lost_ = !coil_lost_;
        daemon_.command("em", coil_lost_ ? "lose-coil 2" : "restore-coil 2");
        break;
      case 'b':
        black_ = true;
        daemon_.command("image-A", "black");
        break;
      case 'p':
        panned_ = !panned_;
        daemon_.command("image-A", panned_ ? "pan 5" : "pan 0");
        break;
      case 'r':
        off_ = coil_lost_ = black_ = panned_ = false;
        daemon_.command("image-A", "clear");
        daemon_.command("em", "clear");
        break;
      default:
        break;
    }
    shapes_.faults = std::string(off_ ? "fluoroscopy off  " : "") + (coil_lost_ ? "coil 2 lost  " : "") +
                     (black_ ? "black image  " : "") + (panned_ ? "table panned" : "");
  }

  DemoDaemon& daemon() { return daemon_; }
  const DemoFigures& figures() const { return figures_; }
  DemoImage& image() { return image_; }
  const DemoShapes& shapes() const { return shapes_; }

 private:
  DemoScene scene_;
  DemoDaemon daemon_;
  DemoFigures figures_;
  TubeSubscriber subscriber_;
  TopicReader<tubed_TubeHealth> health_;
  DemoImage image_;
  DemoShapes shapes_;
  bool off_ = false;
  bool coil_lost_ = false;
  bool black_ = false;
  bool panned_ = false;
};

int say_ended(const EndedProgram& ended) {
  std::cerr << "tubectl demo: " << ended.name << " has ended by itself; its last words:\n";
  for (const std::string& line : ended.last_words) {
    std::cerr << "  " << line << '\n';
  }
  return kExitFailed;
}

bool write_file(const std::string& text, const std::string& file) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) {
    std::cerr << "tubectl demo: cannot write " << file << "; does the folder exist, may you write there?\n";
    return false;
  }
  return true;
}

bool write_json(const nlohmann::json& report, const std::string& file) {
  if (file == "-") {
    std::cout << report.dump(2) << '\n';
    return true;
  }
  return write_file(report.dump(2) + "\n", file);
}

/// "3.9 ms", or that there was none.
std::string with_unit(const nlohmann::json& value, const char* unit) {
  if (!value.is_number()) {
    return "not measured";
  }
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "%.2f %s", value.get<double>(), unit);
  return text.data();
}

void print_summary(const nlohmann::json& report) {
  const nlohmann::json latency =
      report["latency_ms"].is_null() ? nlohmann::json::object() : report["latency_ms"];
  std::cerr << "rate " << with_unit(report["rate_hz"], "Hz") << " over " << report["samples"]
            << " samples, latency p50 " << with_unit(latency.value("p50", nlohmann::json()), "ms") << ", p99 "
            << with_unit(latency.value("p99", nlohmann::json()), "ms") << "\nRMS error: EM only "
            << with_unit(report["rms_mm"]["em"], "mm") << ", fused "
            << with_unit(report["rms_mm"]["fused"], "mm") << "\nvalidity";
  for (const auto& [word, count] : report["validity"].items()) {
    std::cerr << ' ' << word << ' ' << count;
  }
  std::cerr << '\n';
}

int write_results(const Demo& demo, const DemoOptions& options, const nlohmann::json& report) {
  const bool json_written = options.json.empty() || write_json(report, options.json);
  const bool picture_written =
      options.picture.empty() || write_file(demo_picture_svg(demo.figures(), demo.shapes()), options.picture);
  return json_written && picture_written ? kExitOk : kExitFailed;
}

// Presets with a chest in the image take half a minute on a slow machine.
constexpr std::chrono::minutes kMaxPreparation{3};

/// Listens until the first VALID shape; nothing when it has come.
std::optional<EndedProgram> wait_for_a_shape(Demo& demo, const DemoOptions& options, ProgressLine& progress) {
  const auto began = steady_clock::now();
  while (demo.figures().samples() == 0 && steady_clock::now() < began + kMaxPreparation && interrupted == 0) {
    demo.listen(milliseconds(200));
    if (auto ended = demo.daemon().ended(kLastWords)) {
      return ended;
    }
    const auto waited = std::chrono::duration_cast<std::chrono::seconds>(steady_clock::now() - began);
    progress.say("preparing preset " + options.preset + ": " + std::to_string(waited.count()) + " s");
  }
  if (demo.figures().samples() > 0) {
    const std::chrono::duration<double> waited = steady_clock::now() - began;
    progress.say("first VALID shape after " + with_unit(waited.count(), "s"));
    progress.end();
  }
  return {};
}

int run_headless(Demo& demo, const DemoOptions& options) {
  ProgressLine progress;
  if (const auto ended = wait_for_a_shape(demo, options, progress)) {
    return say_ended(*ended);
  }
  const auto end = steady_clock::now() + std::chrono::duration<double>(options.headless_s);
  int second = 0;
  while (steady_clock::now() < end && interrupted == 0) {
    demo.listen(std::min(milliseconds(1000), std::chrono::ceil<milliseconds>(end - steady_clock::now())));
    if (const auto ended = demo.daemon().ended(kLastWords)) {
      return say_ended(*ended);
    }
    progress.say(std::to_string(++second) + " s, " + std::to_string(demo.figures().samples()) + " samples");
  }
  progress.end();
  const nlohmann::json report = demo.figures().summary();
  print_summary(report);
  if (demo.figures().samples() == 0) {
    std::cerr << "tubectl demo: no valid shape came; the daemon's last words:\n";
    for (const std::string& line : demo.daemon().log_tail(10)) {
      std::cerr << "  " << line << '\n';
    }
    return kExitFailed;
  }
  return write_results(demo, options, report);
}

/// The picture is in the browser: here are words only.
int run_web(Demo& demo, const DemoOptions& options) {
  std::cerr << "open http://" << options.listen
            << " in a browser; buttons there break things; Ctrl-C here ends\n";
  while (interrupted == 0) {
    demo.listen(milliseconds(200));
    if (const auto ended = demo.daemon().ended(kLastWords)) return say_ended(*ended);
  }
  std::cerr << '\n';
  const nlohmann::json report = demo.figures().summary();
  print_summary(report);
  return write_results(demo, options, report);
}

int run_live(Demo& demo, const DemoOptions& options) {
  std::optional<EndedProgram> ended;
  {
    LiveTerminal terminal;
    DemoScreen screen;
    screen.ability = terminal.ability();
    bool shows_image = screen.ability.images != TerminalImages::kNone;
    while (interrupted == 0 && !ended) {
      demo.listen(milliseconds(66));
      const char key = terminal.key();
      if (key == 'q') {
        break;
      }
      demo.press(key);
      shows_image ^= key == 'i';
      screen.shows_help ^= key == '?' || key == 'h';
      if (key == 'i') std::cout << "\033[2J";  // what was drawn in pixels stays otherwise
      winsize size{};
      if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 0) {
        screen.rows = size.ws_row;
        screen.columns = size.ws_col;
        if (size.ws_xpixel >= 2 * size.ws_col && size.ws_ypixel >= 2 * size.ws_row) {
          screen.ability.character_width_px = size.ws_xpixel / size.ws_col;
          screen.ability.character_height_px = size.ws_ypixel / size.ws_row;
        }
      }
      const std::int64_t now_ns = to_ns(steady_clock::now());
      demo.image().look(now_ns);
      screen.image = shows_image ? demo.image().picture(now_ns) : nullptr;
      screen.geometry = screen.image != nullptr ? demo.image().geometry() : std::nullopt;
      std::cout << draw_demo(demo.figures(), demo.shapes(), screen) << std::flush;
      ended = demo.daemon().ended(kLastWords);
    }
  }
  if (ended) {
    return say_ended(*ended);
  }
  const nlohmann::json report = demo.figures().summary();
  print_summary(report);
  return write_results(demo, options, report);
}

int run(DemoOptions options) {
  if (options.domain < 0) {
    options.domain = 100 + static_cast<int>(getpid() % 100);
  }
  const bool headless = options.headless_s > 0;
  if (!headless && !options.web && (isatty(STDIN_FILENO) == 0 || isatty(STDOUT_FILENO) == 0)) {
    std::cerr << "tubectl demo: this is no terminal; use --web, or --headless SECONDS --json FILE\n";
    return kExitUsage;
  }
  std::signal(SIGINT, [](int) { interrupted = 1; });
  std::signal(SIGTERM, [](int) { interrupted = 1; });
  Demo demo(options);
  return headless      ? run_headless(demo, options)
         : options.web ? run_web(demo, options)
                       : run_live(demo, options);
}

}  // namespace

CommandLine add_demo(CommandLine app, int& exit_code) {
  auto options = std::make_shared<DemoOptions>();
  CommandLine verb = app.add_subcommand("demo", "See a catheter being tracked, without any hardware");
  verb.add_option("--headless", options->headless_s,
                  "no picture: run for so many seconds from the first valid shape on, and print a summary")
      .in_range(1.0, 86400.0);
  verb.add_option("--json", options->json, "write the summary to this file, - for standard output");
  verb.add_option("--picture", options->picture, "draw the last shapes into this file, SVG");
  Argument web = verb.add_flag("--web", options->web,
                               "the picture in a browser, by tubed-view, with buttons that break things");
  verb.add_option("--listen", options->listen, "with --web: ADDRESS:PORT of the page")
      .capture_default_str()
      .needs(web);
  verb.add_option("--vessel", options->vessel,
                  "with --web: surface of a vessel, STL or .vtp, as for tubed-view")
      .needs(web);
  verb.add_option("--points", options->points, "with --web: registration points, as for tubed-view")
      .needs(web);
  verb.add_option("--domain", options->domain, "DDS domain, 0 .. 230; default: a private one")
      .in_range(0, 230);
  verb.add_option("--preset", options->preset,
                  "what is simulated; all but arch take some seconds to start, which is a plain tube without "
                  "a patient")
      .is_member(simulation_presets())
      .capture_default_str();
  Argument tracker =
      verb.add_option("--tracker", options->tracker,
                      "aurora-serial: an emulated NDI Aurora at a pseudo-terminal, read by the real driver; "
                      "aurora-can: the same behind tubectl can-gateway")
          .is_member(demo_trackers())
          .capture_default_str();
  verb.add_option("--can", options->can_interface,
                  "with --tracker aurora-can: a CAN interface, as vcan0; default: a socket instead of a bus")
      .needs(tracker);
  verb.add_option("--mistake", options->mistakes,
                  "what people and rooms get wrong, NAME=VALUES, as `tubectl simulate --help` lists it; may "
                  "be given several times");
  verb.add_option("--seed", options->seed, "of the simulated noise").capture_default_str();
  verb.callback([options, &exit_code] { exit_code = run(*options); });
  return verb;
}

}  // namespace tubed
