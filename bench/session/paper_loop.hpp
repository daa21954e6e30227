// The paper's reconstruction loop, one thread, as faithful as its text allows: the peer of the whole daemon.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>

#include "bench/session/scene.hpp"
#include "bench/session/written_estimates.hpp"

namespace tubed {

/// Again and again, in sequence: grab the newest image, read the coils that came meanwhile, Frangi filter
/// with OpenCV, MAP of the coils, MLE of the image (estimator mode "paper"), publish. Until `until_ns`;
/// `wrote` is called after each dds_write has returned.
void run_paper_loop(const Scene& scene, const std::filesystem::path& folder, int domain,
                    std::int64_t start_ns, std::int64_t until_ns,
                    const std::function<void(const WrittenEstimate&)>& wrote);

}  // namespace tubed
