#include "clients/tubectl/see/demo_view.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>

#include "clients/tubectl/see/terminal_canvas.hpp"
#include "idl/estimate.hpp"
#include "idl/validity.hpp"

namespace tubed {

namespace {

constexpr int kGrey = 90;
constexpr int kRed = 31;
constexpr int kGreen = 32;
constexpr int kYellow = 33;
constexpr int kCyan = 36;

/// From mm to dots: `across` and `down` are indices of world axes.
struct Projection2d {
  int across;
  int down;
  double centre_across_mm;
  double centre_down_mm;
  double dots_per_mm;

  void draw(TerminalCanvas& canvas, const SampledCentreline& curve, int colour) const {
    for (Eigen::Index i = 1; i < curve.p_world_mm.cols(); ++i) {
      canvas.line(x(canvas, curve.p_world_mm.col(i - 1)), y(canvas, curve.p_world_mm.col(i - 1)),
                  x(canvas, curve.p_world_mm.col(i)), y(canvas, curve.p_world_mm.col(i)), colour);
    }
  }
  [[nodiscard]] double x(const TerminalCanvas& canvas, const Eigen::Vector3d& p) const {
    return canvas.width() / 2.0 + (p[across] - centre_across_mm) * dots_per_mm;
  }
  [[nodiscard]] double y(const TerminalCanvas& canvas, const Eigen::Vector3d& p) const {
    return canvas.height() / 2.0 + (p[down] - centre_down_mm) * dots_per_mm;
  }
};

int colour_of(std::uint32_t validity) {
  return validity == tubed_VALIDITY_VALID ? kGreen
                                          : (validity == tubed_VALIDITY_QUESTIONABLE ? kYellow : kRed);
}

std::string coloured(const std::string& text, int colour) {
  return "\033[" + std::to_string(colour) + "m" + text + "\033[0m";
}

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

/// What is neither VALID nor QUESTIONABLE is no shape to look at.
bool may_be_shown(const tubed_TubeEstimate& estimate) {
  return estimate.validity == tubed_VALIDITY_VALID || estimate.validity == tubed_VALIDITY_QUESTIONABLE;
}

void draw_tubes(TerminalCanvas& canvas, const Projection2d& view, const DemoFigures& figures,
                const DemoShapes& shapes) {
  const tubed_TubeEstimate& fused = *shapes.fused;
  view.draw(canvas, figures.truth_at(fused.valid_time_monotonic_ns), kGrey);
  if (shapes.em && may_be_shown(*shapes.em)) {
    view.draw(canvas, DemoFigures::centreline_of(*shapes.em), kRed);
  }
  if (!may_be_shown(fused)) {
    return;
  }
  const SampledCentreline centreline = DemoFigures::centreline_of(fused);
  view.draw(canvas, centreline, colour_of(fused.validity));
  for (std::uint32_t i = 0; i < std::min<std::uint32_t>(fused.coil_count, kMaxCoils); ++i) {
    if (!centreline.s_mm.empty()) {
      const Eigen::Vector3d p = point_at(centreline, static_cast<double>(fused.coils[i].offset_from_tip_mm));
      const bool used = fused.coils[i].state == 1;
      canvas.letter(view.x(canvas, p), view.y(canvas, p), used ? 'o' : 'x', used ? kCyan : kRed);
    }
  }
}

std::vector<std::string> text_lines(const DemoFigures& figures, const DemoShapes& shapes) {
  std::vector<std::string> lines;
  if (!shapes.fused) {
    lines.push_back(shapes.waiting);
    return lines;
  }
  const tubed_TubeEstimate& e = *shapes.fused;
  lines.push_back("validity   " +
                  coloured(std::string(name_of(static_cast<Validity>(e.validity))), colour_of(e.validity)) +
                  "  " + names_of(Reasons(e.reasons)) + (may_be_shown(e) ? "" : ": not shown"));
  lines.push_back(format("rate       %5.1f Hz       sample %llu", figures.recent_rate_hz(),
                         static_cast<unsigned long long>(e.sequence_number)));
  lines.push_back(format("latency    p50 %5.1f ms   p99 %5.1f ms   (exposure to here)",
                         figures.latency_ms(0.5), figures.latency_ms(0.99)));
  const auto em = figures.newest_rms_mm(1);
  const auto fused = figures.newest_rms_mm(0);
  lines.push_back("error      " + coloured(em ? format("EM only %4.1f mm", *em) : "EM only    -", kRed) +
                  "   " + coloured(fused ? format("fused %4.1f mm", *fused) : "fused    -", kGreen) +
                  "   (RMS against the truth)");
  if (!shapes.notice.empty()) {
    lines.push_back(coloured("subscriber " + shapes.notice, kYellow));
  }
  lines.push_back(shapes.faults.empty() ? "" : coloured("switched on: " + shapes.faults, kYellow));
  return lines;
}

}  // namespace

LiveTerminal::LiveTerminal() {
  tcgetattr(STDIN_FILENO, &before_);
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  std::fputs("\033[?1049h\033[?25l\033[2J", stdout);
}

LiveTerminal::~LiveTerminal() {
  tcsetattr(STDIN_FILENO, TCSANOW, &before_);
  std::fputs("\033[?25h\033[?1049l", stdout);
  std::fflush(stdout);
}

char LiveTerminal::key() {
  char key = 0;
  return read(STDIN_FILENO, &key, 1) == 1 ? key : '\0';
}

std::string draw_demo(const DemoFigures& figures, const DemoShapes& shapes, int rows, int columns) {
  const std::vector<std::string> lines = text_lines(figures, shapes);
  const int picture_rows = std::clamp(rows - static_cast<int>(lines.size()) - 6, 8, 60);
  const int front_columns = std::clamp(columns / 2 - 2, 20, 70);
  TerminalCanvas front(front_columns, picture_rows);
  TerminalCanvas side(front_columns, picture_rows);
  // As much of the image (240 x 360 mm at the world's origin) as fits, dots being square.
  const double scale = std::min(front.height() / 330.0, front.width() / 150.0);
  if (shapes.fused) {
    draw_tubes(front, {0, 1, 0, 30, scale}, figures, shapes);
    draw_tubes(side, {2, 1, 0, 30, scale}, figures, shapes);
  }
  std::string text =
      "\033[H\033[1mtubed demo\033[0m   simulated catheter, tracker and fluoroscope: not a "
      "patient\033[K\n\033[K\n";
  std::string heading = "as the fluoroscope sees it";
  heading.resize(static_cast<std::size_t>(front_columns) + 2, ' ');
  text += heading + "from the side (depth)\033[K\n";
  for (int row = 0; row < picture_rows; ++row) {
    text += front.row(row) + "  " + side.row(row) + "\033[K\n";
  }
  text += coloured("truth ", kGrey) + coloured(" EM only ", kRed) + coloured(" fused ", kGreen) +
          coloured(" o coil", kCyan) + "\033[K\n";
  for (const std::string& line : lines) {
    text += line + "\033[K\n";
  }
  return text +
         "keys: \033[1ms\033[0m stall the image   \033[1mo\033[0m fluoroscopy off/on   \033[1mc\033[0m lose "
         "a coil/back   "
         "\033[1mb\033[0m black image   \033[1mp\033[0m pan the table/back   \033[1mr\033[0m all well   "
         "\033[1mq\033[0m quit\033[K\033[J";
}

}  // namespace tubed
