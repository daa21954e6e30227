// What a calibration found, as values of the configuration file: shown as a fragment of TOML, and written
// into the file when a person has accepted it.
#pragma once

#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "idl/settings/key_description.hpp"

namespace tubed {

/// One value and the key that it belongs to.
struct FoundValue {
  /// Tables and key, separated by dots; an element of a list of tables by its id or name, or by its number
  /// from 1, in brackets: "em.T_world_em", "camera[A].c_arm.zoom",
  /// "instrument[cath-1].coil[2].offset_from_tip_mm". A name is taken before a number.
  std::string path;
  SettingValue value;
};

/// All that one calibration found.
struct ConfigurationFragment {
  std::string found_by;              ///< "tubectl register, 13 markers"
  std::string date;                  ///< of the calibration, "2026-11-24 14:05"
  std::vector<std::string> remarks;  ///< a line of comment each: residual, sigma, what was left out
  std::vector<FoundValue> values;
};

/// The path, the file or its content does not allow what was asked; says where and what to do.
class FragmentError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Today and now, as ConfigurationFragment::date has it; local time.
std::string date_of_today();

/// The fragment as a TOML document of its own: comments, then each table once with its keys. An element of a
/// list is written as one, with the key that names it. Matrices take a line a row. Throws FragmentError for a
/// path that is none.
std::string to_toml(const ConfigurationFragment& fragment);

/// One value before and after.
struct ChangedValue {
  std::string path;
  std::string before;  ///< as it stands in the file; empty: it was not there
  std::string after;
  /// "[camera.c_arm]": the table that takes its place; then it is commented out, and `after` is empty.
  std::string replaced_by{};
};

/// A configuration with a fragment put in.
struct AcceptedFragment {
  std::string text;                   ///< the whole file
  std::vector<ChangedValue> changes;  ///< what differs; empty: `text` is as before
};

/// Puts the fragment's values into the text of a configuration file: a value that is there is replaced where
/// it stands, and everything else, comments too, stays as it is; one that is not goes to the end of its
/// table; a comment above says who found it and when. A camera that gets c_arm keeps what that replaces (fx,
/// fy, T_camera_world) as comments. `file` names the file in messages. Throws FragmentError for text that is
/// no TOML, for an element of a list that the file does not have (it names those there are), and for a
/// camera's pose or focal length where [camera.c_arm] makes them. Does not ask whether the result is a valid
/// configuration.
AcceptedFragment accept(std::string_view configuration, const std::string& file,
                        const ConfigurationFragment& fragment);

/// Reads `file`, puts the fragment in, and returns the result without writing it. Throws FragmentError as
/// above, for a file that cannot be read, and, with what load_configuration() says, when the result would be
/// no configuration.
AcceptedFragment accept_into(const std::filesystem::path& file, const ConfigurationFragment& fragment);

/// Replaces `file` by `text` in one step, with its permissions; what it was before is kept beside it, and the
/// name of that copy is returned. Throws FragmentError when either cannot be written; then `file` is as it
/// was.
std::filesystem::path replace_configuration(const std::filesystem::path& file, const std::string& text);

}  // namespace tubed
