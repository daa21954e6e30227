// A writer's program, process and host, as far as DDS tells.
#pragma once

#include <string>

#include "idl/dds_entity.hpp"

namespace tubed {

/// "tubed, process 4711 on host or-3, DDS writer 01108e3c...": program, process and host as Cyclone's
/// participants announce them, made printable (others: only the DDS writer's GUID), of a writer matched with
/// `reader`; its handle is sample_info.publication_handle. Each part was stated by that writer and proves
/// nothing. Allocates and takes locks of Cyclone's: not for a hot path. Never throws for what is not known.
std::string description_of_writer(const DdsEntity& reader, dds_instance_handle_t writer);

}  // namespace tubed
