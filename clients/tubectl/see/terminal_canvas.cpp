#include "clients/tubectl/see/terminal_canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace tubed {

namespace {

// Bit of each dot within a Braille character, by row and column: U+2800 and up.
constexpr std::array<std::array<unsigned, 2>, 4> kDotBits = {
    {{0x01, 0x08}, {0x02, 0x10}, {0x04, 0x20}, {0x40, 0x80}}};

std::string braille(unsigned dots) {
  const unsigned code = 0x2800 + dots;
  return {static_cast<char>(0xE0 | (code >> 12)), static_cast<char>(0x80 | ((code >> 6) & 0x3F)),
          static_cast<char>(0x80 | (code & 0x3F))};
}

const std::string kUpperHalf = "\xE2\x96\x80";  // U+2580

/// A grey as foreground (38) or background (48).
std::string grey_code(int ground, int grey, TerminalImages images) {
  const std::string start = std::to_string(ground);
  if (images == TerminalImages::kGreys) return start + ";5;" + std::to_string(232 + grey * 24 / 256);
  const std::string value = std::to_string(grey);
  return start + ";2;" + value + ";" + value + ";" + value;
}

/// Of an ANSI colour on a grey picture; grey itself becomes white.
int bright(int colour) { return colour == 90 ? 97 : colour + 60; }

}  // namespace

TerminalCanvas::TerminalCanvas(int columns, int rows)
    : columns_(columns),
      rows_(rows),
      cells_(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

TerminalCanvas::Cell* TerminalCanvas::cell_at(double x, double y) {
  if (!(x >= 0 && y >= 0 && x < width() && y < height())) {
    return nullptr;
  }
  return &cells_[static_cast<std::size_t>(static_cast<int>(y) / 4 * columns_ + static_cast<int>(x) / 2)];
}

void TerminalCanvas::dot(double x, double y, int colour) {
  if (Cell* cell = cell_at(x, y)) {
    cell->dots |= kDotBits[static_cast<std::size_t>(static_cast<int>(y) % 4)]
                          [static_cast<std::size_t>(static_cast<int>(x) % 2)];
    cell->colour = colour;
  }
}

void TerminalCanvas::line(double x0, double y0, double x1, double y1, int colour) {
  const int steps =
      std::clamp(static_cast<int>(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0)))), 1, 10'000);
  for (int i = 0; i <= steps; ++i) {
    const double share = static_cast<double>(i) / steps;
    dot(x0 + share * (x1 - x0), y0 + share * (y1 - y0), colour);
  }
}

void TerminalCanvas::letter(double x, double y, char letter, int colour) {
  if (Cell* cell = cell_at(x, y)) {
    cell->letter = letter;
    cell->colour = colour;
  }
}

void TerminalCanvas::background(int column, int row, std::uint8_t upper, std::uint8_t lower) {
  if (column < 0 || row < 0 || column >= columns_ || row >= rows_) return;
  Cell& cell = cells_[static_cast<std::size_t>(row * columns_ + column)];
  cell.has_background = true;
  cell.upper = upper;
  cell.lower = lower;
}

std::string TerminalCanvas::text_of(const Cell& cell) {
  if (cell.letter != 0) return std::string(1, cell.letter);
  if (cell.dots != 0) return braille(cell.dots);
  return cell.has_background ? kUpperHalf : " ";
}

std::string TerminalCanvas::style_of(const Cell& cell, TerminalImages images) {
  const bool is_drawn_on = cell.dots != 0 || cell.letter != 0;
  const bool has_background = cell.has_background && images != TerminalImages::kNone;
  if (!has_background) return is_drawn_on ? "\033[0;" + std::to_string(cell.colour) + "m" : "\033[0m";
  if (is_drawn_on) {
    const int mean = (cell.upper + cell.lower) / 2;
    return "\033[" + std::to_string(bright(cell.colour)) + ";" + grey_code(48, mean, images) + "m";
  }
  return "\033[" + grey_code(38, cell.upper, images) + ";" + grey_code(48, cell.lower, images) + "m";
}

std::string TerminalCanvas::row(int row, TerminalImages images) const {
  std::string text;
  std::string style;
  for (int column = 0; column < columns_; ++column) {
    Cell cell = cells_[static_cast<std::size_t>(row * columns_ + column)];
    cell.has_background = cell.has_background && images != TerminalImages::kNone;
    std::string now = style_of(cell, images);
    if (now != style) text += now;
    style = std::move(now);
    text += text_of(cell);
  }
  return text + "\033[0m";
}

}  // namespace tubed
