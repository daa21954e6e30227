// A drawing surface of a terminal: two by four dots a character (Unicode Braille), one colour a character;
// behind them a grey picture of one by two pixels a character.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "clients/tubectl/see/terminal_images.hpp"

namespace tubed {

class TerminalCanvas {
 public:
  TerminalCanvas(int columns, int rows);

  /// Dots across and down.
  [[nodiscard]] int width() const { return 2 * columns_; }
  [[nodiscard]] int height() const { return 4 * rows_; }

  /// Sets the dot at (x, y), origin top left; outside is ignored. `colour`: ANSI number, e.g. 32 = green; the
  /// last one wins for the whole character.
  void dot(double x, double y, int colour);
  /// A straight line of dots.
  void line(double x0, double y0, double x1, double y1, int colour);
  /// A letter in place of the character that holds (x, y).
  void letter(double x, double y, char letter, int colour);

  /// The grey values, 0 .. 255, behind the upper and the lower half of a character. Dots and letters on them
  /// are bright.
  void background(int column, int row, std::uint8_t upper, std::uint8_t lower);

  /// Row `row` as text with colours, always `columns` characters wide.
  /// `images`: how greys are written; none are with kNone.
  [[nodiscard]] std::string row(int row, TerminalImages images = TerminalImages::kNone) const;

 private:
  struct Cell {
    unsigned dots = 0;
    char letter = 0;
    int colour = 0;
    bool has_background = false;
    std::uint8_t upper = 0;
    std::uint8_t lower = 0;
  };
  [[nodiscard]] Cell* cell_at(double x, double y);
  static std::string text_of(const Cell& cell);
  static std::string style_of(const Cell& cell, TerminalImages images);

  int columns_;
  int rows_;
  std::vector<Cell> cells_;
};

}  // namespace tubed
