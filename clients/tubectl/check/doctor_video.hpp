// What the doctor says about capture cards, and about where the images of a configuration come from.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "clients/tubectl/check/doctor_tracker.hpp"
#include "drivers/v4l2/card_survey.hpp"

namespace tubed {

using MakeVideoDevice = std::function<std::unique_ptr<VideoDevice>()>;

/// Every capture card of this machine, below `machine.root`/dev: name, inputs, signal, formats, largest sizes
/// and rates; one that this user may not open says so. Nothing is changed at a card.
std::vector<NamedFinding> examine_cards(const Machine& machine, const MakeVideoDevice& make_device);

/// For each [[camera]]: is its card there, may it be opened, and does it offer what is asked for; or is its
/// socket served by somebody. Nothing for other drivers.
std::vector<NamedFinding> examine_cameras(const Configuration& configuration,
                                          const MakeVideoDevice& make_device);

/// The same, of a card that was asked already.
Finding camera_finding(const CardOffer& offer, const DriverSettings& settings);

/// The kernel's devices.
std::unique_ptr<VideoDevice> make_linux_video_device();

}  // namespace tubed
