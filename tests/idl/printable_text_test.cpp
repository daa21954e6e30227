#include "idl/printable_text.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <array>
#include <cstdlib>
#include <nlohmann/json.hpp>

namespace tubed {
namespace {

// Before rapidcheck looks: as many texts, and the same ones, each time.
const int kTexts = setenv("RC_PARAMS", "seed=20 max_success=5000", 0);

/// By other hands: nlohmann's decoder refuses what is no UTF-8.
bool is_utf8(const std::string& text) {
  try {
    static_cast<void>(nlohmann::json(text).dump());
    return true;
  } catch (const nlohmann::json::type_error&) {
    return false;
  }
}

TEST(PrintableText, PlainTextStaysAsItIs) {
  for (const char* const plain :
       {"", "cath-1", "Röntgen C-Bogen", "日本語", "Ωμέγα", "a\\b\"c", "\xF0\x9F\xA9\xBB", "\xEF\xBF\xBD"}) {
    EXPECT_EQ(printable_text(plain), plain);
  }
}

TEST(PrintableText, NobodyBeginsALineOrSpeaksToTheTerminal) {
  EXPECT_EQ(printable_text("A\n2026-01-01 error"), "A\uFFFD2026-01-01 error");
  EXPECT_EQ(printable_text("\x1b[2J"), "\uFFFD[2J");
  EXPECT_EQ(printable_text("a\r\t\x7f"), "a\uFFFD\uFFFD\uFFFD");
  EXPECT_EQ(printable_text("\xC2\x9B"
                           "2J"),
            "\uFFFD2J")
      << "the CSI of eight bits";
  EXPECT_EQ(printable_text("a\u2028b\u2029c"), "a\uFFFDb\uFFFDc");
  EXPECT_EQ(printable_text(std::string_view("a\0b", 3)), "a\uFFFDb");
}

TEST(PrintableText, NobodyTurnsTheTextRoundOrHidesInIt) {
  for (const char* const hidden :
       {"\u202A", "\u202B", "\u202C", "\u202D", "\u202E", "\u2066", "\u2067", "\u2068", "\u2069", "\u200B",
        "\u200E", "\u200F", "\u061C", "\uFEFF", "\U000E0041"}) {
    EXPECT_EQ(printable_text(std::string("a") + hidden + "b"), "a\uFFFDb") << hidden;
  }
}

TEST(PrintableText, BytesThatAreNoUtf8AreReplacedAsManyAsBelongTogether) {
  EXPECT_EQ(printable_text("\xFF\xFE"), "\uFFFD\uFFFD");
  EXPECT_EQ(printable_text("\xC0\xAF"), "\uFFFD\uFFFD") << "an overlong slash";
  EXPECT_EQ(printable_text("\xE0\x80\xAF"), "\uFFFD\uFFFD\uFFFD") << "an overlong slash";
  EXPECT_EQ(printable_text("\xED\xA0\x80"), "\uFFFD\uFFFD\uFFFD") << "a surrogate";
  EXPECT_EQ(printable_text("\xF4\x90\x80\x80"), "\uFFFD\uFFFD\uFFFD\uFFFD") << "beyond U+10FFFF";
  EXPECT_EQ(printable_text("\xE2\x82"
                           "A"),
            "\uFFFDA")
      << "a euro sign that breaks off";
  EXPECT_EQ(printable_text("B\xF6gel"), "B\uFFFDgel") << "Latin-1";
}

TEST(PrintableText, ItIsCutBetweenTwoCharacters) {
  EXPECT_EQ(printable_text("Bögel", 2), "B");
  EXPECT_EQ(printable_text("Bögel", 3), "Bö");
  EXPECT_EQ(printable_text("\n", 2), "");
  std::array<char, 3> buffer{'x', 'x', 'x'};
  copy_printable("aö", buffer);
  EXPECT_STREQ(buffer.data(), "a");
  EXPECT_EQ(buffer[2], '\0');
  copy_printable("ö", buffer);
  EXPECT_STREQ(buffer.data(), "ö");
}

/// Bytes of every kind, among them those that begin and continue characters.
rc::Gen<std::string> any_bytes() {
  const auto byte = rc::gen::oneOf(rc::gen::arbitrary<char>(), rc::gen::inRange<char>(' ', '~'),
                                   rc::gen::element('\x1b', '\n', '\xC3', '\xB6', '\xE2', '\x80', '\xAE',
                                                    '\xED', '\xA0', '\xF0', '\x9F', '\xEF', '\xBF', '\xBD'));
  return rc::gen::container<std::string>(byte);
}

RC_GTEST_PROP(PrintableText, WhateverComesIsUtf8WithinItsBoundAndStaysSo, ()) {
  const std::string bytes = *any_bytes();
  const auto most = *rc::gen::inRange<std::size_t>(0, 80);
  const std::string shown = printable_text(bytes, most);
  RC_ASSERT(is_utf8(shown));
  RC_ASSERT(shown.size() <= most);
  RC_ASSERT(printable_text(shown) == shown);
  RC_ASSERT(printable_text(bytes).compare(0, shown.size(), shown) == 0);
  for (const char c : shown) {
    RC_ASSERT(static_cast<unsigned char>(c) >= 0x20 && c != '\x7f');
  }
  std::array<char, 40> buffer{};
  copy_printable(bytes, buffer);
  RC_ASSERT(buffer.data() == printable_text(bytes, buffer.size() - 1));
}

RC_GTEST_PROP(PrintableText, PlainAsciiIsNeverTouched, ()) {
  const auto plain = *rc::gen::container<std::string>(rc::gen::inRange<char>(' ', '\x7f'));
  RC_ASSERT(printable_text(plain) == plain);
}

}  // namespace
}  // namespace tubed
