// What is cut out of a card's picture, how it is turned, and how the camera follows. Pure.
#pragma once

#include <string>

#include "idl/geometry/camera.hpp"

namespace tubed {

enum class Flip { kNone, kHorizontal, kVertical, kBoth };
enum class Rotation { k0, k90, k180, k270 };  ///< clockwise, degrees

struct PictureSize {
  int width = 0;   ///< px
  int height = 0;  ///< px
  friend bool operator==(const PictureSize&, const PictureSize&) = default;
};

/// Pixels of the card's picture, counted from its upper left; width 0: all of it.
struct PictureArea {
  int x = 0, y = 0, width = 0, height = 0;
  friend bool operator==(const PictureArea&, const PictureArea&) = default;
};

/// Which rows of the card's picture are used. Its two fields are 20 or 17 ms apart where the signal is
/// interlaced: what moves between them has combs.
enum class FieldUse {
  kBoth,    ///< all rows, as they come
  kTop,     ///< rows 0, 2, 4, ...; those between are the means of their neighbours
  kBottom,  ///< rows 1, 3, 5, ...; likewise
};

/// From the card's picture to the one delivered, in this order: rows of a field that is not used are filled
/// in, the crop is cut out, each square of
/// decimation x decimation pixels becomes its mean (columns and rows that fill no square are left off at the
/// right and below), the picture is flipped, then rotated.
struct PictureShape {
  FieldUse fields = FieldUse::kBoth;
  PictureArea crop{};
  int decimation = 1;
  Flip flip = Flip::kNone;
  Rotation rotation = Rotation::k0;
};

[[nodiscard]] constexpr bool flips_x(Flip flip) { return flip == Flip::kHorizontal || flip == Flip::kBoth; }
[[nodiscard]] constexpr bool flips_y(Flip flip) { return flip == Flip::kVertical || flip == Flip::kBoth; }
[[nodiscard]] constexpr bool swaps_sides(Rotation rotation) {
  return rotation == Rotation::k90 || rotation == Rotation::k270;
}

/// The crop of a picture of size `card`: all of it when none is asked for.
[[nodiscard]] PictureArea crop_of(const PictureShape& shape, PictureSize card) noexcept;

/// Size of what is delivered; 0 x 0 when the crop reaches beyond the card's picture or is smaller than a
/// square.
[[nodiscard]] PictureSize delivered_size(const PictureShape& shape, PictureSize card) noexcept;

/// The smallest card's picture that gives `delivered` when nothing is cropped.
[[nodiscard]] PictureSize card_size_for(const PictureShape& shape, PictureSize delivered) noexcept;

/// Where a pixel stands in the delivered picture, as steps through its memory: pixel (x, y) of the cropped
/// and decimated picture goes to origin + x step_x + y step_y.
struct PicturePlaces {
  long origin = 0;
  long step_x = 1;
  long step_y = 0;
};
/// `size`: of the cropped and decimated picture, before it is turned.
[[nodiscard]] PicturePlaces places_of(const PictureShape& shape, PictureSize size) noexcept;

/// The camera of the delivered picture. `card`: the camera of the card's whole picture, in which its flip has
/// been undone (a mirrored picture has no camera whose axes are right-handed). Focal lengths, principal
/// point, distortion, size and, under a rotation, T_camera_world follow. Precondition: delivered_size() is
/// not 0 x 0. Its masks follow as well; those of `card` are, as the crop is, of the card's picture as it
/// comes.
[[nodiscard]] CameraCalibration delivered_camera(const PictureShape& shape, const CameraCalibration& card);

}  // namespace tubed
