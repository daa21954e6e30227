// view_bench: what the watch over a view sees of moves that no pose announces, and how often it alarms
// without one. The camera really moves: every moved view is cast anew through the same patient, parallax
// included.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "bench/support/benchmark_program.hpp"
#include "bench/support/exchange.hpp"
#include "daemon/image/view_watch.hpp"
#include "drivers/laboratory/fluoroscope/c_arm.hpp"
#include "drivers/laboratory/fluoroscope/clutter.hpp"
#include "drivers/laboratory/fluoroscope/radiograph.hpp"
#include "drivers/laboratory/fluoroscope/thorax.hpp"

namespace tubed {
namespace {

constexpr double kRate_hz = 30;
constexpr double kLearning_s = 9;

struct Choice {
  double seconds = 30;  // of each unmoved run, after it has been learnt
  int instants = 4;     // at which each move is tried
  int seed = 1;
  std::string view;  // one alone; empty: all
};

/// A way to look at the patient.
struct View {
  std::string name;
  CArmAngles angles;
  int width, height;
  double field_mm;  // width at the isocentre
  double breath_mm;
  double quanta;
  bool has_clutter;
};

const std::vector<View> kViews{{"W60", {60, 0}, 400, 600, 240, 10, 240, true},
                               {"T45", {45, 5}, 512, 512, 154, 15, 120, true},
                               {"T30", {30, 0}, 512, 512, 154, 20, 80, false},
                               {"AP", {0, 0}, 400, 600, 240, 20, 60, false}};

/// What somebody does to table or C-arm.
struct Move {
  std::string name;
  double across_mm = 0, along_mm = 0;  // of the patient, in the picture
  double lao_deg = 0, cranial_deg = 0;
  double zoom = 1;
};

const std::vector<Move> kMoves{{.name = "pan-across-3mm", .across_mm = 3},
                               {.name = "pan-along-3mm", .along_mm = 3},
                               {.name = "pan-across-5mm", .across_mm = -5},
                               {.name = "pan-along-5mm", .along_mm = -5},
                               {.name = "pan-12mm", .across_mm = 9, .along_mm = -8},
                               {.name = "pan-40mm", .across_mm = -32, .along_mm = 24},
                               {.name = "turn-3deg", .lao_deg = -3},
                               {.name = "tilt-3deg", .cranial_deg = 3},
                               {.name = "turn-12deg", .lao_deg = 12},
                               {.name = "zoom-5%", .zoom = 1.05},
                               {.name = "zoom-20%", .zoom = 0.8}};

CameraCalibration camera_of(const View& view, const Move& move) {
  const CArmAngles angles{view.angles.lao_deg + move.lao_deg, view.angles.cranial_deg + move.cranial_deg};
  CameraCalibration camera = c_arm_view(view.name, angles, {0, -20, -95});
  camera.width = view.width;
  camera.height = view.height;
  camera.cx = view.width / 2.0;
  camera.cy = view.height / 2.0;
  camera.fx = camera.fy = move.zoom * camera.T_camera_world.translation().norm() * view.width / view.field_mm;
  camera.T_camera_world.translation() += Eigen::Vector3d(move.across_mm, move.along_mm, 0);
  return camera;
}

/// A breathing patient with a beating heart and, every 12 s, contrast agent, seen by one camera.
class Fluoroscope {
 public:
  Fluoroscope(const View& view, const Move& move, int seed)
      : view_(view),
        camera_(camera_of(view, move)),
        seed_(seed),
        radiograph_(camera_, patient(), settings(), seed) {
    frame_.width = view.width;
    frame_.height = view.height;
    frame_.pixels.resize(radiograph_.bytes_per_image());
    frame_.fluoroscopy_on = true;
    scene_.clutter = {view.has_clutter, view.has_clutter, false, true, true, -1};
    scene_.catheters.push_back(catheter_along(mean_aorta(), 0));
  }

  const ImageFrame& take(double time_s) {
    scene_.exposure = std::lround(time_s * kRate_hz) + 100'000L * seed_;
    scene_.time_s = time_s;
    scene_.clutter.contrast_age_s = std::fmod(time_s, 12.0);
    scene_.catheters.front() = catheter_along(mean_aorta(), 40 + 30 * std::sin(time_s / 2));
    radiograph_.render(scene_, frame_.pixels);
    frame_.exposure = from_ns(std::llround(time_s * 1e9) + 1);
    return frame_;
  }
  [[nodiscard]] const CameraCalibration& camera() const { return camera_; }

