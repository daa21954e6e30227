// Checked tables to the structs of the rooms below, with the checks that need more than one key.
#pragma once

#include <vector>

#include "daemon/config/checked_table.hpp"
#include "daemon/config/configuration.hpp"

namespace tubed {

using Problems = std::vector<ConfigurationProblem>;

/// [daemon], [realtime] and the back-off of [em].
PipelineSettings pipeline_settings(const CheckedTable& file, Problems& problems);
DdsSettings dds_settings(const CheckedTable& file, const std::filesystem::path& folder);
/// Relative paths are relative to `folder`, the configuration's.
ShmSettings shm_settings(const CheckedTable& file, const std::filesystem::path& folder);
FrangiSettings frangi_settings(const CheckedTable& file);

/// Registration, cameras and instruments.
RoomDescription room_description(const CheckedTable& file, Problems& problems);

/// What one [[instrument]] says of its tip while nothing bends it; its keys are read.
void check_rest_shape(const CheckedTable& table, const InstrumentDescription& instrument, Problems& problems);
/// That its stiffness is of pieces that the instrument has.
void check_stiffness(const CheckedTable& table, const InstrumentDescription& instrument, Problems& problems);

/// The C-arms of its cameras, as the room has placed them.
std::vector<std::optional<CArm>> c_arms(const CheckedTable& file);

/// [em.reference]: nothing without the table.
std::optional<ReferenceDescription> reference_description(const CheckedTable& file, Problems& problems);

/// A 4 x 4 matrix of the file as the rigid transform it has to be; identity when it is left out or is none.
RigidTransform rigid(const CheckedTable& table, const std::string& key, Problems& problems);

/// Whether the driver of the EM tracker can measure the reference: by its ports, with its orientation.
void check_reference_driver(const CheckedTable& file, const std::vector<DriverDescription>& available,
                            Problems& problems);

/// [estimator] with the mode of each [[instrument]], in their order.
std::vector<EstimatorSettings> estimator_settings(const CheckedTable& file, Problems& problems);

/// What `owner` ([em] or a [[camera]]) says about its driver. Required keys of the driver's table are
/// demanded here.
SourceChoice source_choice(const CheckedTable& file, const CheckedTable& owner,
                           const std::vector<DriverDescription>& available, Problems& problems);

/// Where the EM driver tells coils apart by their ports, every coil has to say its port.
void check_coil_ports(const CheckedTable& file, const std::vector<DriverDescription>& available,
                      Problems& problems);

/// The cameras of the room become those of the pictures that their drivers deliver: crop, decimation,
/// rotation. Nothing happens while there are problems.
void deliver_cameras(const CheckedTable& file, const std::vector<DriverDescription>& available,
                     Configuration& configuration, Problems& problems);

/// What is allowed but unusual: sources of different origin, two instruments on one sensor, tables nobody
/// uses.
Problems warnings(const CheckedTable& file, const std::vector<DriverDescription>& available);

}  // namespace tubed
