// An adult aorta from the femoral access to the valve, by its dimensions.
#pragma once

#include <cstdint>

#include "drivers/laboratory/vessel/vessel.hpp"

namespace tubed {

/// Dimensions in mm. Diameters of the thoracic aorta: Hager et al., J Thorac Cardiovasc Surg 123 (2002)
/// 1060-1066, means of 70 adults by helical CT at seven levels. Infrarenal aorta: Rogers et al., Am J Cardiol
/// (2013), Framingham Heart Study, mean of men (19.3) and women (16.7). Annulus: Davis et al., J Cardiovasc
/// Magn Reson 16 (2014) 9, mean of men (24.4) and women (21.0). Everything else (branches, access, lengths
/// and radii of the course) is no published mean but a plausible value chosen here.
struct AortaDimensions {
  double annulus_diameter = 22.7;            ///< Davis 2014
  double sinus_diameter = 29.8;              ///< Hager 2002, aortic valve sinus
  double ascending_diameter = 30.9;          ///< Hager 2002
  double before_innominate_diameter = 29.4;  ///< Hager 2002
  double proximal_arch_diameter = 27.7;      ///< Hager 2002, proximal transverse arch
  double distal_arch_diameter = 26.1;        ///< Hager 2002, distal transverse arch
  double isthmus_diameter = 24.7;            ///< Hager 2002
  double diaphragm_diameter = 24.3;          ///< Hager 2002
  double infrarenal_diameter = 18.0;         ///< Rogers 2013
  double iliac_diameter = 11.0;
  double femoral_diameter = 8.0;
  double brachiocephalic_diameter = 12.0;
  double left_carotid_diameter = 8.0;
  double left_subclavian_diameter = 9.5;

  double arch_radius = 32.0;                  ///< mean radius of curvature of the arch's centreline
  double arch_turn_from_anterior_rad = 0.85;  ///< of the arch's plane, toward the patient's right
  double ascending_length = 62.0;             ///< from the arch to the sinuses
  double descending_length = 215.0;           ///< from the diaphragm to the isthmus
  double tortuosity = 1.0;                    ///< scales the bends of iliac and descending aorta
};

/// Another patient for another seed: diameters within 1.2 standard deviations of Hager 2002 (14 % each,
/// moving together), the course within a tenth or so. Seed 0 is the mean patient.
AortaDimensions aorta_of_patient(std::int64_t seed);

/// Descending aorta, arch, ascending aorta, root with sinuses closed by the valve, the three branches of the
/// arch (45 mm each, open), and the access from the right femoral artery, straight for its first 30 mm. World
/// frame = the patient's, as in DICOM: x toward the patient's left, y posterior, z superior; the origin is
/// the centre of the arch's curvature. Takes about 0.1 s.
Vessel make_aorta(const AortaDimensions& dimensions);

}  // namespace tubed
