#include "clients/tubectl/see/demo_view.hpp"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "clients/cpp/centreline.hpp"
#include "clients/tubectl/see/dashes.hpp"
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
constexpr int kFirstPanelRow = 4;  // of the screen, counted from 1

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

/// Where a point lies on the surface; nothing: nowhere.
using Place = std::function<std::optional<Eigen::Vector2d>(const Eigen::Vector3d&)>;

/// How an image lies on a surface: as large as it fits, in the middle. px of the image to dots.
struct ImagePlace {
  ImagePlace(int image_width, int image_height, int surface_width, int surface_height)
      : scale(std::min(static_cast<double>(surface_width) / image_width,
                       static_cast<double>(surface_height) / image_height)),
        left((surface_width - scale * image_width) / 2),
        top((surface_height - scale * image_height) / 2) {}
  double scale;
  double left;
  double top;
};

/// As the camera sees it.
Place seen_by(const Camera& camera, const ImagePlace& place) {
  return [&camera, place](const Eigen::Vector3d& p) -> std::optional<Eigen::Vector2d> {
    const std::optional<Projection> image = camera.project(p);
    if (!image || !camera.contains(image->p_image_px)) return std::nullopt;
    return Eigen::Vector2d(place.left + (image->p_image_px.x() + 0.5) * place.scale,
                           place.top + (image->p_image_px.y() + 0.5) * place.scale);
  };
}

/// From the side: depth to the right, the image's y down, as far up and down as the image reaches there.
Place from_the_side(const Camera& camera, double depth_mm, int width, int height) {
  const CameraCalibration& seen = camera.calibration();
  const double scale = height * seen.fy / (seen.height * depth_mm);
  return [&seen, depth_mm, width, height, scale](const Eigen::Vector3d& p) -> std::optional<Eigen::Vector2d> {
    const Eigen::Vector3d q = seen.T_camera_world * p;
    const double middle_mm = (seen.height / 2.0 - seen.cy) * depth_mm / seen.fy;
    return Eigen::Vector2d(width / 2.0 + (q.z() - depth_mm) * scale,
                           height / 2.0 + (q.y() - middle_mm) * scale);
  };
}

/// `is_drawn`: which pieces, by the arc length of their ends.
template <typename Surface, typename IsDrawn>
void draw_curve(Surface& surface, const Place& place, const SampledCentreline& curve, int colour,
                IsDrawn is_drawn) {
  std::optional<Eigen::Vector2d> before;
  for (Eigen::Index i = 0; i < curve.p_world_mm.cols(); ++i) {
    const std::optional<Eigen::Vector2d> here = place(curve.p_world_mm.col(i));
    if (before && here && is_drawn(curve.s_mm[static_cast<std::size_t>(i)])) {
      surface.line(before->x(), before->y(), here->x(), here->y(), colour);
    }
    before = here;
  }
}

bool everywhere(double /*s_mm*/) { return true; }

template <typename Surface>
void draw_tubes(Surface& surface, const Place& place, const DemoFigures& figures, const DemoShapes& shapes) {
  const tubed_TubeEstimate& fused = *shapes.fused;
  draw_curve(surface, place, figures.truth_at(fused.valid_time_monotonic_ns), kGrey, everywhere);
  if (shapes.em && may_be_shown(*shapes.em)) {
    draw_curve(surface, place, DemoFigures::centreline_of(*shapes.em), kRed, everywhere);
  }
  if (!may_be_shown(fused)) {
    return;
  }
  const SampledCentreline centreline = DemoFigures::centreline_of(fused);
  draw_curve(surface, place, centreline, colour_of(fused.validity),
             [&](double s_mm) { return is_drawn_at(fused, s_mm); });
  for (std::uint32_t i = 0; i < std::min<std::uint32_t>(fused.coil_count, kMaxCoils); ++i) {
    if (centreline.s_mm.empty()) break;
    const auto p = place(point_at(centreline, static_cast<double>(fused.coils[i].offset_from_tip_mm)));
    const bool used = fused.coils[i].state == 1;
    if (p) surface.letter(p->x(), p->y(), used ? 'o' : 'x', used ? kCyan : kRed);
  }
}

