// What a configuration says, and the camera that follows from it.
#include "drivers/v4l2/v4l2_settings.hpp"

#include <gtest/gtest.h>

#include <map>

namespace tubed {
namespace {

using Numbers = std::vector<std::int64_t>;

DriverSettings settings_with(const std::map<std::string, SettingValue>& changed) {
  std::map<std::string, SettingValue> values;
  for (const KeyDescription& key : v4l2_settings()) {
    values.emplace(key.name, key.default_value);
  }
  for (const auto& [name, value] : changed) {
    values.insert_or_assign(name, value);
  }
  return DriverSettings(std::move(values));
}

CameraCalibration camera_of(int width, int height) {
  return {.name = "A", .width = width, .height = height, .fx = 2000, .fy = 2100, .cx = 500, .cy = 300};
}

TEST(V4l2Settings, DefaultsLeaveTheCameraAloneAndAskTheCardForItsSize) {
  CameraCalibration camera = camera_of(1024, 768);
  DriverSettings settings = settings_with({});

  EXPECT_EQ(deliver_camera(camera, settings), "");

  EXPECT_EQ(camera.width, 1024);
  EXPECT_EQ(camera.fx, 2000);
  EXPECT_EQ(v4l2_settings_of(settings).request.size, (PictureSize{1024, 768}));
}

TEST(V4l2Settings, TheCameraOfTheCardBecomesThatOfTheDeliveredPicture) {
  CameraCalibration camera = camera_of(1920, 1080);
  DriverSettings settings =
      settings_with({{"crop", Numbers{420, 0, 1080, 1080}}, {"decimation", std::int64_t{2}}});

  EXPECT_EQ(deliver_camera(camera, settings), "");

  EXPECT_EQ(camera.width, 540);
  EXPECT_EQ(camera.height, 540);
  EXPECT_DOUBLE_EQ(camera.fx, 1000);
  EXPECT_DOUBLE_EQ(camera.cx, (500 - 420 - 0.5) / 2);
  EXPECT_EQ(v4l2_settings_of(settings).request.size, (PictureSize{1920, 1080}))
      << "what the card is asked for";
}

TEST(V4l2Settings, ADeliveredCameraStaysAndTheCardIsAskedForWhatItNeeds) {
  CameraCalibration camera = camera_of(400, 600);
  DriverSettings settings = settings_with({{"camera_of", std::string("delivered")},
                                           {"decimation", std::int64_t{2}},
                                           {"rotate_deg", std::string("90")}});

  EXPECT_EQ(deliver_camera(camera, settings), "");

  EXPECT_EQ(camera.fx, 2000);
  EXPECT_EQ(v4l2_settings_of(settings).request.size, (PictureSize{1200, 800}));
}

TEST(V4l2Settings, WhatDoesNotGoTogetherIsToldWithTheNumbers) {
  const auto fault = [](const std::map<std::string, SettingValue>& changed) {
    CameraCalibration camera = camera_of(640, 480);
    DriverSettings settings = settings_with(changed);
    return deliver_camera(camera, settings);
  };
  EXPECT_NE(fault({{"size", Numbers{640}}}).find("size: expected [width, height]"), std::string::npos);
  EXPECT_NE(fault({{"crop", Numbers{0, 0, 640}}}).find("crop: expected [x, y, width, height]"),
            std::string::npos);
  EXPECT_NE(fault({{"crop", Numbers{1, 0, 640, 480}}}).find("leave 0 x 0 of the card's 640 x 480"),
            std::string::npos);
  EXPECT_NE(fault({{"decimation", std::int64_t{8}}}).find("leave 80 x 60"), std::string::npos);
  EXPECT_NE(fault({{"size", Numbers{800, 600}}}).find("size is 800 x 600 and [[camera]] 640 x 480"),
            std::string::npos);
  EXPECT_NE(fault({{"size", Numbers{800, 600}}, {"camera_of", std::string("delivered")}})
                .find("800 x 600 pixels become 800 x 600, [[camera]] has 640 x 480"),
            std::string::npos);
}

TEST(V4l2Settings, EveryFormatOfTheDriverCanBeAskedFor) {
  for (const PixelFormatFacts& facts : pixel_formats()) {
    const V4l2Settings asked = v4l2_settings_of(settings_with({{"format", std::string(facts.word)}}));
    EXPECT_EQ(asked.request.format, facts.format);
    EXPECT_EQ(pixel_format_of_fourcc(facts.fourcc), facts.format);
  }
  EXPECT_EQ(v4l2_settings_of(settings_with({})).request.format, std::nullopt);
}

}  // namespace
}  // namespace tubed
