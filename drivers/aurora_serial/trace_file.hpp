// Writes the wire trace of a session to files, where nothing may allocate.
#pragma once

#include <string>
#include <string_view>

#include "drivers/aurora/wire_trace.hpp"

namespace tubed {

/// A folder with the newest traces: PREFIX-1.log to PREFIX-8.log, the oldest being written over, and
/// PREFIX-request.log. One thread; only the constructor allocates.
class TraceFolder {
 public:
  /// `folder`: empty = no traces are written.
  TraceFolder(const std::string& folder, const std::string& prefix);

  /// Writes all of `trace`; `about` goes into the header. False: nothing or not all could be written.
  bool write(const aurora::WireTrace& trace, std::string_view about) noexcept;
  /// Whether somebody has made the file PREFIX-request since the last call (`touch`). Removes it.
  [[nodiscard]] bool asked_for() noexcept;
  /// The same as write(), into PREFIX-request.log.
  bool write_on_request(const aurora::WireTrace& trace, std::string_view about) noexcept;

 private:
  static constexpr std::size_t kFiles = 8;

  bool write_to(const std::string& file, const aurora::WireTrace& trace, std::string_view about) noexcept;

  std::string request_;
  std::string answer_;
  std::vector<std::string> files_;
  std::size_t next_ = 0;
};

}  // namespace tubed
