// What a source that runs may have to say to a person.
#pragma once

#include <string_view>

namespace tubed {

/// Beside EmSource or ImageSource, for a source that may run and yet lack something. Called by the source's
/// own thread.
class HasRemark {
 public:
  virtual ~HasRemark() = default;
  HasRemark() = default;
  HasRemark(const HasRemark&) = delete;
  HasRemark& operator=(const HasRemark&) = delete;

  /// As "not plugged in: sensor 2"; empty mostly. Good until the source's next call of anything. Never
  /// allocates, locks, logs or throws.
  [[nodiscard]] virtual std::string_view remark() noexcept = 0;
};

}  // namespace tubed
