// Pictures shown again and new exposures, by their noise.
#include "drivers/v4l2/held_pictures.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>

namespace tubed {
namespace {

constexpr int kSide = 96;
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

/// Noise of standard deviation 1, from any place of which a picture's may be taken.
const std::vector<float>& noise() {
  static const std::vector<float> values = [] {
    std::mt19937 random(7);
    std::normal_distribution<float> normal;
    std::vector<float> drawn(1 << 21);
    for (float& value : drawn) {
      value = normal(random);
    }
    return drawn;
  }();
  return values;
}

/// A screen: a scene with quantum noise, its exposures captured with noise of the capture.
class Screen {
 public:
  Screen(double quantum_levels, double capture_levels) : quantum_(quantum_levels), capture_(capture_levels) {
    expose();
  }
  void expose() { exposed_ = any_place(); }
  const std::vector<std::uint8_t>& captured() {
    const float* const scene = noise().data() + exposed_;
    const float* const added = noise().data() + any_place();
    for (std::size_t at = 0; at < kPixels; ++at) {
      const bool is_shutter = at < kPixels * 6 / 10;  // the upper 60 % are black, as under a collimator
      const double shown = is_shutter ? 4 : std::round(100 + quantum_ * scene[at]);
      const double seen = capture_ > 0 ? std::round(shown + capture_ * added[at]) : shown;
      pixels_[at] = static_cast<std::uint8_t>(std::clamp(seen, 0.0, 255.0));
    }
    return pixels_;
  }
  std::vector<std::uint8_t>& pixels() { return pixels_; }

 private:
  std::size_t any_place() {
    return std::uniform_int_distribution<std::size_t>(0, noise().size() - kPixels - 1)(random_);
  }

  double quantum_;
  double capture_;
  std::mt19937 random_{3};
  std::size_t exposed_ = 0;
  std::vector<std::uint8_t> pixels_ = std::vector<std::uint8_t>(kPixels);
};

struct Errors {
  int held_taken_for_new = 0;
  int new_taken_for_held = 0;
};

/// Eight pictures of each exposure, as of 7.5 a second shown 60 times a second.
Errors errors_in(int pictures, double quantum_levels, double capture_levels, double noise_levels) {
  Screen screen(quantum_levels, capture_levels);
  HeldPictures held(noise_levels);
  held.begin({kSide, kSide}, PixelDepth::kGrey8);
  Errors errors;
  for (int picture = 0; picture < pictures; ++picture) {
    const bool is_exposure = picture % 8 == 0;
    if (is_exposure) {
      screen.expose();
    }
    const bool is_new = held.is_new(screen.captured());
    errors.held_taken_for_new += !is_exposure && is_new ? 1 : 0;
    errors.new_taken_for_held += is_exposure && !is_new ? 1 : 0;
  }
  return errors;
}

TEST(HeldPictures, OfADigitalSignalAreNeverTakenForNewNorTheOtherWayRound) {
  for (const double quantum : {8.0, 4.0, 2.0, 1.0}) {
    const Errors errors = errors_in(25'000, quantum, 0, 0.1);
    EXPECT_EQ(errors.held_taken_for_new, 0) << quantum;
    EXPECT_EQ(errors.new_taken_for_held, 0) << quantum;
  }
}

TEST(HeldPictures, OfAnAnalogSignalAreToldApartWhenItsNoiseIsKnown) {
  for (const double quantum : {8.0, 4.0, 2.0}) {
    const Errors errors = errors_in(4'000, quantum, 0.5, 0.6);  // rounding adds 0.29
    EXPECT_EQ(errors.held_taken_for_new, 0) << quantum;
    EXPECT_EQ(errors.new_taken_for_held, 0) << quantum;
  }
}

TEST(HeldPictures, AClockThatGoesOnMakesNoExposure) {
  Screen screen(2, 0);
  HeldPictures held(0.1);
  held.begin({kSide, kSide}, PixelDepth::kGrey8);
  held.is_new(screen.captured());
  for (int tick = 0; tick < 100; ++tick) {
    for (std::size_t y = 0; y < 8; ++y) {  // 8 x 24 of 96 x 96 pixels
      std::fill_n(screen.pixels().begin() + static_cast<long>(y * kSide), 24,
                  static_cast<std::uint8_t>(20 * tick));
    }
    ASSERT_FALSE(held.is_new(screen.pixels())) << tick;
  }
}

TEST(HeldPictures, TheFirstPictureAndThatOfAnotherSizeAreNew) {
  Screen screen(2, 0);
  HeldPictures held(0.1);
  held.begin({kSide, kSide}, PixelDepth::kGrey8);
  EXPECT_TRUE(held.is_new(screen.captured()));
  EXPECT_FALSE(held.is_new(screen.captured()));
  held.begin({kSide, kSide / 2}, PixelDepth::kGrey8);
  EXPECT_TRUE(held.is_new(screen.captured()));
}

TEST(HeldPictures, DeepPicturesAreComparedByTheirWords) {
  std::vector<std::uint16_t> words(kPixels, 1000);
  const std::span<const std::uint8_t> bytes(reinterpret_cast<const std::uint8_t*>(words.data()), 2 * kPixels);
  HeldPictures held(0.1);
  held.begin({kSide, kSide}, PixelDepth::kGrey16);
  held.is_new(bytes);
  EXPECT_FALSE(held.is_new(bytes));
  for (std::size_t at = 0; at < kPixels; at += 2) {
    words[at] += 256;  // the lower byte stays
  }
  EXPECT_TRUE(held.is_new(bytes));
}

// The lower third is a trace that never stands still.
TEST(HeldPictures, WhatMovesInAMaskIsNoExposure) {
  const ImageMask trace{0, 64, kSide, kSide - 64};
  Screen screen(2, 0);
  HeldPictures held(0.1, {trace});
  HeldPictures held_without(0.1);
  held.begin({kSide, kSide}, PixelDepth::kGrey8);
  held_without.begin({kSide, kSide}, PixelDepth::kGrey8);
  std::mt19937 random(5);
  int taken_without = 0;
  for (int picture = 0; picture < 40; ++picture) {
    const bool is_new = picture % 8 == 0;
    if (is_new) screen.expose();
    std::vector<std::uint8_t> shown = screen.captured();
    for (std::size_t at = std::size_t{64} * kSide; at < kPixels; ++at)
      shown[at] = static_cast<std::uint8_t>(random() % 256);
    EXPECT_EQ(held.is_new(shown), is_new) << picture;
    taken_without += held_without.is_new(shown) ? 1 : 0;
  }
  EXPECT_EQ(taken_without, 40) << "without the mask each is taken for an exposure";
}

}  // namespace
}  // namespace tubed
