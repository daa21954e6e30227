// Has the view moved? A table that pans or a C-arm that turns makes every image pull the shape to a wrong
// place, confidently. Heart, breath, contrast agent and catheter move some blocks of the background; a moved
// camera moves all.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "daemon/image/background_motion.hpp"
#include "daemon/image/view_key.hpp"
#include "daemon/image/view_picture.hpp"
#include "drivers/interface/timestamps.hpp"
#include "idl/geometry/camera.hpp"

namespace tubed {

enum class ViewState {
  kUnjudged,  ///< nothing can be said: see UnjudgedView
  kStill,     ///< the view is where it was when its pose was given
  kSuspect,   ///< it may have moved
  kMoved,     ///< it has moved, and no pose said so
};

enum class UnjudgedView {
  kNone,
  kLearning,      ///< the first seconds after a pose was given: jumps are noticed, slow moves are not
  kFewBlocks,     ///< less than 40 blocks of the picture are open, or less than half of a key's
  kNoBackground,  ///< nothing in the picture comes back: a bench without a patient
  kBladesMove,    ///< the collimator's opening changes
};

/// What one image says of the view.
struct ViewVerdict {
  ViewState state = ViewState::kUnjudged;
  UnjudgedView why = UnjudgedView::kLearning;
  double still_share = 0;  ///< of the blocks, against the key that fits best, 0 .. 1
  /// The same against the image before. 1 when there is none within 150 ms, and when a key knows the image:
  /// then it is not asked.
  double jump_share = 1;
  /// So much of the background lies where it did in the image before, whenever that was, that breath may
  /// explain the rest: a view that is being learnt may be learnt from it.
  bool follows_last = true;
  /// What kind of move it was, looked at when the state became kMoved, and by ViewFollower again when the
  /// view has settled.
  BackgroundMotion motion;
  std::uint32_t moves = 0;       ///< to how many places the view has gone since it began (ViewFollower)
  bool has_settled = false;      ///< of a view that moved: it stands still where it is now (ViewFollower)
  bool is_suspect_here = false;  ///< of a view that has settled: it may have moved on (ViewFollower)
  MonotonicTime exposure{};
};

/// Millimetres in the patient that a pixel of this camera covers: at the depth of what it looks at
/// (CameraCalibration::looked_at_world_mm()). Depths outside 300 .. 1500 mm, which no C-arm has, count as
/// the nearer of the two.
double mm_per_px_in_patient(const CameraCalibration& camera);

/// Compares each image of one camera with a gallery of key images that covers a breath. One thread; memory is
/// taken in the constructor, observe() never allocates. Pure: time comes with the image.
class ViewWatch {
 public:
  static constexpr std::size_t kMaxKeys = 16;
  static constexpr std::size_t kMaxNewcomers = 4;

  /// Size of the exposures, px. `mm_per_px`: of a full pixel, where the patient is. `white_level`: grey value
  /// of a saturated pixel; 0: not known, then all ones of as many bits as the brightest pixel so far needs.
  ViewWatch(int width, int height, double mm_per_px, double white_level = 0);
  explicit ViewWatch(const CameraCalibration& camera)
      : ViewWatch(camera.width, camera.height, mm_per_px_in_patient(camera), camera.white_level) {
    learnt_from_ = geometry_of(camera);
    looked_at_world_mm_ = camera.looked_at_world_mm().value_or(Eigen::Vector3d::Zero());
  }

  /// A pose was given with the next image, or somebody says that the view is right as it is: learns anew.
  void begin(MonotonicTime now);

  /// How the next image was taken: when that shows the patient elsewhere than what has been learnt, by more
  /// than half a millimetre, the view is learnt anew.
  void look_from(const ViewGeometry& geometry, MonotonicTime now);

  /// The next image with radiation, of the size given.
  const ViewVerdict& observe(const ImageFrame& frame);

  [[nodiscard]] const ViewVerdict& newest() const { return verdict_; }
  [[nodiscard]] std::size_t key_count() const { return keys_.size(); }

  /// A key for pictures of this size.
  [[nodiscard]] ViewKey make_key() const { return {reducer_.rows(), reducer_.columns()}; }

  /// Makes the newest image that key's. Precondition, of this and of the next: there is one.
  void take_newest(ViewKey& key) const { key.take(last_picture_, last_blocks_); }

  /// Share of that key's blocks that are still where they were, in the newest image; 0 when less than half of
  /// them are open.
  [[nodiscard]] double share_still(ViewKey& key) const;

  /// How the background lies in the newest image against where the key has it that fitted best.
  BackgroundMotion motion_to_newest();

 private:
  /// A view of the background that was seen once; a key when the sequence came back from it to an older key.
  struct Newcomer {
    ViewKey key;
    MonotonicTime seen{};
    bool is_used = false;
  };
  /// Shares against all keys, the one that fitted last tried first.
  struct GalleryMatch {
    double share = 0;
    bool is_comparable = false;  ///< at least half of a key's blocks are open
  };

  [[nodiscard]] float white_level_of(const ImageFrame& frame);
  [[nodiscard]] GalleryMatch match();
  void compare_with_last(const GalleryMatch& gallery, MonotonicTime exposure);
  [[nodiscard]] bool is_doubted() const;
  [[nodiscard]] bool is_learning(MonotonicTime exposure) const;
  [[nodiscard]] UnjudgedView why_unjudged(const GalleryMatch& gallery, MonotonicTime exposure) const;
  ViewState state_after(const GalleryMatch& gallery, MonotonicTime exposure);
  [[nodiscard]] bool is_shown_again() const;
  void learn(double share, MonotonicTime exposure);
  void admit_or_forget_newcomers(double share, MonotonicTime exposure);
  void add_newcomer(MonotonicTime exposure);
  ViewKey& add_key();

  ViewReducer reducer_;
  double mm_per_reduced_px_;
  double mm_per_px_;
  ViewGeometry learnt_from_;
  Eigen::Vector3d looked_at_world_mm_{0, 0, 0};
  bool is_white_known_;
  float white_level_;  ///< grey value
  ViewPicture picture_, last_picture_;
  ViewBlocks blocks_, last_blocks_;
  BackgroundMotionFinder motion_finder_;
  ViewKey last_;                ///< of last_picture_, once it is asked
  std::vector<ViewKey> keys_;   ///< those in use
  std::vector<ViewKey> spare_;  ///< memory for the others
  std::vector<Newcomer> newcomers_;
  std::size_t best_key_ = 0;
  MonotonicTime began_{};
  MonotonicTime last_exposure_{};
  MonotonicTime good_since_{};
  bool has_begun_ = false;
  bool has_last_ = false;
  bool is_good_ = false;         ///< since good_since_
  bool has_come_back_ = false;   ///< a key was met again: there is a background
  bool has_lost_track_ = false;  ///< an image did not follow the one before, and no key was met since
  bool blades_move_ = false;
  float last_open_share_ = 1;
  int bad_in_a_row_ = 0;
  ViewState judged_ = ViewState::kUnjudged;  ///< by the newest image that could be judged
  ViewVerdict verdict_;
};

}  // namespace tubed
