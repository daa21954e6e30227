#include "clients/tubectl/check/doctor_calibrations.hpp"

#include <gtest/gtest.h>

namespace tubed {
namespace {

Configuration room() {
  Configuration configuration;
  configuration.room.registered = true;
  configuration.room.cameras.resize(2);
  configuration.room.cameras[0].name = "A";
  configuration.room.cameras[1].name = "B";
  return configuration;
}

TEST(DoctorCalibrations, WhatIsNotStatedIsSaidWithWhatItCosts) {
  const auto findings = examine_calibrations(room());
  ASSERT_EQ(findings.size(), 3U);
  EXPECT_EQ(findings[0].finding.verdict, Verdict::kNote);
  EXPECT_NE(findings[0].finding.found.find("sigma has 2.5 mm and 1 degree"), std::string::npos)
      << findings[0].finding.found;
  EXPECT_NE(findings[0].finding.advice.find("tubectl register"), std::string::npos);
  EXPECT_EQ(findings[1].finding.verdict, Verdict::kNote);
  EXPECT_NE(findings[1].finding.found.find("pose of camera A"), std::string::npos);
  EXPECT_EQ(findings[2].finding.verdict, Verdict::kNote);
  EXPECT_NE(findings[2].finding.found.find("camera A"), std::string::npos);
}

TEST(DoctorCalibrations, APoseIsStatedByItsShiftAndItsTurnOfEveryCamera) {
  Configuration configuration = room();
  for (CameraCalibration& camera : configuration.room.cameras) camera.pose_sigma_mm = {0.3, 0.3, 0.5};
  configuration.room.cameras[0].pose_sigma_deg = {0.1, 0.1, 0.1};
  EXPECT_NE(examine_calibrations(configuration)[1].finding.found.find("camera B"), std::string::npos);
  configuration.room.cameras[1].pose_sigma_deg = {0.1, 0.1, 0.1};
  EXPECT_EQ(examine_calibrations(configuration)[1].finding.verdict, Verdict::kGood);
}

TEST(DoctorCalibrations, OneCameraThatStatesNothingIsNamed) {
  Configuration configuration = room();
  configuration.room.cameras[0].focal_sigma = 0.003;
  EXPECT_NE(examine_calibrations(configuration)[2].finding.found.find("camera B"), std::string::npos);
  configuration.room.cameras[1].focal_sigma = 0.003;
  EXPECT_EQ(examine_calibrations(configuration)[2].finding.verdict, Verdict::kGood);
}

TEST(DoctorCalibrations, AResidualOrACovarianceIsEnough) {
  Configuration by_residual = room();
  by_residual.room.registration_residual_mm = 0.5;
  EXPECT_EQ(examine_calibrations(by_residual)[0].finding.verdict, Verdict::kGood);
  Configuration by_covariance = room();
  by_covariance.room.registration_quality = RegistrationQuality{};
  EXPECT_EQ(examine_calibrations(by_covariance)[0].finding.verdict, Verdict::kGood);
}

TEST(DoctorCalibrations, ARoomWithoutRegistrationOrImagesIsNotAsked) {
  Configuration unregistered = room();
  unregistered.room.registered = false;
  EXPECT_TRUE(examine_calibrations(unregistered).empty());
  Configuration blind = room();
  blind.room.cameras.clear();
  EXPECT_TRUE(examine_calibrations(blind).empty());
}

}  // namespace
}  // namespace tubed
