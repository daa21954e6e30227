#include "idl/validity.hpp"

#include <gtest/gtest.h>

#include <set>

namespace tubed {
namespace {

TEST(Validity, ForgottenMemoryIsNotAvailable) {
  EXPECT_EQ(static_cast<Validity>(0), Validity::kNotAvailable);
}

TEST(Validity, NamesAreThoseOfTheContract) {
  EXPECT_EQ(name_of(Validity::kQuestionable), "QUESTIONABLE");
  EXPECT_EQ(name_of(static_cast<Validity>(17)), "UNKNOWN");
}

TEST(Reasons, EveryBitHasANameOfItsOwn) {
  std::set<std::string> names;
  for (int bit = 0; bit < kReasonCount; ++bit) {
    names.insert(names_of(Reasons(1U << bit)));
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(kReasonCount));
  EXPECT_EQ(names_of(Reasons()), "-");
}

TEST(Reasons, AreJoinedInOrderOfTheirBits) {
  Reasons reasons;
  reasons.add(Reason::kDemoData);
  reasons.add(Reason::kCoilLost);
  EXPECT_EQ(names_of(reasons), "COIL_LOST|DEMO_DATA");
  EXPECT_TRUE(reasons.has(Reason::kCoilLost));
  EXPECT_FALSE(reasons.has(Reason::kEmStale));
}

}  // namespace
}  // namespace tubed
