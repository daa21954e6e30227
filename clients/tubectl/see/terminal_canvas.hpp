// A drawing surface of a terminal: two by four dots a character (Unicode Braille), one colour a character.
#pragma once

#include <string>
#include <vector>

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

  /// Row `row` as text with colours, always `columns` characters wide.
  [[nodiscard]] std::string row(int row) const;

 private:
  struct Cell {
    unsigned dots = 0;
    char letter = 0;
    int colour = 0;
  };
  [[nodiscard]] Cell* cell_at(double x, double y);

  int columns_;
  int rows_;
  std::vector<Cell> cells_;
};

}  // namespace tubed