/// Mean of the picture's pixels in a rectangle, px.
std::uint8_t mean_grey(const GreyPicture& picture, double x0, double y0, double x1, double y1) {
  const auto within = [](double value, int most) { return std::clamp(static_cast<int>(value), 0, most - 1); };
  const int left = within(x0, picture.width);
  const int top = within(y0, picture.height);
  const int right = std::max(within(std::ceil(x1) - 1, picture.width), left);
  const int bottom = std::max(within(std::ceil(y1) - 1, picture.height), top);
  int sum = 0;
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      sum += picture.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(picture.width) +
                            static_cast<std::size_t>(x)];
    }
  }
  return static_cast<std::uint8_t>(sum / ((right - left + 1) * (bottom - top + 1)));
}

/// Calls `set`(x, y, grey) for each pixel of the surface that the picture covers; a pixel is so many dots
/// wide and high.
template <typename Set>
void for_each_grey(const GreyPicture& picture, const ImagePlace& place, double wide, double high, Set set) {
  const double right = place.left + picture.width * place.scale;
  const double bottom = place.top + picture.height * place.scale;
  for (int y = static_cast<int>(std::ceil(place.top / high)); (y + 1) * high <= bottom + 1e-6; ++y) {
    for (int x = static_cast<int>(std::ceil(place.left / wide)); (x + 1) * wide <= right + 1e-6; ++x) {
      set(x, y,
          mean_grey(picture, (x * wide - place.left) / place.scale, (y * high - place.top) / place.scale,
                    ((x + 1) * wide - place.left) / place.scale, ((y + 1) * high - place.top) / place.scale));
    }
  }
}

/// Half a character is two by two dots.
void draw_image(TerminalCanvas& canvas, const GreyPicture& picture, const ImagePlace& place) {
  std::vector<std::optional<std::uint8_t>> above(static_cast<std::size_t>(canvas.width()));
  for_each_grey(picture, place, 2, 2, [&](int x, int y, std::uint8_t grey) {
    const auto column = static_cast<std::size_t>(x);
    if (y % 2 == 0) {
      above[column] = grey;
      canvas.background(x, y / 2, grey, grey);
    } else {
      canvas.background(x, y / 2, above[column].value_or(grey), grey);
    }
  });
}

bool draws_pixels(TerminalImages images) {
  return images == TerminalImages::kSixel || images == TerminalImages::kKitty;
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

std::vector<std::string> help_lines() {
  return {"Left: the newest fluoroscopic image and the tube as it is projected into it. Right: the tube from",
          "the side, where no image sees, but only the coils and the tube's stiffness know.",
          "",
          coloured("grey", kGrey) + "    the truth: only a simulation has it   " + coloured("red", kRed) +
              "     where the coils alone put it",
          coloured("green", kGreen) + "   the published shape, VALID            " +
              coloured("yellow", kYellow) + "  the same, QUESTIONABLE: the line says why",
          coloured("o", kCyan) + "       a coil that is used                   " + coloured("x", kRed) +
              "       a coil that is missing or not believed",
          "dashed  nothing holds the tube there: no coil is near, no image shows it",
          "An INVALID shape is none, and is not drawn.",
          "",
          "s  the image stalls for 3 s     o  fluoroscopy off, on     b  images are black",
          "c  coil 2 is lost, is back      p  the table pans by 5 mm, and back",
          "r  repair all                   i  image off, on           q  quit",
          "",
          "?  back to the picture. The same in a browser: tubectl demo --web"};
}

/// The two panels beside each other, row by row.
std::string draw_panels(const DemoFigures& figures, const DemoShapes& shapes, const DemoScreen& screen,
                        int columns, int rows) {
  Camera camera = figures.camera();
  camera.look_from(screen.geometry);
  const CameraCalibration& seen = camera.calibration();
  TerminalCanvas front(columns, rows);
  TerminalCanvas side(columns, rows);
  const ImagePlace place(seen.width, seen.height, front.width(), front.height());
  const bool has_pixels = screen.image != nullptr && draws_pixels(screen.ability.images);
  if (screen.image != nullptr && !has_pixels) draw_image(front, *screen.image, place);
  if (shapes.fused) {
    if (!has_pixels) draw_tubes(front, seen_by(camera, place), figures, shapes);
    draw_tubes(side, from_the_side(camera, shapes.side_depth_mm.value_or(1000), side.width(), side.height()),
               figures, shapes);
  }
  const TerminalImages greys = has_pixels ? TerminalImages::kNone : screen.ability.images;
  std::string text;
  for (int row = 0; row < rows; ++row) {
    // What the picture covers is left alone.
    text += (has_pixels ? "\033[" + std::to_string(columns) + "C" : front.row(row, greys)) + "  " +
            side.row(row) + "\033[K\n";
  }
  if (!has_pixels) return text;
  LinePicture picture(columns * screen.ability.character_width_px, rows * screen.ability.character_height_px);
  const ImagePlace in_pixels(seen.width, seen.height, picture.width(), picture.height());
  for_each_grey(*screen.image, in_pixels, 1, 1,
                [&](int x, int y, std::uint8_t grey) { picture.grey(x, y, grey); });
  if (shapes.fused) draw_tubes(picture, seen_by(camera, in_pixels), figures, shapes);
  return text + "\0337\033[" + std::to_string(kFirstPanelRow) + ";1H" +
         (screen.ability.images == TerminalImages::kKitty ? picture.as_kitty() : picture.as_sixel()) +
         "\0338";
}

}  // namespace

