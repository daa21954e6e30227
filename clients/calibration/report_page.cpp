#include "clients/calibration/report_page.hpp"

#include <algorithm>
#include <cctype>

namespace tubed {

namespace {

// A4 at 96 px an inch.
constexpr double kWidth = 794;
constexpr double kHeight = 1123;
constexpr double kMargin = 48;
constexpr double kTextSize = 13;
constexpr double kLine = 19;
constexpr double kCharacter = 0.54 * kTextSize;  // mean width; sans-serif

constexpr const char* kInk = "#222";
constexpr const char* kGrey = "#777";
constexpr const char* kRed = "#b3261e";

const char* colour_of(ReportVerdict verdict) {
  return verdict == ReportVerdict::kGood ? "#1b7f3b" : verdict == ReportVerdict::kDoubtful ? "#b26a00" : kRed;
}

// Characters, not bytes, of UTF-8.
std::size_t length_of(const std::string& words) {
  return static_cast<std::size_t>(std::count_if(
      words.begin(), words.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) != 0x80U; }));
}

std::vector<std::string> broken(const std::string& words, double width) {
  const auto fitting = static_cast<std::size_t>(width / kCharacter);
  std::vector<std::string> lines{""};
  std::size_t begin = 0;
  while (begin < words.size()) {
    const std::size_t end = std::min(words.find(' ', begin), words.size());
    const std::string word = words.substr(begin, end - begin);
    if (!lines.back().empty() && length_of(lines.back()) + 1 + length_of(word) > fitting) {
      lines.emplace_back();
    }
    lines.back() += (lines.back().empty() ? "" : " ") + word;
    begin = end + 1;
  }
  return lines;
}

bool is_number(const std::string& cell) {
  return !cell.empty() && (std::isdigit(static_cast<unsigned char>(cell[0])) != 0 ||
                           ((cell[0] == '-' || cell[0] == '+') && cell.size() > 1));
}

std::vector<double> column_widths(const std::vector<std::string>& header,
                                  const std::vector<std::vector<std::string>>& rows) {
  std::vector<double> widths;
  double sum = 0;
  for (std::size_t column = 0; column < header.size(); ++column) {
    std::size_t longest = length_of(header[column]);
    for (const auto& row : rows) {
      longest = std::max(longest, length_of(row.at(column)));
    }
    widths.push_back(static_cast<double>(longest + 3) * kCharacter);
    sum += widths.back();
  }
  const double available = kWidth - 2 * kMargin;
  for (double& width : widths) {
    width *= sum > available ? available / sum : 1;
  }
  return widths;
}

}  // namespace

ReportPage::ReportPage(const std::string& title, const std::string& subtitle) : svg_(kWidth, kHeight) {
  svg_.text({kMargin, kMargin + 16}, title, 24, TextAnchor::kStart);
  svg_.text({kMargin, kMargin + 40}, subtitle, kTextSize, TextAnchor::kStart, kGrey);
  svg_.line({kMargin, kMargin + 54}, {kWidth - kMargin, kMargin + 54}, {"#ccc"});
  svg_.text({kMargin, kHeight - 24}, "tubed. Research software, not a medical device.", 11,
            TextAnchor::kStart, kGrey);
  y_ = kMargin + 78;
}

bool ReportPage::fits(double height_px) {
  if (!is_full_ && y_ + height_px > kHeight - 48) {
    is_full_ = true;
    svg_.text({kWidth - kMargin, kHeight - 24}, "There is more than fits on this page.", 11, TextAnchor::kEnd,
              kRed);
  }
  return !is_full_;
}

void ReportPage::heading(const std::string& words) {
  if (fits(2 * kLine + 16)) {
    svg_.text({kMargin, y_ + 14}, words, 17, TextAnchor::kStart);
    y_ += 34;
  }
}

void ReportPage::text(const std::string& words) {
  for (const std::string& line : broken(words, kWidth - 2 * kMargin)) {
    if (!fits(kLine)) return;
    svg_.text({kMargin, y_ + 8}, line, kTextSize, TextAnchor::kStart, kInk);
    y_ += kLine;
  }
  y_ += 4;
}

void ReportPage::verdict(ReportVerdict verdict, const std::string& words) {
  const char* const sign = verdict == ReportVerdict::kGood       ? "✓"
                           : verdict == ReportVerdict::kDoubtful ? "!"
                                                                 : "✗";
  bool is_first = true;
  for (const std::string& line : broken(words, kWidth - 2 * kMargin - 22)) {
    if (!fits(kLine)) return;
    if (is_first) {
      svg_.text({kMargin + 6, y_ + 8}, sign, 15, TextAnchor::kMiddle, colour_of(verdict));
    }
    svg_.text({kMargin + 22, y_ + 8}, line, kTextSize, TextAnchor::kStart, colour_of(verdict));
    is_first = false;
    y_ += kLine;
  }
  y_ += 4;
}

void ReportPage::table(const std::vector<std::string>& header,
                       const std::vector<std::vector<std::string>>& rows,
                       const std::vector<std::size_t>& marked) {
  const std::vector<double> widths = column_widths(header, rows);
  const auto write = [&](const std::vector<std::string>& cells, const std::string& colour,
                         const std::vector<std::string>& like) {
    double x = kMargin;
    for (std::size_t column = 0; column < widths.size(); ++column) {
      const bool right = is_number(like.at(column));
      svg_.text({right ? x + widths[column] - 2 * kCharacter : x, y_ + 8}, cells.at(column), kTextSize,
                right ? TextAnchor::kEnd : TextAnchor::kStart, colour);
      x += widths[column];
    }
    y_ += kLine;
  };
  if (!fits(2 * kLine)) return;
  write(header, kGrey, rows.empty() ? header : rows.front());
  svg_.line({kMargin, y_ - 5}, {kWidth - kMargin, y_ - 5}, {"#ccc"});
  y_ += 3;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    if (!fits(kLine)) return;
    const bool is_marked = std::find(marked.begin(), marked.end(), row) != marked.end();
    write(rows[row], is_marked ? kRed : kInk, rows[row]);
  }
  y_ += 10;
}

void ReportPage::figure(double height_px, const std::string& caption,
                        const std::function<void(Svg&, const Room&)>& draw) {
  if (!fits(height_px + 2 * kLine)) return;
  const Room room{{kMargin, y_}, kWidth - 2 * kMargin, height_px};
  svg_.begin_clip(room.corner, room.width, room.height);
  draw(svg_, room);
  svg_.end_clip();
  y_ += height_px + 12;
  for (const std::string& line : broken(caption, kWidth - 2 * kMargin)) {
    svg_.text({kMargin, y_ + 2}, line, 11, TextAnchor::kStart, kGrey);
    y_ += 15;
  }
  y_ += 8;
}

std::string ReportPage::str() const { return svg_.str(); }

}  // namespace tubed
