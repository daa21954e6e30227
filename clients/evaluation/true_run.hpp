// What a sequence folder says about the truth, as the evaluation wants it.
#pragma once

#include <filesystem>

#include "clients/evaluation/evaluation.hpp"
#include "drivers/replay/sequence_folder.hpp"

namespace tubed {

/// Rows of frames.csv with the same t_s are one instant, filed under the frame of the last of them; its view
/// is that of the first. Precondition: at least one camera.
TrueRun true_run_of(const Sequence& sequence);

/// Reads the folder, its cameras as `configuration` has them unless that is empty (see as_configured(), which
/// throws, too). Throws SequenceError, or std::runtime_error for a folder without truth.
TrueRun read_true_run(const std::filesystem::path& folder, const std::filesystem::path& configuration = {});

}  // namespace tubed
