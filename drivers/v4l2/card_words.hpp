// What is wrong with a card, and what to do: sentences without an allocation.
#pragma once

#include <string_view>

#include "drivers/interface/bounded_text.hpp"
#include "drivers/v4l2/picture_shape.hpp"

namespace tubed {

using CardWords = BoundedText<255>;

/// "/dev/video0 is used by another program: close it": what `error` (errno) of opening it, or of the call
/// that `doing` names ("setting its format"), means.
CardWords describe_card_error(std::string_view path, std::string_view doing, int error) noexcept;

/// "1920 x 1080"
CardWords describe(PictureSize size) noexcept;

}  // namespace tubed