std::string LiveTerminal::ask() {
  std::fwrite(kTerminalQuestions.data(), 1, kTerminalQuestions.size(), stdout);
  std::fflush(stdout);
  std::string answer;
  constexpr int kPatience_ms = 300;
  pollfd waiting{STDIN_FILENO, POLLIN, 0};
  while (!is_whole_answer(answer) && answer.size() < 4096 && poll(&waiting, 1, kPatience_ms) == 1) {
    char byte = 0;
    if (read(STDIN_FILENO, &byte, 1) != 1) break;
    answer += byte;
  }
  return answer;
}

LiveTerminal::LiveTerminal() {
  tcgetattr(STDIN_FILENO, &before_);
  termios raw = before_;
  raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  raw.c_cc[VMIN] = 0;
  raw.c_cc[VTIME] = 0;
  tcsetattr(STDIN_FILENO, TCSANOW, &raw);
  std::fputs("\033[?1049h\033[?25l\033[2J", stdout);
  const char* const term = std::getenv("TERM");
  const char* const colours = std::getenv("COLORTERM");
  const TerminalImages by_name =
      images_by_name(term != nullptr ? term : "", colours != nullptr ? colours : "");
  ability_.images = by_name;
  if (answers_questions(term != nullptr ? term : "")) ability_ = ability_of(ask(), by_name);
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

std::optional<double> mean_depth_mm(const Camera& camera, const tubed_TubeEstimate& estimate) {
  const SampledCentreline centreline = DemoFigures::centreline_of(estimate);
  if (centreline.s_mm.empty()) return std::nullopt;
  return (camera.calibration().T_camera_world * Eigen::Vector3d(centreline.p_world_mm.rowwise().mean())).z();
}

std::string draw_demo(const DemoFigures& figures, const DemoShapes& shapes, const DemoScreen& screen) {
  const std::vector<std::string> lines = screen.shows_help ? help_lines() : text_lines(figures, shapes);
  const int picture_rows = std::clamp(screen.rows - static_cast<int>(lines.size()) - 6, 8, 60);
  const int columns = std::clamp(screen.columns / 2 - 2, 20, 70);
  std::string text =
      "\033[H\033[1mtubed demo\033[0m   simulated catheter, tracker and fluoroscope: not a "
      "patient\033[K\n\033[K\n";
  std::string heading = "as the fluoroscope sees it";
  heading.resize(static_cast<std::size_t>(columns) + 2, ' ');
  text += heading + "from the side (depth)\033[K\n";
  text += draw_panels(figures, shapes, screen, columns, picture_rows);
  if (!screen.shows_help) {
    text += coloured("truth ", kGrey) + coloured(" EM only ", kRed) + coloured(" fused ", kGreen) +
            coloured(" o coil", kCyan) + "\033[K\n";
  }
  for (const std::string& line : lines) {
    text += line + "\033[K\n";
  }
  return text +
         "keys: \033[1m?\033[0m help   \033[1ms\033[0m stall the image   \033[1mo\033[0m fluoroscopy off/on  "
         " "
         "\033[1mc\033[0m lose a coil/back   \033[1mp\033[0m pan the table/back   \033[1mr\033[0m all well   "
         "\033[1mq\033[0m quit\033[K\033[J";
}

}  // namespace tubed
