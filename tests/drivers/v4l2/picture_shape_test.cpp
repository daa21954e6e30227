// The camera of a delivered picture sees a point where the picture shows it.
#include "drivers/v4l2/picture_shape.hpp"

#include <gtest/gtest.h>

#include "idl/geometry/image_mask.hpp"
#include "tests/drivers/v4l2/picture_bench.hpp"

namespace tubed {
namespace {

CameraCalibration card_camera(PictureSize size) {
  CameraCalibration camera{.name = "A", .width = size.width, .height = size.height};
  camera.fx = 1100;
  camera.fy = 1200;
  camera.cx = size.width / 2.0 + 3.25;
  camera.cy = size.height / 2.0 - 7.5;
  camera.distortion = {0.2, -0.1, 0.013, -0.021, 0.05};
  camera.T_camera_world =
      Eigen::Translation3d(5, -8, 900) * Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized());
  return camera;
}

/// Where a point of the card's picture, its flip undone, stands in the delivered picture; written down apart
/// from the code under test, for coordinates instead of pixels.
Eigen::Vector2d delivered_point(Eigen::Vector2d p, const PictureShape& shape, PictureSize card) {
  const int d = shape.decimation;
  const PictureArea crop = crop_of(shape, card);
  const double width = crop.width / d;
  const double height = crop.height / d;
  p = {flips_x(shape.flip) ? card.width - 1 - p.x() : p.x(),
       flips_y(shape.flip) ? card.height - 1 - p.y() : p.y()};
  p = {(p.x() - crop.x + 0.5) / d - 0.5, (p.y() - crop.y + 0.5) / d - 0.5};
  p = {flips_x(shape.flip) ? width - 1 - p.x() : p.x(), flips_y(shape.flip) ? height - 1 - p.y() : p.y()};
  switch (shape.rotation) {
    case Rotation::k0:
      return p;
    case Rotation::k90:
      return {height - 1 - p.y(), p.x()};
    case Rotation::k180:
      return {width - 1 - p.x(), height - 1 - p.y()};
    case Rotation::k270:
      break;
  }
  return {p.y(), width - 1 - p.x()};
}

TEST(PictureShape, TheCameraFollowsWhatIsCutDecimatedFlippedAndRotated) {
  EXPECT_TRUE(rc::check([] {
    const PictureSize card{*rc::gen::inRange(64, 400), *rc::gen::inRange(64, 400)};
    const PictureShape shape = any_shape(card);
    const CameraCalibration whole = card_camera(card);
    const Eigen::Vector3d point(*rc::gen::inRange(-100, 100), *rc::gen::inRange(-100, 100),
                                *rc::gen::inRange(-50, 50));

    const CameraCalibration camera = delivered_camera(shape, whole);

    const auto before = Camera(whole).project(point);
    const auto after = Camera(camera).project(point);
    RC_ASSERT(before && after);
    RC_ASSERT((after->p_image_px - delivered_point(before->p_image_px, shape, card)).norm() < 1e-9);
    RC_ASSERT((PictureSize{camera.width, camera.height} == delivered_size(shape, card)));
    RC_ASSERT(std::abs(camera.T_camera_world.linear().determinant() - 1) < 1e-12);
  }));
}

// Pixel by pixel of the card's picture: what it becomes part of is masked when it is.
TEST(PictureShape, MasksFollowWithThePixelsThatTheyCover) {
  EXPECT_TRUE(rc::check([] {
    const PictureSize card{*rc::gen::inRange(4, 40), *rc::gen::inRange(4, 40)};
    const PictureShape shape = any_shape(card);
    CameraCalibration whole = card_camera(card);
    const int x = *rc::gen::inRange(0, card.width);
    const int y = *rc::gen::inRange(0, card.height);
    const ImageMask mask{x, y, *rc::gen::inRange(1, card.width - x + 1),
                         *rc::gen::inRange(1, card.height - y + 1)};
    whole.masks = {mask.x, mask.y, mask.width, mask.height};

    const CameraCalibration camera = delivered_camera(shape, whole);

    // Where one field is used a pixel may be the mean of those above and below.
    const int filled = shape.fields == FieldUse::kBoth ? 0 : 1;
    const auto is_touched = [&](int column, int row) {
      return mask.contains(column, row) || mask.contains(column, row - filled) ||
             mask.contains(column, row + filled);
    };
    const PictureArea crop = crop_of(shape, card);
    const PictureSize size{crop.width / shape.decimation, crop.height / shape.decimation};
    const PicturePlaces places = places_of(shape, size);
    for (int row = 0; row < size.height; ++row) {
      for (int column = 0; column < size.width; ++column) {
        bool has_masked = false;
        for (int k = 0; k < shape.decimation * shape.decimation; ++k) {
          has_masked = has_masked || is_touched(crop.x + column * shape.decimation + k % shape.decimation,
                                                crop.y + row * shape.decimation + k / shape.decimation);
        }
        const long place = places.origin + column * places.step_x + row * places.step_y;
        RC_ASSERT(is_masked(camera, Eigen::Vector2d(static_cast<double>(place % camera.width),
                                                    static_cast<double>(place / camera.width))) ==
                  has_masked);
      }
    }
  }));
}

TEST(PictureShape, EveryPixelOfTheDeliveredPictureIsWrittenOnce) {
  EXPECT_TRUE(rc::check([] {
    const PictureSize card{*rc::gen::inRange(1, 30), *rc::gen::inRange(1, 30)};
    const PictureShape shape = any_shape(card);
    const PictureArea crop = crop_of(shape, card);
    const PictureSize size{crop.width / shape.decimation, crop.height / shape.decimation};
    const PicturePlaces places = places_of(shape, size);
    std::vector<int> written(static_cast<std::size_t>(size.width * size.height));

    for (int y = 0; y < size.height; ++y) {
      for (int x = 0; x < size.width; ++x) {
        ++written.at(static_cast<std::size_t>(places.origin + x * places.step_x + y * places.step_y));
      }
    }

    RC_ASSERT(std::all_of(written.begin(), written.end(), [](int times) { return times == 1; }));
  }));
}

TEST(PictureShape, AnAskedSizeGivesTheDeliveredOne) {
  const PictureShape shape{.decimation = 3, .rotation = Rotation::k90};

  EXPECT_EQ(card_size_for(shape, {200, 300}), (PictureSize{900, 600}));
  EXPECT_EQ(delivered_size(shape, {900, 600}), (PictureSize{200, 300}));
  EXPECT_EQ(delivered_size(shape, {902, 601}), (PictureSize{200, 300}));
}

TEST(PictureShape, ACropBeyondThePictureDeliversNothing) {
  EXPECT_EQ(delivered_size({.crop = {0, 0, 2'147'483'647, 10}}, {640, 480}), PictureSize{});
  EXPECT_EQ(delivered_size({.crop = {2'147'483'647, 0, 2'147'483'647, 10}}, {640, 480}), PictureSize{});
  EXPECT_EQ(delivered_size({.crop = {-1, 0, 10, 10}}, {640, 480}), PictureSize{});
  EXPECT_EQ(delivered_size({.crop = {0, 0, 3, 10}, .decimation = 4}, {640, 480}), PictureSize{});
}

}  // namespace
}  // namespace tubed
