#include "idl/permissions.hpp"

#include <gtest/gtest.h>

#include "idl/utc_time.hpp"

namespace tubed {
namespace {

// As the specification's own example orders it (DDS Security 1.1 Sec. 9.4.1.3.3), not as tubectl does.
constexpr const char* kDocument = R"(<?xml version="1.0"?>
<dds><permissions>
<grant name="other"><subject_name>CN=other</subject_name></grant>
<grant name="display">
  <subject_name>CN=view-1, O=OR-3</subject_name>
  <validity><not_before>2026-01-01T00:00:00</not_before><not_after>2026-02-01T12:30:00Z</not_after></validity>
  <allow_rule>
    <domains><id>0</id></domains>
    <subscribe><topics><topic>Tube*</topic></topics><partitions><partition>OR-3</partition></partitions></subscribe>
    <publish><topics><topic>Marks</topic></topics></publish>
  </allow_rule>
</grant></permissions></dds>)";

Grant display() { return grant_of(kDocument, "O=OR-3,CN=view-1").value(); }

TEST(Permissions, AGrantIsFoundByItsSubjectInAnyOrder) {
  EXPECT_TRUE(grant_of(kDocument, "CN=view-1,O=OR-3"));
  EXPECT_TRUE(grant_of(kDocument, "O=OR-3,CN=view-1"));
  EXPECT_FALSE(grant_of(kDocument, "CN=view-1,O=OR-4"));
}

TEST(Permissions, WhatIsNotNamedIsRefused) {
  EXPECT_TRUE(allows(display(), Access::kSubscribe, "TubeEstimate", "OR-3"));
  EXPECT_FALSE(allows(display(), Access::kSubscribe, "TubeEstimate", "OR-4"));
  EXPECT_FALSE(allows(display(), Access::kSubscribe, "TubeEstimate", ""));
  EXPECT_FALSE(allows(display(), Access::kSubscribe, "EmSamples", "OR-3"));
  EXPECT_FALSE(allows(display(), Access::kPublish, "TubeEstimate", "OR-3"));
}

TEST(Permissions, ARuleWithoutPartitionsIsForTheDefaultOneAlone) {
  EXPECT_TRUE(allows(display(), Access::kPublish, "Marks", ""));
  EXPECT_FALSE(allows(display(), Access::kPublish, "Marks", "OR-3"));
}

TEST(Permissions, TimesAreUtcWithAndWithoutTheZ) {
  EXPECT_EQ(display().valid_from_s, utc_from_text("2026-01-01"));
  EXPECT_EQ(utc_text(display().valid_until_s.value()), "2026-02-01T12:30:00Z");
}

TEST(Permissions, ADocumentCutAnywhereIsReadWithoutHarm) {
  const std::string whole = kDocument;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const std::optional<Grant> grant = grant_of(whole.substr(0, length), "CN=view-1,O=OR-3");
    EXPECT_FALSE(grant && allows(*grant, Access::kPublish, "TubeEstimate", "OR-3"));
  }
}

TEST(UtcTime, TextAndSecondsSayTheSame) {
  EXPECT_EQ(utc_text(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(utc_from_text("2026-11-23T08:36:21Z"), 1795422981);  // date -u -d 2026-11-23T08:36:21Z +%s
  EXPECT_EQ(utc_from_text("2026-11-23T08:36Z"), 1795422981 - 21);
  EXPECT_FALSE(utc_from_text("tomorrow"));
  EXPECT_FALSE(utc_from_text("2026-11-23T08:36:21+01:00"));
}

}  // namespace
}  // namespace tubed
