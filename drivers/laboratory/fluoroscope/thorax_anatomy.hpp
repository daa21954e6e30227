// Where things are in the procedural chest: plausible dimensions of an adult, none of a person. Lengths mm,
// room frame.
#pragma once

#include <Eigen/Core>

namespace tubed::anatomy {

/// Linear attenuation, 1/mm, at about 65 keV (ICRU 44 tissues, rounded).
constexpr float kFat = 0.0186F;
constexpr float kSoft = 0.0205F;
constexpr float kMuscle = 0.0209F;
constexpr float kBlood = 0.0213F;
constexpr float kLiver = 0.0215F;
constexpr float kLung = 0.0060F;
constexpr float kCartilage = 0.0238F;
constexpr float kMarrow = 0.0250F;
constexpr float kCortical = 0.0460F;

/// An ellipse across the body at one height.
struct CrossSection {
  double x = 0, y = 0;                    ///< centre
  double half_width = 1, half_depth = 1;  ///< along x and y
};

/// The middle of the vertebral bodies at height z.
Eigen::Vector3d spine(double z);
/// The inside of the rib cage.
CrossSection rib_cage(double z);
/// The skin.
CrossSection skin(double z);
/// The upper face of the diaphragm at (x, y).
double diaphragm(double x, double y);
/// From the midline to the lung beside the mediastinum.
double mediastinum_half_width(double y, double z);

}  // namespace tubed::anatomy