 private:
  static const AttenuationVolume& patient() {
    static const AttenuationVolume volume = make_thorax();
    return volume;
  }
  [[nodiscard]] RadiographSettings settings() const {
    RadiographSettings settings;
    add_default_clutter(settings);
    add_lumen(settings, mean_aorta());
    add_motion(settings);
    settings.detector.quanta_per_pixel = view_.quanta;
    settings.motion.diaphragm_travel_mm = view_.breath_mm;
    return settings;
  }

  View view_;
  CameraCalibration camera_;
  int seed_;
  Radiograph radiograph_;
  RadiographScene scene_;
  ImageFrame frame_;
};

/// What is done to an unmoved picture that must alarm nobody.
struct Disturbance {
  std::string name;
  std::function<void(ImageFrame& frame, double since_s)> apply;
};

/// Everything outside the opening is 3 +- 1 grey, as a detector shows a blade.
void close_blades(ImageFrame& frame, double share) {
  const int dx = static_cast<int>(share * frame.width);
  const int dy = static_cast<int>(share * frame.height);
  for (int y = 0; y < frame.height; ++y) {
    for (int x = 0; x < frame.width; ++x) {
      if (x < dx || x >= frame.width - dx || y < dy || y >= frame.height - dy) {
        auto& pixel = frame.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(frame.width) +
                                   static_cast<std::size_t>(x)];
        pixel = static_cast<std::uint8_t>(2 + (pixel * 7 + x * 31 + y * 17) % 3);
      }
    }
  }
}

void step_exposure(ImageFrame& frame, double gain, double offset) {
  for (std::uint8_t& pixel : frame.pixels) {
    pixel = static_cast<std::uint8_t>(std::clamp(128 + gain * (pixel - 128) + offset, 0.0, 255.0));
  }
}

const std::vector<Disturbance> kDisturbances{
    {"unmoved", [](ImageFrame&, double) {}},
    // To 28 % of each side in a second, and open again: what is left open is a fifth.
    {"blades",
     [](ImageFrame& frame, double since_s) {
       close_blades(frame, 0.28 * std::clamp(2 - std::abs(std::fmod(since_s, 8.0) - 3), 0.0, 1.0));
     }},
    {"exposure-steps", [](ImageFrame& frame, double since_s) {
       const bool is_second = std::fmod(since_s, 4.0) >= 2;
       step_exposure(frame, is_second ? 0.75 : 1.1, is_second ? 18 : -10);
     }}};

/// Verdicts over an unmoved view.
struct Quiet {
  std::vector<double> shares;
  double suspect = 0, moved = 0, unjudged = 0;
};

void add(const ViewVerdict& verdict, Quiet& quiet) {
  quiet.shares.push_back(verdict.still_share);
  quiet.suspect += verdict.state == ViewState::kSuspect ? 1 : 0;
  quiet.moved += verdict.state == ViewState::kMoved ? 1 : 0;
  quiet.unjudged += verdict.state == ViewState::kUnjudged ? 1 : 0;
}

class ViewBench {
 public:
  ViewBench(const View& view, const Choice& choice, Report& report)
      : view_(view), choice_(choice), report_(report), still_(view, {}, choice.seed) {}

  void run() {
    ViewWatch watch = learnt();
    for (const Disturbance& disturbance : kDisturbances) disturb(disturbance, watch);
    const std::vector<Instant> instants = instants_of(watch);
    for (const Move& move : kMoves) try_move(move, instants);
  }

 private:
  /// A watch as it was before the exposure of that time.
  struct Instant {
    double time_s;
    ViewWatch watch;
  };

  ViewWatch learnt() {
    ViewWatch watch(still_.camera());
    for (int i = 0; i < kLearning_s * kRate_hz; ++i) watch.observe(still_.take(i / kRate_hz));
    return watch;
  }

