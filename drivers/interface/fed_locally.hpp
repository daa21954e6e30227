// A source whose device is a program.
#pragma once

namespace tubed {

/// Beside EmSource or ImageSource, for a source that a program of this machine feeds. Asking whether it is
/// there costs next to nothing, so that its back-off does not grow: whatever had its place, it is used again
/// soon.
class IsFedLocally {
 public:
  virtual ~IsFedLocally() = default;
};

}  // namespace tubed
