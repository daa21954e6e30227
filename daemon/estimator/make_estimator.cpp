#include <stdexcept>
#include <string>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/paper/paper_estimator.hpp"
#include "daemon/estimator/preshaped_estimator.hpp"
#include "daemon/estimator/recursive_estimator.hpp"
#include "daemon/estimator/relocalising_estimator.hpp"
#include "daemon/estimator/single_frame_estimator.hpp"
#include "daemon/image/measured_view.hpp"

namespace tubed {

namespace {

template <typename Inner>
std::unique_ptr<Estimator> make_preshaped(const EstimatorSettings& settings,
                                          const InstrumentDescription& instrument,
                                          const RoomDescription& room) {
  return std::make_unique<PreshapedEstimator>(
      settings, instrument, room, [&](const EstimatorSettings& of) -> std::unique_ptr<RestShapedEstimator> {
        return std::make_unique<Inner>(of, instrument, room);
      });
}

/// In a room whose views stay where their poses say.
std::unique_ptr<Estimator> make_inner(const EstimatorSettings& settings,
                                      const InstrumentDescription& instrument, const RoomDescription& room) {
  const bool may_have_hook = instrument.rest_shape != RestShape::kStraight && !room.cameras.empty();
  switch (settings.mode) {
    case EstimatorMode::kFilter:
      if (may_have_hook) return make_preshaped<RecursiveEstimator>(settings, instrument, room);
      return std::make_unique<RecursiveEstimator>(settings, instrument, room);
    case EstimatorMode::kPaper:
      return std::make_unique<PaperEstimator>(settings, instrument, room);
    case EstimatorMode::kJoint:
      if (may_have_hook) return make_preshaped<SingleFrameEstimator>(settings, instrument, room);
      return std::make_unique<SingleFrameEstimator>(settings, instrument, room);
    case EstimatorMode::kEm:
      return std::make_unique<SingleFrameEstimator>(settings, instrument, room);
  }
  throw std::logic_error("no estimator is made for mode " + std::string(name_of(settings.mode)));
}

}  // namespace

std::unique_ptr<Estimator> make_estimator(const EstimatorSettings& settings,
                                          const InstrumentDescription& instrument,
                                          const RoomDescription& configured) {
  // What estimators see of an image are the pixels that are measured.
  const RoomDescription room = measured_room(configured);
  if (instrument.coils.empty() || instrument.coils.size() > static_cast<std::size_t>(kMaxCoils)) {
    throw std::invalid_argument("instrument '" + instrument.id + "' needs 1 to " + std::to_string(kMaxCoils) +
                                " coils");
  }
  auto inner = make_inner(settings, instrument, room);
  if (settings.mode != EstimatorMode::kFilter || room.cameras.empty() || !room.registered) return inner;
  return std::make_unique<RelocalisingEstimator>(settings, instrument, room, std::move(inner));
}

}  // namespace tubed
