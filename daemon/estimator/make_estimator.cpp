#include <stdexcept>
#include <string>
#include <utility>

#include "daemon/estimator/estimator.hpp"
#include "daemon/estimator/images/misread_images_estimator.hpp"
#include "daemon/estimator/paper/paper_estimator.hpp"
#include "daemon/estimator/recursive_estimator.hpp"
#include "daemon/estimator/single_frame_estimator.hpp"
#include "daemon/estimator/tip/doubted_tip_estimator.hpp"
#include "daemon/estimator/tip/preshaped_estimator.hpp"
#include "daemon/estimator/view/relocalising_estimator.hpp"
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

/// An estimator that knows of straight tips alone.
std::unique_ptr<Estimator> doubted(const InstrumentDescription& instrument,
                                   std::unique_ptr<Estimator> straight) {
  if (!is_preshaped(instrument.rest_shape)) return straight;
  return std::make_unique<DoubtedTipEstimator>(instrument, std::move(straight));
}

/// In a room whose views stay where their poses say.
std::unique_ptr<Estimator> make_inner(const EstimatorSettings& settings,
                                      const InstrumentDescription& instrument, const RoomDescription& room) {
  const bool is_trusted = instrument.rest_shape == RestShape::kStraight && instrument.trust_straight;
  const bool asks_images = !room.cameras.empty() && !is_trusted;
  switch (settings.mode) {
    case EstimatorMode::kFilter:
      if (asks_images) return make_preshaped<RecursiveEstimator>(settings, instrument, room);
      return doubted(instrument, std::make_unique<RecursiveEstimator>(settings, instrument, room));
    case EstimatorMode::kPaper:
      return doubted(instrument, std::make_unique<PaperEstimator>(settings, instrument, room));
    case EstimatorMode::kJoint:
      if (asks_images) return make_preshaped<SingleFrameEstimator>(settings, instrument, room);
      return doubted(instrument, std::make_unique<SingleFrameEstimator>(settings, instrument, room));
    case EstimatorMode::kEm:
      return doubted(instrument, std::make_unique<SingleFrameEstimator>(settings, instrument, room));
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
  if (room.cameras.empty() || !room.registered) return inner;
  if (settings.mode == EstimatorMode::kFilter || settings.mode == EstimatorMode::kJoint) {
    inner = std::make_unique<MisreadImagesEstimator>(settings, instrument, room, std::move(inner));
  }
  if (settings.mode != EstimatorMode::kFilter) return inner;
  return std::make_unique<RelocalisingEstimator>(settings, instrument, room, std::move(inner));
}

}  // namespace tubed
