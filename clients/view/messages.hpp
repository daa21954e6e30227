// What the page is told, as JSON. Pure.
#pragma once

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "EmSamples.h"
#include "TubeEstimate.h"
#include "TubeIdentity.h"
#include "TubeStatus.h"
#include "clients/view/room_files.hpp"

namespace tubed {

/// What goes to the control socket of one simulated source.
struct DemoOrder {
  std::string source;  ///< "em", "image-A"
  std::string words;   ///< what that source takes
};

/// A button of a simulated room.
struct DemoCommand {
  std::string name;   ///< what the page names
  std::string label;  ///< on the button
  std::vector<DemoOrder> orders;
};

/// What is known of the room.
struct RoomKnowledge {
  std::map<std::string, tubed_TubeIdentity> identities;  ///< by instrument
  std::map<std::string, tubed_TubeStatus> statuses;      ///< by instrument
  std::vector<std::string> image_cameras;                ///< whose images this process shows
  std::vector<DemoCommand> demo_commands;                ///< empty unless a demonstration runs
  RoomFiles files;                                       ///< that this process was given
};

/// {"type": "room", "instruments": [...], "cameras": [...], "stages": [...], ...}. Matrices row by row, mm. A
/// camera is there once, as the newest identity has it; "cameras" of an instrument are the names that the
/// views of its estimates count. "vessel": {"name", "kind", "size"} or null; "axes": "LPS" or "RAS" where an
/// instrument says which the world has, else ""; "points": [{"name", "p": mm in the world, "touched": where
/// it was touched, by the registration of the first instrument}], along the world's axes where they and the
/// file's are known.
nlohmann::json room_json(const RoomKnowledge& room);

/// {"type": "estimate", ...} of one shape. `received_ns`: CLOCK_MONOTONIC of this host, when it came; the
/// page measures ages with it. `coils`: the newest measurement of that instrument, or null; its poses are
/// turned to the world by `T_world_em` (16 numbers, row by row). Lengths mm, rounded to 1 um; "cov": xx xy xz
/// yy yz zz of each point, mm^2; "held": 0 nothing, 1 a coil, 2 an image, 3 both, of each point; "views": how
/// the cameras stood for the images that take part. What is NaN is null. The counts of `estimate` are within
/// its arrays or cut.
nlohmann::json estimate_json(const tubed_TubeEstimate& estimate, std::int64_t received_ns,
                             const tubed_EmSamples* coils, const double* T_world_em);

}  // namespace tubed
