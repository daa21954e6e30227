#include "clients/tubectl/see/terminal_canvas.hpp"

#include <algorithm>
#include <array>
#include <cmath>

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

std::string TerminalCanvas::row(int row) const {
  std::string text;
  int colour = -1;
  for (int column = 0; column < columns_; ++column) {
    const Cell& cell = cells_[static_cast<std::size_t>(row * columns_ + column)];
    const bool empty = cell.dots == 0 && cell.letter == 0;
    if (!empty && cell.colour != colour) {
      colour = cell.colour;
      text += "\033[" + std::to_string(colour) + "m";
    }
    text += empty ? " " : (cell.letter != 0 ? std::string(1, cell.letter) : braille(cell.dots));
  }
  return text + "\033[0m";
}

}  // namespace tubed
