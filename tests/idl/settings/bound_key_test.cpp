#include "idl/settings/bound_key.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

enum class Side { kLeft, kRight };

struct Settings {
  double width_mm = 2.5;
  int count = 3;
  bool is_open = true;
  Side side = Side::kRight;
  std::string name = "A";
  std::vector<int> cpus{1, 2};
  std::array<double, 2> centre_px{7, 8};
  std::optional<int> port;
};

BoundKey<Settings> side_key() {
  return key::word("side", &Settings::side, {{Side::kLeft, "left"}, {Side::kRight, "right"}}, "which side");
}

TEST(BoundKey, TheDefaultOfAKeyIsThatOfItsMember) {
  const auto default_of = [](const BoundKey<Settings>& bound) { return bound.key.default_value; };

  EXPECT_EQ(default_of(key::number("width_mm", &Settings::width_mm, "mm", {0, 9}, "width")),
            SettingValue(2.5));
  EXPECT_EQ(default_of(key::number("count", &Settings::count, "", {0, 9}, "count")),
            SettingValue(std::int64_t{3}));
  EXPECT_EQ(default_of(key::flag("is_open", &Settings::is_open, "open")), SettingValue(true));
  EXPECT_EQ(default_of(key::text("name", &Settings::name, {}, "name")), SettingValue(std::string("A")));
  EXPECT_EQ(default_of(side_key()), SettingValue(std::string("right")));
  EXPECT_EQ(default_of(key::numbers("cpus", &Settings::cpus, "", {0, 9}, {0, 4}, "cpus")),
            SettingValue(std::vector<std::int64_t>{1, 2}));
  EXPECT_EQ(default_of(key::numbers("centre_px", &Settings::centre_px, "px", {0, 9}, {2, 2}, "centre")),
            SettingValue(std::vector<double>{7, 8}));
}

TEST(BoundKey, AValueReachesItsMemberAndNoOther) {
  Settings settings;

  key::number("count", &Settings::count, "", {0, 9}, "count").set(settings, std::int64_t{5});
  side_key().set(settings, std::string("left"));
  key::numbers("cpus", &Settings::cpus, "", {0, 9}, {0, 4}, "cpus")
      .set(settings, std::vector<std::int64_t>{4});
  key::numbers("centre_px", &Settings::centre_px, "px", {0, 9}, {2, 2}, "centre")
      .set(settings, std::vector<double>{1, 2});
  key::number("port", &Settings::port, "", {0, 9}, "port").set(settings, std::int64_t{6});

  EXPECT_EQ(settings.count, 5);
  EXPECT_EQ(settings.side, Side::kLeft);
  EXPECT_EQ(settings.cpus, std::vector<int>{4});
  EXPECT_EQ(settings.centre_px, (std::array<double, 2>{1, 2}));
  EXPECT_EQ(settings.port, 6);
  EXPECT_EQ(settings.width_mm, 2.5);
  EXPECT_EQ(settings.name, "A");
}

TEST(BoundKey, AWordIsOneOfThoseThatHaveAValueInTheirOrder) {
  EXPECT_EQ(side_key().key.choices, (std::vector<std::string>{"left", "right"}));
  EXPECT_EQ(expectation(side_key().key), "left or right, in quotation marks");
}

TEST(BoundKey, ARequiredTextIsNotEmptyAndHasAnExample) {
  const BoundKey<Settings> name = key::required(key::text("name", &Settings::name, {}, "name"), "\"B\"");

  EXPECT_EQ(name.key.presence, Presence::kRequired);
  EXPECT_EQ(name.key.text.minimum_bytes, 1U);
  EXPECT_EQ(name.key.example, "\"B\"");
}

TEST(BoundKey, AnOptionalKeyShowsAValueThatIsNotItsMembers) {
  const BoundKey<Settings> port =
      key::optional(key::number("port", &Settings::port, "", {1, 9}, "port"), std::int64_t{2});

  EXPECT_EQ(port.key.presence, Presence::kOptional);
  EXPECT_EQ(port.key.default_value, SettingValue(std::int64_t{2}));
  EXPECT_EQ(Settings{}.port, std::nullopt);
}

TEST(KeyDescription, RangesAndAlternativesReadAsAPersonWritesThem) {
  EXPECT_EQ(expectation(key::real("rate_hz", 30, "Hz", {1, 120}, "rate")), "a real number from 1 to 120 Hz");
  EXPECT_EQ(expectation(key::integer("seed", 1, "", {0}, "seed")), "an integer of at least 0");
  EXPECT_EQ(alternatives({"em"}), "em");
  EXPECT_EQ(alternatives({"em", "joint", "filter"}), "em, joint or filter");
}

}  // namespace
}  // namespace tubed
