// The inner loops of the Frangi filter, compiled for every instruction set and chosen when they are called.
#pragma once

#include <cstddef>
#include <cstdint>

namespace tubed {

/// One Gaussian, from its centre outwards: weights[0], then the weight of each pixel k to either side.
struct GaussianTaps {
  int reach = 0;
  const float* weights = nullptr;        ///< reach + 1, sum over all pixels 1
  const std::uint16_t* pairs = nullptr;  ///< the same in 1/65536: centre, then twice the weight of a pixel
};

/// Smooths columns [begin, end) of one row. `rows` are 2 reach + 1 padded source rows, top first, each a
/// pointer to column 0; `between` is a row of scratch with the layout of the source, `out` a padded row of
/// float. Writes up to PaddedPlane::kOverrun columns more. begin + 1 is best a multiple of 16.
struct SmoothFloatRow {
  GaussianTaps taps;
  const float* const* rows;
  float* between;
  float* out;
  int begin;
  int end;
};
void smooth_row(const SmoothFloatRow& task);

/// The same of 16-bit pixels: means of pairs of pixels times 16-bit weights, upper halves summed.
struct SmoothIntegerRow {
  GaussianTaps taps;
  const std::uint16_t* const* rows;
  std::uint16_t* between;
  float* out;
  int begin;
  int end;
};
void smooth_row(const SmoothIntegerRow& task);

/// Three neighbouring smoothed rows, each a pointer to column 0; columns begin - 1 .. end are read.
struct SmoothedRows {
  const float* above;
  const float* centre;
  const float* below;
  int begin;
  int end;
};

/// Greatest lxx^2 + lyy^2 + 2 lxy^2 of the columns [begin, end): the squared Hessian norm, not scaled.
float max_squared_norm(const SmoothedRows& rows);

/// The same of each column, where it is greater than greatest[x]. Precondition: end - begin >= 16.
void keep_max_squared_norms(const SmoothedRows& rows, float* greatest);

/// Constants of one scale's response.
struct ResponseScale {
  float sigma_px;  ///< as told in scale_px
  float variance;  ///< scales the Hessian; negative for bright ridges, over the gain for scaled pixels
  float per_blob;  ///< -1 / (2 beta^2), times log2(e)
  float per_norm;  ///< -1 / c^2, times log2(e): the norm is summed over half of it
  bool first;      ///< the maps hold nothing yet
};

/// One row of each map, pointers to column 0; the last three may be null, all together.
struct RidgeRow {
  float* vesselness;
  float* scale_px;
  float* double_angle_cos;
  float* double_angle_sin;
};

/// Puts the response of columns [begin, end) into the maps where it is greater than what they hold.
/// Precondition: end - begin >= 16. Writes no other column.
void respond(const SmoothedRows& rows, const ResponseScale& scale, const RidgeRow& maps);

/// Copies `count` pixels, shifted left by `shift` bits where they stay integers.
void convert_row(const std::uint8_t* from, int count, float* to);
void convert_row(const std::uint16_t* from, int count, float* to);
void convert_row(const float* from, int count, float* to);
void convert_row(const std::uint8_t* from, int count, int shift, std::uint16_t* to);
void convert_row(const std::uint16_t* from, int count, int shift, std::uint16_t* to);
/// Of floats that are whole numbers from 0 to 65535.
void convert_row(const float* from, int count, int shift, std::uint16_t* to);

/// The instruction set the loops above use on this machine: "AVX3", "AVX2", "SSE4", ..
const char* frangi_instruction_set();

}  // namespace tubed
