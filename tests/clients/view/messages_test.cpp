#include "clients/view/messages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>

namespace tubed {
namespace {

std::unique_ptr<tubed_TubeEstimate> estimate() {
  auto made = std::make_unique<tubed_TubeEstimate>();
  std::strcpy(made->instrument_id, "cath-1");
  made->validity = 2;
  made->reasons = 4 | 16384;
  made->point_count = 2;
  made->length_mm = 380;
  made->points[1].p_world_mm[2] = 1.23456;
  made->points[1].covariance_mm2[5] = 0.25F;
  return made;
}

TEST(EstimateJson, CarriesWhatIsShown) {
  const nlohmann::json json = estimate_json(*estimate(), 5'000'000, nullptr, nullptr);
  EXPECT_EQ(json["validity"], "QUESTIONABLE");
  EXPECT_EQ(json["reasons"], (nlohmann::json{"COIL_LOST", "DEMO_DATA"}));
  EXPECT_EQ(json["received"], 5.0);
  EXPECT_EQ(json["points"].size(), 6U);
  EXPECT_EQ(json["points"][5], 1.235);
  EXPECT_EQ(json["cov"].size(), 12U);
  EXPECT_EQ(json["cov"][11], 0.25);
  EXPECT_FALSE(json.contains("em"));
}

TEST(EstimateJson, SaysWhatHoldsEachPoint) {
  auto made = estimate();
  made->points[1].held_by = tubed_HELD_BY_COIL | tubed_HELD_BY_IMAGE;
  EXPECT_EQ(estimate_json(*made, 0, nullptr, nullptr)["held"], (nlohmann::json{0, 3}));
}

TEST(EstimateJson, SaysHowTheCamerasStoodForTheImagesThatTakePart) {
  auto made = estimate();
  made->view_count = 2;
  made->views[1].camera = 1;
  made->views[1].has_own_geometry = true;
  made->views[1].focal_length_px[0] = 1500;
  made->views[1].T_camera_world[11] = 900;
  const nlohmann::json views = estimate_json(*made, 0, nullptr, nullptr)["views"];
  ASSERT_EQ(views.size(), 2U);
  EXPECT_EQ(views[1]["camera"], 1);
  EXPECT_EQ(views[1]["f"][0], 1500);
  EXPECT_EQ(views[1]["T_camera_world"][11], 900);
}

TEST(EstimateJson, CountsBeyondTheArraysAreCut) {
  auto made = estimate();
  made->point_count = made->coil_count = made->view_count = std::numeric_limits<std::uint32_t>::max();
  const nlohmann::json json = estimate_json(*made, 0, nullptr, nullptr);
  EXPECT_EQ(json["points"].size(), 3U * 128U);
  EXPECT_EQ(json["coils"].size(), 16U);
}

TEST(EstimateJson, WhatIsNoNumberIsNull) {
  auto made = estimate();
  made->coil_count = 1;
  made->coils[0].position_mm = std::nanf("");
  made->points[0].p_world_mm[0] = std::numeric_limits<double>::infinity();
  made->em_age_ns = -1;
  const nlohmann::json json = nlohmann::json::parse(estimate_json(*made, 0, nullptr, nullptr).dump());
  EXPECT_TRUE(json["coils"][0]["mm"].is_null() && json["points"][0].is_null() && json["em_age"].is_null());
}

TEST(EstimateJson, LatencyIsOfSamplesWithAnImage) {
  auto made = estimate();
  made->stamps.exposure_monotonic_ns = 1'000'000;
  made->stamps.publish_started_monotonic_ns = 5'500'000;
  EXPECT_TRUE(estimate_json(*made, 0, nullptr, nullptr)["latency"].is_null());
  made->has_image = true;
  EXPECT_EQ(estimate_json(*made, 0, nullptr, nullptr)["latency"], 4.5);
}

TEST(EstimateJson, CoilsAreTurnedToTheWorld) {
  auto coils = std::make_unique<tubed_EmSamples>();
  coils->coil_count = 1;
  coils->coils[0] = {.status = 1, .p_em_mm = {1, 2, 3}, .tangent_em = {1, 0, 0}, .indicator = 0};
  // A quarter of a turn about z, then 10, 20, 30 mm.
  const double T[16]{0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1};
  const nlohmann::json json = estimate_json(*estimate(), 0, coils.get(), T);
  EXPECT_EQ(json["em"][0]["p"], (nlohmann::json{8.0, 21.0, 33.0}));
  EXPECT_EQ(json["em"][0]["t"], (nlohmann::json{0.0, 1.0, 0.0}));
}

TEST(RoomJson, ACameraThatSeveralInstrumentsShareIsThereOnce) {
  RoomKnowledge room;
  for (const char* id : {"cath-1", "cath-2"}) {
    auto identity = std::make_unique<tubed_TubeIdentity>();
    std::strcpy(identity->instrument_id, id);
    identity->camera_count = 1;
    std::strcpy(identity->cameras[0].name, "A");
    identity->cameras[0].width = 400;
    room.identities[id] = *identity;
  }
  const nlohmann::json json = room_json(room);
  EXPECT_EQ(json["instruments"].size(), 2U);
  ASSERT_EQ(json["cameras"].size(), 1U);
  EXPECT_EQ(json["cameras"][0]["width"], 400);
}

TEST(RoomJson, WhatAButtonSendsStaysHere) {
  RoomKnowledge room;
  room.demo_commands = {{"off", "Fluoroscopy off", {{"image-A", "off"}}}};
  EXPECT_EQ(room_json(room)["demo"],
            nlohmann::json::parse(R"([{"name": "off", "label": "Fluoroscopy off"}])"));
}

RoomKnowledge room_with_points(const char* world_axes, MarkerAxes file_axes) {
  RoomKnowledge room;
  room.files.points = {"points.csv", file_axes, {{"M1", {1.5, -2, 30}}, {"M2", {0, 0, 0}}}};
  auto identity = std::make_unique<tubed_TubeIdentity>();
  std::strcpy(identity->world_axes, world_axes);
  // A quarter of a turn about z, then 10, 20, 30 mm.
  const double T[16]{0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30, 0, 0, 0, 1};
  std::memcpy(identity->T_world_em, T, sizeof T);
  room.identities["cath-1"] = *identity;
  return room;
}

TEST(RoomJson, AVesselIsNamedAndNotSent) {
  RoomKnowledge room;
  EXPECT_TRUE(room_json(room)["vessel"].is_null());
  room.files.vessel = {"aorta\n.vtp", "vtp", 4096};
  EXPECT_EQ(room_json(room)["vessel"]["kind"], "vtp");
  EXPECT_EQ(room_json(room)["vessel"]["size"], 4096);
  EXPECT_EQ(room_json(room)["vessel"]["name"].get<std::string>().find('\n'), std::string::npos);
}

TEST(RoomJson, PointsOfAWorldWithoutNamedAxesStayAsTheyAre) {
  const nlohmann::json json = room_json(room_with_points("", MarkerAxes::kRas));
  EXPECT_EQ(json["axes"], "");
  ASSERT_EQ(json["points"].size(), 2U);
  EXPECT_EQ(json["points"][0], nlohmann::json::parse(R"({"name": "M1", "p": [1.5, -2.0, 30.0]})"));
}

TEST(RoomJson, PointsAreTurnedToTheAxesOfTheWorld) {
  const nlohmann::json json = room_json(room_with_points("LPS", MarkerAxes::kRas));
  EXPECT_EQ(json["axes"], "LPS");
  EXPECT_EQ(json["points"][0]["p"], (nlohmann::json{-1.5, 2.0, 30.0}));
  const nlohmann::json same = room_json(room_with_points("LPS", MarkerAxes::kLps));
  EXPECT_EQ(same["points"][0]["p"], (nlohmann::json{1.5, -2.0, 30.0}));
}

TEST(RoomJson, APointThatWasTouchedSaysWhereByTheRegistration) {
  RoomKnowledge room = room_with_points("", MarkerAxes::kAsWritten);
  room.files.touched.markers = {{"M1", {1, 2, 3}}, {"of another phantom", {0, 0, 0}}};
  const nlohmann::json json = room_json(room);
  EXPECT_EQ(json["points"][0]["touched"], (nlohmann::json{8.0, 21.0, 33.0}));
  EXPECT_FALSE(json["points"][1].contains("touched"));
  room.identities.clear();
  EXPECT_FALSE(room_json(room)["points"][0].contains("touched"));
}

}  // namespace
}  // namespace tubed
