// The paper's second experiment, Sec. 3.2: a catheter with four coils in a silicone mock-up of the aorta,
// halted at five places.
#pragma once

#include "drivers/laboratory/scenario.hpp"
#include "drivers/laboratory/tracker/marker_registration.hpp"

namespace tubed {

/// Makes the experiment of a scenario that has patient, the paper's commands and one view toward the arch:
/// coils at 8, 94, 174 and 274 mm, f = 2900 px, five halts of 2 s, at steps drawn from the scenario's seed,
/// with one image at the end of each, a generator below the table, a warped field as in preset "field", and
/// the registration that bench_registration() gives.
void place_on_bench(Scenario& scenario);

/// The registration of such a scenario once more, with its markers.
SimulatedRegistration bench_registration(const Scenario& scenario);

}  // namespace tubed
