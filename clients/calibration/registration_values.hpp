// A registration as values of the configuration, however it was found.
#pragma once

#include "clients/calibration/configuration_fragment.hpp"
#include "drivers/interface/registration_quality.hpp"
#include "idl/geometry/rigid_transform.hpp"

namespace tubed {

/// em.T_world_em, its residual, its covariance and the date, added to the fragment's values.
void add_registration(const RigidTransform& T_world_em, const RegistrationQuality& quality,
                      double residual_mm, ConfigurationFragment& fragment);

}  // namespace tubed
