#include "clients/tubectl/see/terminal_images.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace tubed {

namespace {

struct AnsiColour {
  int number;
  Rgb rgb;
};
constexpr std::array<AnsiColour, 7> kColours{{{31, {255, 85, 80}},
                                              {32, {60, 220, 90}},
                                              {33, {255, 190, 40}},
                                              {34, {110, 150, 255}},
                                              {35, {215, 155, 255}},
                                              {36, {70, 215, 235}},
                                              {90, {165, 165, 165}}}};

std::size_t place_of(int colour) {
  const auto found = std::find_if(kColours.begin(), kColours.end(),
                                  [&](const AnsiColour& each) { return each.number == colour; });
  return static_cast<std::size_t>((found == kColours.end() ? kColours.end() - 1 : found) - kColours.begin());
}

/// The number that follows `from`, and what comes after it.
int number_after(std::string_view& from) {
  int value = 0;
  while (!from.empty() && from.front() >= '0' && from.front() <= '9' && value < 100'000) {
    value = 10 * value + (from.front() - '0');
    from.remove_prefix(1);
  }
  return value;
}

/// The numbers of ESC [ lead N ; N ... end; empty where there is no such answer.
std::vector<int> numbers_in(std::string_view answer, std::string_view lead, char end) {
  for (std::size_t at = answer.find(lead); at != std::string_view::npos; at = answer.find(lead, at + 1)) {
    std::string_view rest = answer.substr(at + lead.size());
    std::vector<int> numbers{number_after(rest)};
    while (rest.starts_with(';')) {
      rest.remove_prefix(1);
      numbers.push_back(number_after(rest));
    }
    if (rest.starts_with(end)) return numbers;
  }
  return {};
}

constexpr std::string_view kBase64 = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

std::string base64_of(const std::string& bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const auto byte = [&](std::size_t k) {
      return i + k < bytes.size() ? static_cast<unsigned>(static_cast<unsigned char>(bytes[i + k])) : 0U;
    };
    const unsigned word = byte(0) << 16U | byte(1) << 8U | byte(2);
    for (unsigned k = 0; k < 4; ++k) {
      text += i + k <= bytes.size() ? kBase64[word >> (18U - 6U * k) & 63U] : '=';
    }
  }
  return text;
}

/// `count` times the same sixel.
void add_run(std::string& text, std::size_t count, char sixel) {
  if (count > 3) {
    text += '!' + std::to_string(count) + sixel;
  } else {
    text.append(count, sixel);
  }
}

}  // namespace

bool answers_questions(std::string_view term) {
  return !term.empty() && term != "dumb" && term != "linux" && !term.starts_with("vt");
}

TerminalImages images_by_name(std::string_view term, std::string_view colour_term) {
  if (!answers_questions(term)) return TerminalImages::kNone;
  if (colour_term == "truecolor" || colour_term == "24bit" || term.ends_with("-direct")) {
    return TerminalImages::kTrueColour;
  }
  return term.find("256") == std::string_view::npos ? TerminalImages::kNone : TerminalImages::kGreys;
}

bool is_whole_answer(std::string_view answer) { return !numbers_in(answer, "\033[?", 'c').empty(); }

TerminalAbility ability_of(std::string_view answer, TerminalImages by_name) {
  TerminalAbility ability;
  ability.images = by_name;
  const std::vector<int> features = numbers_in(answer, "\033[?", 'c');
  constexpr int kSixelFeature = 4;
  if (std::find(features.begin(), features.end(), kSixelFeature) != features.end()) {
    ability.images = TerminalImages::kSixel;
  }
  if (answer.find("\033_Gi=31;OK") != std::string_view::npos) ability.images = TerminalImages::kKitty;
  const std::vector<int> size = numbers_in(answer, "\033[6;", 't');
  if (size.size() == 2 && size[0] >= 4 && size[0] <= 200 && size[1] >= 2 && size[1] <= 100) {
    ability.character_height_px = size[0];
    ability.character_width_px = size[1];
  }
  return ability;
}

Rgb rgb_of_ansi(int colour) { return kColours[place_of(colour)].rgb; }

LinePicture::LinePicture(int width, int height)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}

void LinePicture::grey(int x, int y, std::uint8_t grey) {
  if (contains(x, y)) pixel(x, y) = static_cast<std::uint8_t>(grey * kGreys / 256);
}

void LinePicture::dot(double x, double y, int colour) {
  if (!(x >= 0 && y >= 0 && x < width_ && y < height_)) return;  // NaN, too
  const auto index = static_cast<std::uint8_t>(kGreys + place_of(colour));
  for (int k = 0; k < 4; ++k) {
    const int px = static_cast<int>(x) + k % 2;
    const int py = static_cast<int>(y) + k / 2;
    if (contains(px, py)) pixel(px, py) = index;
  }
}

