#include "clients/tubectl/see/terminal_images.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <optional>

#include "clients/tubectl/see/terminal_canvas.hpp"

namespace tubed {
namespace {

TEST(TerminalImages, TheNameTellsColours) {
  EXPECT_EQ(images_by_name("xterm-256color", ""), TerminalImages::kGreys);
  EXPECT_EQ(images_by_name("xterm-256color", "truecolor"), TerminalImages::kTrueColour);
  EXPECT_EQ(images_by_name("screen", "24bit"), TerminalImages::kTrueColour);
  EXPECT_EQ(images_by_name("xterm-direct", ""), TerminalImages::kTrueColour);
  for (const char* term : {"", "dumb", "linux", "vt100", "xterm"}) {
    EXPECT_EQ(images_by_name(term, ""), TerminalImages::kNone) << term;
  }
  EXPECT_EQ(images_by_name("linux", "truecolor"), TerminalImages::kNone);
}

TEST(TerminalImages, TheAnswerTellsPixels) {
  const std::string plain = "\033[?62;22c";
  const std::string sixel = "\033[6;18;9t\033[?62;4;22c";
  const std::string kitty = "\033_Gi=31;OK\033\\\033[6;34;16t\033[?62;c";
  EXPECT_EQ(ability_of(plain, TerminalImages::kGreys).images, TerminalImages::kGreys);
  EXPECT_EQ(ability_of(sixel, TerminalImages::kGreys).images, TerminalImages::kSixel);
  EXPECT_EQ(ability_of(kitty, TerminalImages::kGreys).images, TerminalImages::kKitty);
  EXPECT_EQ(ability_of(sixel, TerminalImages::kGreys).character_height_px, 18);
  EXPECT_EQ(ability_of(sixel, TerminalImages::kGreys).character_width_px, 9);
  EXPECT_EQ(ability_of("\033_Gi=31;EINVAL\033\\" + plain, TerminalImages::kGreys).images,
            TerminalImages::kGreys);
  EXPECT_EQ(ability_of("\033[?64;40c", TerminalImages::kNone).images, TerminalImages::kNone);  // 40 is not 4
}

TEST(TerminalImages, NonsenseIsNoAnswer) {
  for (const char* answer :
       {"", "q", "\033[?", "\033[?62", "\033[6;999999999999t", "\033[6;0;0t\033[?1;2c"}) {
    const TerminalAbility ability = ability_of(answer, TerminalImages::kGreys);
    EXPECT_EQ(ability.images, TerminalImages::kGreys) << answer;
    EXPECT_EQ(ability.character_width_px, 10) << answer;
  }
  EXPECT_FALSE(is_whole_answer("\033[6;18;9t\033[?62;4"));
  EXPECT_TRUE(is_whole_answer("\033[6;18;9t\033[?62;4c"));
}

LinePicture drawn() {
  LinePicture picture(70, 20);
  for (int y = 0; y < 20; ++y) {
    for (int x = 0; x < 70; ++x)
      picture.grey(x, y, static_cast<std::uint8_t>((x / 7 * 25 + 3 * (y % 5)) % 256));
  }
  picture.line(-5, 3, 60, 18, 32);
  picture.letter(30, 10, 'o', 36);
  picture.letter(50, 5, 'x', 31);
  picture.grey(70, 0, 9);
  picture.dot(0.0 / 0.0, 3, 31);
  return picture;
}

/// What a terminal would show of it: (x, y) to rgb, percent.
std::map<std::pair<int, int>, std::array<int, 3>> decode_sixel(const std::string& text) {
  std::map<int, std::array<int, 3>> registers;
  std::map<std::pair<int, int>, std::array<int, 3>> pixels;
  std::size_t at = text.find('q') + 1;
  const auto number = [&] {
    char* end = nullptr;
    const long value = std::strtol(text.c_str() + at, &end, 10);
    at = static_cast<std::size_t>(end - text.c_str());
    return static_cast<int>(value);
  };
  const auto numbers = [&] {
    std::vector<int> list{number()};
    while (text[at] == ';') {
      ++at;
      list.push_back(number());
    }
    return list;
  };
  int x = 0;
  int y = 0;
  int colour = 0;
  while (at < text.size() && text[at] != '\033') {
    const char letter = text[at++];
    int count = 1;
    if (letter == '"') {
      numbers();
    } else if (letter == '#') {
      const std::vector<int> list = numbers();
      colour = list[0];
      if (list.size() == 5) registers[colour] = {list[2], list[3], list[4]};
    } else if (letter == '$') {
      x = 0;
    } else if (letter == '-') {
      x = 0;
      y += 6;
    } else {
      if (letter == '!') count = number();
      const char sixel = letter == '!' ? text[at++] : letter;
      EXPECT_TRUE(sixel >= '?' && sixel <= '~') << static_cast<int>(sixel);
      for (; count > 0; --count, ++x) {
        for (int bit = 0; bit < 6; ++bit) {
          if ((sixel - '?') >> bit & 1) pixels[{x, y + bit}] = registers[colour];
        }
      }
    }
  }
  return pixels;
}

TEST(LinePicture, AsSixelsEachPixelHasItsColour) {
  const LinePicture picture = drawn();
  const std::string text = picture.as_sixel();
  EXPECT_TRUE(text.starts_with("\033P")) << text.substr(0, 20);
  EXPECT_TRUE(text.ends_with("\033\\"));
  const auto pixels = decode_sixel(text);
  ASSERT_EQ(pixels.size(), 70U * 20U);
  for (const auto& [place, percent] : pixels) {
    const Rgb rgb = picture.at(place.first, place.second);
    EXPECT_NEAR(percent[0], rgb.red / 2.55, 0.6) << place.first << ", " << place.second;
    EXPECT_NEAR(percent[1], rgb.green / 2.55, 0.6);
    EXPECT_NEAR(percent[2], rgb.blue / 2.55, 0.6);
  }
}

std::string decode_base64(const std::string& text) {
  const std::string letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned word = 0;
  int bits = 0;
  for (const char letter : text) {
    if (letter == '=') break;
    word = word << 6U | static_cast<unsigned>(letters.find(letter));
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes += static_cast<char>(word >> static_cast<unsigned>(bits) & 0xFFU);
    }
  }
  return bytes;
}

TEST(LinePicture, ForKittyEachPixelIsSent) {
  for (const int width : {70, 71, 72}) {  // base64 ends in three ways
    LinePicture picture(width, 19);
    picture.grey(3, 2, 200);
    picture.line(0, 18, width - 1.0, 18, 33);
    const std::string text = picture.as_kitty();
    std::string data;
    int chunks = 0;
    for (std::size_t at = 0; at < text.size(); ++chunks) {
      ASSERT_EQ(text.substr(at, 3), "\033_G");
      const std::size_t semicolon = text.find(';', at);
      const std::size_t end = text.find("\033\\", semicolon);
      const std::string keys = text.substr(at + 3, semicolon - at - 3);
      EXPECT_TRUE(keys.ends_with(end + 2 == text.size() ? "m=0" : "m=1")) << keys;
      if (at == 0) {
        EXPECT_NE(keys.find("f=24,s=" + std::to_string(width) + ",v=19"), std::string::npos) << keys;
      }
      EXPECT_LE(end - semicolon - 1, 4096U);
      data += text.substr(semicolon + 1, end - semicolon - 1);
      at = end + 2;
    }
    EXPECT_GE(chunks, 2);
    EXPECT_EQ(data.size() % 4, 0U);
    const std::string bytes = decode_base64(data);
    ASSERT_EQ(bytes.size(), static_cast<std::size_t>(width) * 19 * 3);
    for (int y = 0; y < 19; ++y) {
      for (int x = 0; x < width; ++x) {
        EXPECT_EQ(static_cast<std::uint8_t>(bytes[static_cast<std::size_t>(3 * (y * width + x)) + 1]),
                  picture.at(x, y).green);
      }
    }
  }
}

TEST(LinePicture, LinesAndLettersLieOnTheGreys) {
  const LinePicture picture = drawn();
  EXPECT_EQ(picture.at(29, 11).green, rgb_of_ansi(32).green);
  EXPECT_EQ(picture.at(25, 10).blue, rgb_of_ansi(36).blue);  // the ring's left
  EXPECT_EQ(picture.at(50, 5).red, rgb_of_ansi(31).red);
  const Rgb bare = picture.at(69, 0);
  EXPECT_TRUE(bare.red == bare.green && bare.green == bare.blue);
}

TEST(TerminalCanvas, AHalfCharacterIsAPixel) {
  TerminalCanvas canvas(3, 1);
  canvas.background(0, 0, 10, 255);
  canvas.background(1, 0, 10, 255);
  canvas.background(3, 0, 1, 1);  // outside
  EXPECT_EQ(canvas.row(0, TerminalImages::kTrueColour),
            "\033[38;2;10;10;10;48;2;255;255;255m\u2580\u2580\033[0m \033[0m");
  EXPECT_EQ(canvas.row(0, TerminalImages::kGreys), "\033[38;5;232;48;5;255m\u2580\u2580\033[0m \033[0m");
  EXPECT_EQ(canvas.row(0), "\033[0m   \033[0m");
}

TEST(TerminalCanvas, DotsLieOnTheMeanOfBoth) {
  TerminalCanvas canvas(1, 1);
  canvas.background(0, 0, 100, 200);
  canvas.dot(0, 0, 32);
  EXPECT_EQ(canvas.row(0, TerminalImages::kTrueColour), "\033[92;48;2;150;150;150m\u2801\033[0m");
  EXPECT_EQ(canvas.row(0), "\033[0;32m\u2801\033[0m");
  canvas.letter(0, 0, 'o', 90);
  EXPECT_EQ(canvas.row(0, TerminalImages::kTrueColour), "\033[97;48;2;150;150;150mo\033[0m");
}

}  // namespace
}  // namespace tubed
