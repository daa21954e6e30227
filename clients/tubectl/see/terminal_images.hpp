// What a terminal can show of pictures, and pictures in the forms that terminals take.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace tubed {

/// From the least to the most.
enum class TerminalImages {
  kNone,        ///< eight colours: no picture
  kGreys,       ///< the 24 greys of 256 colours, two pixels a character
  kTrueColour,  ///< 256 greys, two pixels a character
  kSixel,       ///< pixels, DEC's sixel graphics
  kKitty,       ///< pixels, kitty's graphics protocol
};

/// What the environment says, TERM and COLORTERM.
TerminalImages images_by_name(std::string_view term, std::string_view colour_term);

/// False for those of that name that would print a question.
bool answers_questions(std::string_view term);
/// Asks a terminal whether it knows kitty's pictures or sixels, and how large its characters are; every
/// terminal answers the last of the questions.
inline constexpr std::string_view kTerminalQuestions =
    "\033_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\033\\\033[16t\033[c";
/// The answer is whole: nothing more will come.
bool is_whole_answer(std::string_view answer);

/// What a terminal can show.
struct TerminalAbility {
  TerminalImages images = TerminalImages::kNone;
  int character_width_px = 10;
  int character_height_px = 20;
};
/// `by_name`: where the answer says nothing better.
TerminalAbility ability_of(std::string_view answer, TerminalImages by_name);

/// Colours of lines, as ANSI counts them: 31 red ... 36 cyan, 90 grey.
struct Rgb {
  std::uint8_t red = 0;
  std::uint8_t green = 0;
  std::uint8_t blue = 0;
};
Rgb rgb_of_ansi(int colour);

/// A grey picture with coloured lines. 16 greys, which noise does not need more of, and few colours: sixels
/// take a pass a colour.
class LinePicture {
 public:
  LinePicture(int width, int height);

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }

  /// Pixels outside are ignored. `grey`: 0 .. 255.
  void grey(int x, int y, std::uint8_t grey);
  void dot(double x, double y, int colour);
  /// Two pixels wide.
  void line(double x0, double y0, double x1, double y1, int colour);
  /// 'o' is a ring, any other letter a cross.
  void letter(double x, double y, char letter, int colour);

  [[nodiscard]] Rgb at(int x, int y) const;
  /// Moves no cursor but its own: drawn from the cursor's place to the right and down.
  [[nodiscard]] std::string as_sixel() const;
  /// The same; replaces the picture that was drawn before.
  [[nodiscard]] std::string as_kitty() const;

 private:
  static constexpr std::size_t kGreys = 16;
  [[nodiscard]] std::uint8_t& pixel(int x, int y) {
    return pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                   static_cast<std::size_t>(x)];
  }
  [[nodiscard]] bool contains(int x, int y) const { return x >= 0 && y >= 0 && x < width_ && y < height_; }

  int width_;
  int height_;
  std::vector<std::uint8_t> pixels_;  ///< below kGreys a grey, else a colour
};

}  // namespace tubed