  void disturb(const Disturbance& disturbance, ViewWatch watch) {
    Quiet quiet;
    std::vector<double> cost_ms;
    for (int i = 0; i < choice_.seconds * kRate_hz; ++i) {
      const double since_s = i / kRate_hz;
      ImageFrame frame = still_.take(kLearning_s + since_s);
      disturbance.apply(frame, since_s);
      const std::int64_t begun_ns = monotonic_ns();
      const ViewVerdict& verdict = watch.observe(frame);
      cost_ms.push_back(static_cast<double>(monotonic_ns() - begun_ns) / 1e6);
      add(verdict, quiet);
    }
    const std::string name = "view/" + view_.name + "/" + disturbance.name;
    const auto count = static_cast<double>(quiet.shares.size());
    report_.add({name + "/still",
                 "share",
                 quiet.shares,
                 "",
                 {},
                 {{"suspect", quiet.suspect},
                  {"moved", quiet.moved},
                  {"unjudged", quiet.unjudged},
                  {"images", count}},
                 {}});
    report_.add({name + "/cost", "ms", cost_ms, "", {}, {}, {}});
    std::fprintf(
        stderr,
        "%-28s least still share %.2f; of %.0f images %.0f suspect, %.0f moved, %.0f unjudged; %.2f ms\n",
        name.c_str(), *std::min_element(quiet.shares.begin(), quiet.shares.end()), count, quiet.suspect,
        quiet.moved, quiet.unjudged, percentile(cost_ms, 50));
  }

  /// Spread over breaths and beats: 3.1 s apart.
  std::vector<Instant> instants_of(ViewWatch watch) {
    std::vector<Instant> instants;
    int i = static_cast<int>(kLearning_s * kRate_hz);
    for (int k = 0; k < choice_.instants; ++k) {
      for (const int end = i + static_cast<int>(3.1 * kRate_hz); i < end; ++i)
        watch.observe(still_.take(i / kRate_hz));
      instants.push_back({i / kRate_hz, watch});
    }
    return instants;
  }

  void try_move(const Move& move, const std::vector<Instant>& instants) {
    Fluoroscope moved(view_, move, choice_.seed);
    std::vector<double> shares;
    double at_first = 0, at_third = 0;
    for (const Instant& instant : instants) {
      ViewWatch watch = instant.watch;
      for (int image = 0; image < 3; ++image) {
        const ViewVerdict& verdict = watch.observe(moved.take(instant.time_s + image / kRate_hz));
        const bool is_said = verdict.state == ViewState::kSuspect || verdict.state == ViewState::kMoved;
        if (image == 0) {
          shares.push_back(verdict.still_share);
          at_first += is_said ? 1 : 0;
        }
        at_third += image == 2 && is_said ? 1 : 0;
      }
    }
    const std::string name = "view/" + view_.name + "/" + move.name;
    const auto count = static_cast<double>(instants.size());
    report_.add({name,
                 "share",
                 shares,
                 "",
                 {},
                 {{"first_image", at_first / count}, {"third_image", at_third / count}},
                 {}});
    std::fprintf(
        stderr,
        "%-28s still share %.2f .. %.2f; said at the first image in %.0f of %.0f, at the third in %.0f\n",
        name.c_str(), *std::min_element(shares.begin(), shares.end()),
        *std::max_element(shares.begin(), shares.end()), at_first, count, at_third);
  }

  View view_;
  Choice choice_;
  Report& report_;
  Fluoroscope still_;
};

void measure(const Choice& choice, Report& report) {
  for (const View& view : kViews) {
    if (choice.view.empty() || choice.view == view.name) ViewBench(view, choice, report).run();
  }
}

}  // namespace
}  // namespace tubed

int main(int argc, char** argv) {
  tubed::Choice choice;
  return tubed::run_benchmark(
      {"view", "What the watch over a view sees of moves, and how often it alarms without one.",
       tubed::Surroundings::kAsTheyAre,
       [&](tubed::CommandLine app) {
         app.add_option("--seconds", choice.seconds, "of each run without a move")
             .in_range(1.0, 3600.0)
             .capture_default_str();
         app.add_option("--instants", choice.instants, "at which each move is tried")
             .in_range(1, 100)
             .capture_default_str();
         app.add_option("--seed", choice.seed, "of the noise").in_range(0, 1000).capture_default_str();
         app.add_option("--view", choice.view, "one of W60, T45, T30, AP alone");
       },
       [&](tubed::Report& report) { tubed::measure(choice, report); },
       [](const nlohmann::json&) { return std::map<std::string, std::string>{}; }},
      argc, argv);
}