void LinePicture::line(double x0, double y0, double x1, double y1, int colour) {
  const double steps = std::clamp(std::ceil(std::max(std::abs(x1 - x0), std::abs(y1 - y0))), 1.0, 10'000.0);
  for (double i = 0; i <= steps; ++i) {
    dot(x0 + i / steps * (x1 - x0), y0 + i / steps * (y1 - y0), colour);
  }
}

void LinePicture::letter(double x, double y, char letter, int colour) {
  constexpr double kRadius_px = 5;
  if (letter != 'o') {
    line(x - kRadius_px, y - kRadius_px, x + kRadius_px, y + kRadius_px, colour);
    line(x - kRadius_px, y + kRadius_px, x + kRadius_px, y - kRadius_px, colour);
    return;
  }
  for (int i = 0; i < 40; ++i)
    dot(x + kRadius_px * std::cos(i * 0.157), y + kRadius_px * std::sin(i * 0.157), colour);
}

Rgb LinePicture::at(int x, int y) const {
  const std::uint8_t index =
      pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  if (index >= kGreys) return kColours[index - kGreys].rgb;
  const auto grey = static_cast<std::uint8_t>(index * 255 / (kGreys - 1));
  return {grey, grey, grey};
}

// ESC P q, the registers in percent, then bands of six rows: of each colour in a band which of the six pixels
// of each column have it, $ back to the band's beginning, - to the next band.
std::string LinePicture::as_sixel() const {
  constexpr std::size_t kAll = kGreys + kColours.size();
  std::string text = "\033P0;1q\"1;1;" + std::to_string(width_) + ";" + std::to_string(height_);
  const auto percent = [](std::size_t value) { return std::to_string((value * 100 + 127) / 255); };
  for (std::size_t i = 0; i < kAll; ++i) {
    const auto grey = static_cast<std::uint8_t>(std::min(i, kGreys - 1) * 255 / (kGreys - 1));
    const Rgb rgb = i < kGreys ? Rgb{grey, grey, grey} : kColours[i - kGreys].rgb;
    text += "#" + std::to_string(i) + ";2;" + percent(rgb.red) + ";" + percent(rgb.green) + ";" +
            percent(rgb.blue);
  }
  const auto columns = static_cast<std::size_t>(width_);
  std::array<std::vector<std::uint8_t>, kAll> band;
  for (int top = 0; top < height_; top += 6) {
    for (auto& colour : band) colour.clear();
    for (int row = top; row < std::min(top + 6, height_); ++row) {
      for (std::size_t x = 0; x < columns; ++x) {
        auto& colour = band[pixels_[static_cast<std::size_t>(row) * columns + x]];
        if (colour.empty()) colour.resize(columns);
        colour[x] = static_cast<std::uint8_t>(colour[x] | 1U << static_cast<unsigned>(row - top));
      }
    }
    for (std::size_t i = 0; i < kAll; ++i) {
      if (band[i].empty()) continue;
      text += "#" + std::to_string(i);
      for (std::size_t x = 0; x < columns;) {
        std::size_t end = x;
        while (end < columns && band[i][end] == band[i][x]) ++end;
        if (end < columns || band[i][x] != 0) add_run(text, end - x, static_cast<char>('?' + band[i][x]));
        x = end;
      }
      text += '$';
    }
    text += '-';
  }
  return text + "\033\\";
}

std::string LinePicture::as_kitty() const {
  std::string bytes;
  bytes.reserve(pixels_.size() * 3);
  for (int y = 0; y < height_; ++y) {
    for (int x = 0; x < width_; ++x) {
      const Rgb rgb = at(x, y);
      for (const std::uint8_t value : {rgb.red, rgb.green, rgb.blue}) bytes += static_cast<char>(value);
    }
  }
  const std::string data = base64_of(bytes);
  constexpr std::size_t kChunk = 4096;  // at most, by the protocol
  std::string text;
  for (std::size_t at = 0; at < data.size(); at += kChunk) {
    const bool is_last = at + kChunk >= data.size();
    text += "\033_G";
    if (at == 0) {
      // Picture 7 in place 1: sent again it replaces itself. q=2: no answers; C=1: the cursor stays.
      text += "a=T,i=7,p=1,q=2,C=1,f=24,s=" + std::to_string(width_) + ",v=" + std::to_string(height_) + ",";
    }
    text += std::string("m=") + (is_last ? "0" : "1") + ";" + data.substr(at, kChunk) + "\033\\";
  }
  return text;
}

}  // namespace tubed
