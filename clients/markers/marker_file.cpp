#include "clients/markers/marker_file.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iomanip>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <utility>

#include "drivers/csv/csv_reader.hpp"
#include "idl/printable_text.hpp"

namespace tubed {

namespace {

using nlohmann::json;

constexpr double kMaxPlace = 1e7;  // a room in micrometres

/// Where a marker stands in its file: "FILE:LINE:COLUMN" or "FILE: /markups/0/controlPoints/2".
struct PlacedMarker {
  Marker marker;
  std::string place;
};

std::string shown(std::string_view text) { return '"' + printable_text(text) + '"'; }

[[noreturn]] void refuse(const std::string& place, const std::string& words) {
  throw MarkerFileError(place + ": " + words);
}

std::vector<Marker> checked(const std::string& file, const std::vector<PlacedMarker>& placed) {
  if (placed.empty()) {
    refuse(file, "there is no marker in it; expected one a line or control point, three at least");
  }
  std::map<std::string, std::string> seen;
  std::vector<Marker> markers;
  for (const auto& [marker, place] : placed) {
    if (marker.name.empty()) refuse(place, "the marker has no name; give each one its own");
    if (!marker.p_mm.allFinite()) refuse(place, "the position of " + shown(marker.name) + " is not finite");
    if (marker.p_mm.cwiseAbs().maxCoeff() > kMaxPlace) {
      refuse(place, "the position of " + shown(marker.name) + " is more than 10 km away; expected mm");
    }
    const auto [first, is_new] = seen.emplace(marker.name, place);
    if (!is_new) {
      refuse(place, "the name " + shown(marker.name) + " is there twice, first at " + first->second +
                        "; give each marker its own name");
    }
    markers.push_back(marker);
  }
  return markers;
}

std::string place_of(const SequencePosition& position) {
  return position.file.string() + ":" + std::to_string(position.line) + ":" + std::to_string(position.column);
}

std::vector<PlacedMarker> read_csv(const std::filesystem::path& file) {
  std::vector<PlacedMarker> markers;
  CsvReader csv(file, {"name", "x", "y", "z"});
  while (csv.next_row()) {
    markers.push_back({{std::string(csv.text(0)), {csv.number(1), csv.number(2), csv.number(3)}},
                       place_of(csv.position(0))});
  }
  return markers;
}

// --- 3D Slicer's markups, https://slicer.readthedocs.io, "Markups json file format"

MarkerAxes axes_of_word(const std::string& place, const std::string& word) {
  if (word == "LPS" || word == "1") return MarkerAxes::kLps;
  if (word == "RAS" || word == "0") return MarkerAxes::kRas;
  refuse(place, "the coordinate system is " + shown(word) +
                    "; expected LPS or RAS: save the markups from Slicer once more, in one of these");
}

std::string text_of(const json& object, const char* key) {
  const auto found = object.find(key);
  return found != object.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::optional<PlacedMarker> control_point(const json& point, const std::string& place) {
  const std::string status = text_of(point, "positionStatus");
  if (status == "undefined" || status == "missing") {
    return std::nullopt;  // a point that was planned and not placed
  }
  const std::string label = text_of(point, "label");
  PlacedMarker placed{{label.empty() ? text_of(point, "id") : label, {}}, place};
  const auto position = point.find("position");
  if (position == point.end() || !position->is_array() || position->size() != 3 ||
      !std::all_of(position->begin(), position->end(), [](const json& one) { return one.is_number(); })) {
    refuse(place, "the control point has no position of three numbers");
  }
  for (Eigen::Index i = 0; i < 3; ++i) placed.marker.p_mm(i) = (*position)[static_cast<std::size_t>(i)];
  return placed;
}

void add_markup(const json& markup, const std::string& place, MarkerFile& result,
                std::vector<PlacedMarker>& markers) {
  const auto units = markup.find("coordinateUnits");
  if (units != markup.end() && units->is_string() && *units != "mm") {
    refuse(place, "the coordinates are in " + shown(units->get<std::string>()) + "; expected mm");
  }
  const auto system = markup.find("coordinateSystem");
  if (system == markup.end()) {
    refuse(place, "coordinateSystem is missing; expected \"LPS\" or \"RAS\"");
  }
  const MarkerAxes axes =
      axes_of_word(place, system->is_string() ? system->get<std::string>() : system->dump());
  if (!markers.empty() && axes != result.axes) {
    refuse(place, "this list is in " + std::string(name_of(axes)) + ", the one before it in " +
                      std::string(name_of(result.axes)) + "; save both in one coordinate system");
  }
  result.axes = axes;
  const auto points = markup.find("controlPoints");
  if (points == markup.end() || !points->is_array()) {
    refuse(place, "controlPoints is missing");
  }
  for (std::size_t i = 0; i < points->size(); ++i) {
    if (auto placed = control_point((*points)[i], place + "/controlPoints/" + std::to_string(i))) {
      markers.push_back(std::move(*placed));
    }
  }
}

json parsed_json(const std::string& name, const std::string& text) {
  try {
    return json::parse(text);
  } catch (const json::parse_error& error) {
    const std::size_t end = std::min(error.byte > 0 ? error.byte - 1 : 0, text.size());
    const auto line = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(end), '\n') + 1;
    const std::size_t line_start = end == 0 ? std::string::npos : text.rfind('\n', end - 1);
    const std::size_t column = line_start == std::string::npos ? end + 1 : end - line_start;
    throw MarkerFileError(name + ":" + std::to_string(line) + ":" + std::to_string(column) +
                          ": this is no JSON; was the file cut off while it was written?");
  }
}

std::vector<PlacedMarker> read_markups(const std::string& text, MarkerFile& result) {
  const json document = parsed_json(result.name, text);
  const std::string schema = text_of(document.is_object() ? document : json::object(), "@schema");
  if (!schema.empty() && schema.find("markups-schema-v1.0.") == std::string::npos) {
    refuse(result.name, "the schema is " + shown(schema) + "; expected markups-schema-v1.0.x");
  }
  const auto lists = document.is_object() ? document.find("markups") : document.end();
  if (!document.is_object() || lists == document.end() || !lists->is_array() || lists->empty()) {
    refuse(result.name,
           "there are no \"markups\" in it; expected a point list saved from Slicer as .mrk.json");
  }
  std::vector<PlacedMarker> markers;
  bool is_any = false;
  for (std::size_t i = 0; i < lists->size(); ++i) {
    const json& markup = (*lists)[i];
    if (markup.is_object() && text_of(markup, "type") == "Fiducial") {
      is_any = true;
      add_markup(markup, result.name + ": /markups/" + std::to_string(i), result, markers);
    }
  }
  if (!is_any) {
    refuse(result.name, "none of its markups is of type Fiducial, a list of points");
  }
  return markers;
}

// --- fcsv: comments, then id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID

std::vector<std::string> fields_of(std::string_view line) {
  std::vector<std::string> fields{""};
  for (const char c : line) {
    if (c == ',') {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

/// Of "# name = value" the value, where the name is this one.
std::optional<std::string> comment_value(std::string_view line, std::string_view name) {
  const std::size_t at = line.find(name);
  const std::size_t equals = line.find('=');
  if (at == std::string_view::npos || equals == std::string_view::npos || at > equals ||
      line.find_first_not_of("# \t") != at) {
    return std::nullopt;
  }
  const std::string_view value = line.substr(equals + 1);
  const std::size_t begin = value.find_first_not_of(" \t");
  return begin == std::string_view::npos
             ? std::string()
             : std::string(value.substr(begin, value.find_last_not_of(" \t\r") - begin + 1));
}

double number_of(const std::string& place, const std::string& field) {
  double value = 0;
  const char* const end = field.data() + field.size();
  const auto [stopped, error] = std::from_chars(field.data(), end, value);
  if (error != std::errc{} || stopped != end) {
    refuse(place, shown(field) + " is not a number; write it with a dot, like -12.5");
  }
  return value;
}

std::size_t column_of(const std::string& place, const std::vector<std::string>& columns, const char* name) {
  const auto found = std::find(columns.begin(), columns.end(), name);
  if (found == columns.end()) refuse(place, "the column '" + std::string(name) + "' is missing");
  return static_cast<std::size_t>(found - columns.begin());
}

PlacedMarker fcsv_marker(const std::string& place, const std::vector<std::string>& columns,
                         const std::vector<std::string>& fields) {
  const std::size_t label = column_of(place, columns, "label");
  PlacedMarker placed{{}, place};
  const std::array<const char*, 3> names{"x", "y", "z"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    const std::size_t column = column_of(place, columns, names[i]);
    if (std::max(column, label) >= fields.size()) {
      refuse(place,
             "the row has " + std::to_string(fields.size()) + " fields, too few for x, y, z and label");
    }
    placed.marker.p_mm(static_cast<Eigen::Index>(i)) = number_of(place, fields[column]);
  }
  placed.marker.name = fields[label];
  return placed;
}

std::vector<PlacedMarker> read_fcsv(const std::string& text, MarkerFile& result) {
  std::vector<std::string> columns =
      fields_of("id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID");
  std::optional<std::string> system;
  std::vector<PlacedMarker> markers;
  std::istringstream stream(text);
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    const std::string place = result.name + ":" + std::to_string(number) + ":1";
    if (line.starts_with('#')) {
      if (const auto value = comment_value(line, "CoordinateSystem")) {
        system = value;
        result.axes = axes_of_word(place, *value);
      } else if (const auto names = comment_value(line, "columns")) {
        columns = fields_of(*names);
      }
    } else if (line.find_first_not_of(" \t\r") != std::string::npos) {
      markers.push_back(fcsv_marker(place, columns, fields_of(line)));
    }
  }
  if (!system) {
    refuse(result.name + ":1:1",
           "the line \"# CoordinateSystem = LPS\" (or RAS) is missing, so that nobody knows the signs of x "
           "and y");
  }
  return markers;
}

}  // namespace

std::string_view name_of(MarkerAxes axes) {
  switch (axes) {
    case MarkerAxes::kLps:
      return "LPS";
    case MarkerAxes::kRas:
      return "RAS";
    case MarkerAxes::kAsWritten:
      return "as written";
  }
  return "";
}

MarkerFile read_markers(const std::filesystem::path& file, MarkerAxes csv_axes) {
  MarkerFile result{file.string(), csv_axes, {}};
  if (!std::filesystem::is_regular_file(file)) {
    throw MarkerFileError(result.name + ": there is no such file");
  }
  try {
    const std::string suffix = file.extension().string();
    std::vector<PlacedMarker> markers;
    if (suffix == ".json" || suffix == ".fcsv") {
      const std::string text = read_whole_file(file);
      markers = suffix == ".json" ? read_markups(text, result) : read_fcsv(text, result);
    } else {
      markers = read_csv(file);
    }
    result.markers = checked(result.name, markers);
  } catch (const SequenceError& error) {
    throw MarkerFileError(error.what());
  }
  return result;
}

MarkerFile along(MarkerFile file, MarkerAxes axes) {
  if (file.axes != axes && file.axes != MarkerAxes::kAsWritten && axes != MarkerAxes::kAsWritten) {
    for (Marker& marker : file.markers) marker.p_mm.head<2>() *= -1;
    file.axes = axes;
  }
  return file;
}

void write_markers(const std::filesystem::path& file, const std::vector<Marker>& markers) {
  std::ofstream stream(file, std::ios::trunc);
  stream << "name,x,y,z\n" << std::fixed << std::setprecision(4);
  for (const Marker& marker : markers) {
    stream << marker.name << ',' << marker.p_mm.x() << ',' << marker.p_mm.y() << ',' << marker.p_mm.z()
           << '\n';
  }
  stream.flush();
  if (!stream) {
    throw MarkerFileError(file.string() + ": cannot be written; check folder, permissions and space");
  }
}

std::string list_of(const std::vector<std::string>& names, std::size_t max_count) {
  std::string list;
  const std::size_t count = std::min(names.size(), max_count);
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_last = i + 1 == names.size();
    list += (i == 0 ? "" : is_last ? " and " : ", ") + printable_text(names[i]);
  }
  return names.size() <= max_count ? list : list + " and " + std::to_string(names.size() - count) + " more";
}

}  // namespace tubed
