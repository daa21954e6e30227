// Are pictures negatives, or mirrored left to right?
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "daemon/estimator/single_frame_estimator.hpp"
#include "daemon/image/image_measurement.hpp"

namespace tubed {

/// Where images do not show a tube it may be that they are read in a wrong way: a bright tube is sought where
/// it is dark, or the picture is mirrored. Reads images as they are, as negatives and mirrored, in turn, each
/// by itself and with the coils of its instant alone (mode `joint`), and compares the shares of the tube's
/// lines that agree. Called by the optimizer thread after the estimate has left; memory is taken in the
/// constructor.
class MisreadImages {
 public:
  /// `room` as measured_room() has it.
  MisreadImages(const EstimatorSettings& settings, const InstrumentDescription& instrument,
                const RoomDescription& room);

  /// Reads images of that instant, if it is time to. `lost`: its images do not show the tube; asked for
  /// from then on, seldom where it was asked for long, and as long as something is found.
  void look(const Observation& observation, bool lost);

  /// How pictures of a camera have to be read.
  struct Found {
    Discord reading = Discord::kNone;  ///< kNegative or kMirrored
    std::uint32_t camera = 0;          ///< index in the room
    double agreeing = 0;               ///< share of the lines that agree so read, mean of the newest images
  };
  [[nodiscard]] const std::optional<Found>& found() const { return found_; }

  /// What a tube is on images of that camera: negatives were found, and it is left open what they are.
  [[nodiscard]] std::optional<RidgePolarity> polarity_of(std::size_t camera) const;

  /// Has something been found that a person has to change?
  [[nodiscard]] bool is_wrong() const { return found_ && !polarity_of(found_->camera); }

  void forget();

 private:
  void forget(std::size_t camera);

  struct Reading {
    Discord as = Discord::kNone;  ///< kNone: as it is
    std::size_t camera = 0;
    int count = 0;        ///< images that were read so, kRemembered at most
    double agreeing = 0;  ///< share of the lines, mean of the newest

    void add(double share);
  };

  struct View {
    RidgePolarity polarity = RidgePolarity::kDark;  ///< of the newest image
    bool polarity_is_open = false;                  ///< it may be another one
    std::size_t next = 0;                           ///< of its readings
    int read = 0;                                   ///< images since the tube was seen last
    MonotonicTime newest{};                         ///< image that was read
  };

  void notice_polarity(const Observation& observation);
  [[nodiscard]] std::optional<std::size_t> longest_unread(const Observation& observation) const;
  [[nodiscard]] static int due(const View& view, MonotonicTime instant);
  void read(const Observation& observation, Reading& reading);
  void conclude();

  SingleFrameEstimator estimator_;
  std::unique_ptr<TubeEstimate> estimate_;  ///< what it writes
  std::vector<ImageMeasurement> pictures_;  ///< one a camera: its image, read in another way
  std::vector<Reading> readings_;           ///< three a camera, one camera after the other
  std::vector<View> views_;                 ///< of each camera
  std::optional<Found> found_;
};

}  // namespace tubed
