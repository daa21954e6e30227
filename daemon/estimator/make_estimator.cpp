#include <stdexcept>
#include <string>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/paper_estimator.hpp"
#include "daemon/estimator/recursive_estimator.hpp"
#include "daemon/estimator/single_frame_estimator.hpp"

namespace tubed {

std::string_view name_of(EstimatorMode mode) {
  switch (mode) {
    case EstimatorMode::kEm:
      return "em";
    case EstimatorMode::kPaper:
      return "paper";
    case EstimatorMode::kJoint:
      return "joint";
    case EstimatorMode::kFilter:
      return "filter";
  }
  return "unknown";
}

std::optional<EstimatorMode> mode_named(std::string_view name) {
  for (const EstimatorMode mode :
       {EstimatorMode::kEm, EstimatorMode::kPaper, EstimatorMode::kJoint, EstimatorMode::kFilter}) {
    if (name == name_of(mode)) {
      return mode;
    }
  }
  return std::nullopt;
}

std::unique_ptr<Estimator> make_estimator(const EstimatorSettings& settings,
                                          const InstrumentDescription& instrument,
                                          const RoomDescription& room) {
  if (instrument.coils.empty() || instrument.coils.size() > static_cast<std::size_t>(kMaxCoils)) {
    throw std::invalid_argument("instrument '" + instrument.id + "' needs 1 to " + std::to_string(kMaxCoils) +
                                " coils");
  }
  if (settings.mode == EstimatorMode::kFilter) {
    return std::make_unique<RecursiveEstimator>(settings, instrument, room);
  }
  if (settings.mode == EstimatorMode::kPaper) {
    return std::make_unique<PaperEstimator>(settings, instrument, room);
  }
  return std::make_unique<SingleFrameEstimator>(settings, instrument, room);
}

}  // namespace tubed
