// DDS Security switched on for a participant: Cyclone's plug-ins and the files of an identity.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "idl/dds_entity.hpp"
#include "idl/key_folder.hpp"

namespace tubed {

/// Throws DdsError with everything that is wrong with the keys in `folder` at `now_s` (seconds since 1970,
/// UTC), one line each, or that they do not allow `access` to `topics` in `partition`. Returns whose they
/// are.
KeyHolder require_keys(const std::filesystem::path& folder, std::int64_t now_s, Access access,
                       const std::vector<std::string>& topics, const std::string& partition);

/// The properties of a participant that uses the keys in `folder` (see key_folder.hpp), DDS Security 1.1
/// Sec. 9.3.1 and 9.4.1. Throws DdsError when this build knows no security plug-ins.
DdsQos secured_participant_qos(const std::filesystem::path& folder);

}  // namespace tubed
