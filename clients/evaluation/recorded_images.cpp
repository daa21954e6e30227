// The check of a recording that asks its images and no coil.
#include <vector>

#include "clients/evaluation/finding_text.hpp"
#include "clients/evaluation/offline_reconstruction.hpp"
#include "clients/evaluation/recording_check.hpp"
#include "daemon/image/image_checks.hpp"
#include "daemon/image/mask_cover.hpp"

namespace tubed {

namespace {

constexpr int kImagesAsked = 60;  // of a camera, one after the other

struct Averaging {
  double share = 0;        ///< of earlier images in each image; 0: nothing
  bool gives_way = false;  ///< where something moves
};

/// Of that camera's images, as the last of them have it.
Averaging averaged(const Sequence& sequence, std::size_t index) {
  CameraCalibration camera = sequence.room.cameras[index];
  camera.time_averaging = TimeAveraging::kUndo;
  MaskCover cover(camera);
  ImageDoor door(camera);
  ImageMeasurement measurement;
  measurement.reserve(camera.width, camera.height);
  int asked = 0;
  Averaging averaging;
  for (const SequenceFrame& row : sequence.frames) {
    if (row.camera != static_cast<int>(index) || !row.fluoroscopy_on()) continue;
    if (++asked > kImagesAsked) break;
    ImageFrame frame = image_frame_of(sequence, row);
    cover.cover(frame);
    measurement.exposure = frame.exposure;
    door.take(frame, measurement);
    if (door.averaging().any()) averaging = {door.averaging().of_before(), door.averaging_gives_way()};
  }
  return averaging;
}

}  // namespace

std::vector<RecordingFinding> check_averaging(const Sequence& sequence) {
  std::vector<RecordingFinding> findings;
  for (std::size_t i = 0; i < sequence.room.cameras.size(); ++i) {
    const Averaging averaging = averaged(sequence, i);
    if (averaging.share == 0) continue;
    const CameraCalibration& camera = sequence.room.cameras[i];
    const bool is_undone = camera.time_averaging == TimeAveraging::kUndo;
    findings.push_back(
        {"averaging", is_undone ? RecordingFinding::Verdict::kFine : RecordingFinding::Verdict::kWrong,
         text_of("%.0f %% of each image of \"%s\" are of those before%s%s", 100 * averaging.share,
                 camera.name.c_str(), averaging.gives_way ? ", less where something moves" : "",
                 is_undone ? ", which is undone" : ": what moves lags"),
         is_undone ? "" : "time_averaging = \"undo\" in [[camera]], or less at the console"});
  }
  return findings;
}

}  // namespace tubed
