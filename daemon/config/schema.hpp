// Every table of the configuration file with its keys. The keys themselves are described beside the structs
// that they set (idl/settings/bound_key.hpp), those of a driver in the driver.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/driver_registry/driver_registry.hpp"
#include "idl/settings/key_description.hpp"

namespace tubed {

enum class TableShape {
  kOne,   ///< [name]
  kMany,  ///< [[name]], any number of times
};

struct TableDescription {
  std::string name{};  ///< of this level only: "coil" of [[instrument.coil]]
  TableShape shape = TableShape::kOne;
  std::size_t minimum_count = 0;  ///< of kMany; of kOne: 1 = has to be there
  std::size_t maximum_count = 1;
  std::string meaning{};
  std::vector<KeyDescription> keys{};
  std::vector<TableDescription> tables{};
  bool only_when_used =
      false;  ///< required keys may be missing (a driver's table without a source that uses it)
  bool is_alternative = false;  ///< replaces keys beside it, or most do without: the sample file shows it as
                                ///< a comment
};

/// The file as a whole: a table without a name. The tables of `available` drivers are part of it.
TableDescription configuration_schema(const std::vector<DriverDescription>& available);

/// The path as it stands in a header: camera[1].coil becomes camera.coil.
std::string header_path(std::string_view path);

/// Does a change of this key take effect without a restart? `path` as changed_keys() has it:
/// "daemon.log_level", "camera[1].fx"; false for a key that is not described.
bool takes_effect_at_once(const TableDescription& file, std::string_view path);

}  // namespace tubed
