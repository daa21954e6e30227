// sequence.toml: what was tracked, with which cameras, and how they are registered.
#include <toml++/toml.h>

#include <cmath>
#include <string>

#include "drivers/interface/toml_nesting.hpp"
#include "drivers/replay/sequence_folder.hpp"
#include "idl/geometry/image_mask.hpp"

namespace tubed {

namespace {

constexpr double kRigidTolerance = 1e-6;
constexpr std::int64_t kMaxImageSide_px = 16384;

/// Typed access to the keys of one TOML table that says where a value stands when it is refused.
class TableReader {
 public:
  TableReader(const std::filesystem::path& file, const toml::table& table, std::string name)
      : file_(file), table_(table), name_(std::move(name)) {}

  [[noreturn]] void refuse(const toml::node& node, const std::string& what_is_wrong) const {
    const toml::source_position at = node.source().begin;
    throw SequenceError({file_, static_cast<int>(at.line), static_cast<int>(at.column)}, what_is_wrong);
  }

  const toml::node& node(std::string_view key) const {
    const toml::node* found = table_.get(key);
    if (found == nullptr) {
      refuse(table_, name_ + ": the key '" + std::string(key) + "' is missing");
    }
    return *found;
  }

  /// nullptr: it is not there.
  const toml::node* optional(std::string_view key) const { return table_.get(key); }

  double finite(const toml::node& value, std::string_view key) const {
    const auto number = value.value<double>();
    if (!value.is_number() || !number || !std::isfinite(*number)) {
      refuse(value, name_ + "." + std::string(key) + " has to be a finite number");
    }
    return *number;
  }

  double positive(std::string_view key) const {
    const double value = finite(node(key), key);
    if (value <= 0) {
      refuse(node(key), name_ + "." + std::string(key) + " has to be greater than 0");
    }
    return value;
  }

  double number(std::string_view key) const { return finite(node(key), key); }

  int image_side(std::string_view key) const {
    const toml::node& value = node(key);
    const auto side = value.is_integer() ? value.value<std::int64_t>().value_or(0) : 0;
    if (side < 1 || side > kMaxImageSide_px) {
      refuse(value, name_ + "." + std::string(key) + " has to be a whole number of pixels, 1 .. " +
                        std::to_string(kMaxImageSide_px));
    }
    return static_cast<int>(side);
  }

  std::string text(std::string_view key) const {
    const toml::node& value = node(key);
    if (!value.is_string() || value.as_string()->get().empty()) {
      refuse(value, name_ + "." + std::string(key) + " has to be a text in quotes, not empty");
    }
    return value.as_string()->get();
  }

  const toml::array& array(const toml::node& value, std::string_view key) const {
    if (!value.is_array()) {
      refuse(value, name_ + "." + std::string(key) + " has to be a list in square brackets");
    }
    return *value.as_array();
  }

  const toml::array& array_of(const toml::node& value, std::string_view key, std::size_t size) const {
    const toml::array& list = array(value, key);
    if (list.size() != size) {
      refuse(list, name_ + "." + std::string(key) + " has " + std::to_string(list.size()) + " entries, not " +
                       std::to_string(size));
    }
    return list;
  }

  RigidTransform rigid(std::string_view key) const {
    const toml::array& rows = array_of(node(key), key, 4);
    Eigen::Matrix4d matrix;
    for (std::size_t row = 0; row < 4; ++row) {
      const toml::array& entries = array_of(rows[row], key, 4);
      for (std::size_t column = 0; column < 4; ++column) {
        matrix(static_cast<int>(row), static_cast<int>(column)) = finite(entries[column], key);
      }
    }
    return orthonormalised(matrix, rows, key);
  }

 private:
  RigidTransform orthonormalised(const Eigen::Matrix4d& matrix, const toml::node& at,
                                 std::string_view key) const {
    const std::string what = name_ + "." + std::string(key);
    if (matrix.row(3) != Eigen::RowVector4d(0, 0, 0, 1)) {
      refuse(at, what + ": the last row has to be [0, 0, 0, 1]; are rows and columns exchanged?");
    }
    std::string why;
    const auto transform = rigid_from_matrix(matrix, kRigidTolerance, why);
    if (!transform) {
      refuse(at,
             what +
                 ": the upper left 3 x 3 block is not a rotation (R^T R = I within 1e-6, determinant +1); "
                 "write more digits or correct the axes");
    }
    return *transform;
  }

  const std::filesystem::path& file_;
  const toml::table& table_;
  std::string name_;
};

toml::table parse(const std::filesystem::path& file) {
  const std::string text = read_whole_file(file);
  if (const auto line = line_of_too_many_dots(text)) {
    throw SequenceError({file, *line, 1}, "more than " + std::to_string(kMaxTomlDots) +
                                              " dots outside comments; tables lie too deep in each other");
  }
  try {
    return toml::parse(text, file.string());
  } catch (const toml::parse_error& error) {
    const toml::source_position at = error.source().begin;
    throw SequenceError({file, static_cast<int>(at.line), static_cast<int>(at.column)},
                        std::string(error.description()));
  }
}

TableReader table_of(const TableReader& root, const std::filesystem::path& file, std::string_view key) {
  const toml::node& value = root.node(key);
  if (!value.is_table()) {
    root.refuse(value, "[" + std::string(key) + "] has to be a table");
  }
  return {file, *value.as_table(), std::string(key)};
}

void check_format(const TableReader& root) {
  const toml::node& format = root.node("format");
  if (!format.is_integer() || format.value<std::int64_t>() != 1) {
    root.refuse(format, "format is not 1; this program reads format 1 only");
  }
}

std::vector<CoilPlacement> read_coils(const TableReader& catheter) {
  const std::string_view key = "sensor_offsets_from_tip_mm";
  const toml::array& offsets = catheter.array(catheter.node(key), key);
  if (offsets.empty() || offsets.size() > static_cast<std::size_t>(kMaxTrackerCoils)) {
    catheter.refuse(offsets, "catheter." + std::string(key) + " needs 1 to " +
                                 std::to_string(kMaxTrackerCoils) + " entries");
  }
  std::vector<CoilPlacement> coils;
  for (const toml::node& entry : offsets) {
    const double offset_mm = catheter.finite(entry, key);
    if (offset_mm < 0 || (!coils.empty() && offset_mm <= coils.back().offset_from_tip_mm)) {
      catheter.refuse(entry, "catheter." + std::string(key) + " has to grow from the tip, 0 or more");
    }
    coils.push_back({static_cast<int>(coils.size()) + 1, offset_mm, false});
  }
  return coils;
}

constexpr double kMinMark_mm = 0.3;  // as instrument_keys() has them
constexpr double kMaxMark_mm = 10;

/// "marks_mm" and "mark_length_mm" as in [[instrument]] of a configuration; a sequence may have none.
void read_marks(const TableReader& catheter, InstrumentDescription& instrument) {
  constexpr std::string_view kKey = "marks_mm";
  const toml::node* const node = catheter.optional(kKey);
  if (node == nullptr) {
    return;
  }
  for (const toml::node& entry : catheter.array(*node, kKey)) {
    const double mark_mm = catheter.finite(entry, kKey);
    if (mark_mm < 0 || mark_mm > instrument.length_mm ||
        (!instrument.marks_mm.empty() && mark_mm <= instrument.marks_mm.back())) {
      catheter.refuse(entry, "catheter.marks_mm has to grow from the tip, 0 to length_mm");
    }
    instrument.marks_mm.push_back(mark_mm);
  }
  if (instrument.marks_mm.size() > kMaxMarks) {
    catheter.refuse(*node, "catheter.marks_mm has more than 16 entries");
  }
  if (catheter.optional("mark_length_mm") != nullptr) {
    instrument.mark_length_mm = catheter.positive("mark_length_mm");
  }
  if (instrument.mark_length_mm < kMinMark_mm || instrument.mark_length_mm > kMaxMark_mm) {
    catheter.refuse(catheter.node("mark_length_mm"), "catheter.mark_length_mm has to be 0.3 to 10");
  }
  for (std::size_t i = 1; i < instrument.marks_mm.size(); ++i) {
    if (instrument.marks_mm[i] < instrument.marks_mm[i - 1] + instrument.mark_length_mm) {
      catheter.refuse(*node, "catheter.marks_mm have to be at least mark_length_mm apart");
    }
  }
}

InstrumentDescription read_catheter(const TableReader& catheter) {
  InstrumentDescription instrument;
  instrument.id = catheter.text("id");
  instrument.diameter_mm = catheter.positive("diameter_mm");
  instrument.length_mm = catheter.positive("length_mm");
  instrument.coils = read_coils(catheter);
  read_marks(catheter, instrument);
  return instrument;
}

/// "masks" as in [[camera]] of a configuration; a sequence may have none.
void read_masks(const TableReader& table, CameraCalibration& camera) {
  const toml::node* const node = table.optional("masks");
  if (node == nullptr) {
    return;
  }
  constexpr std::string_view kKey = "masks";
  for (const toml::node& entry : table.array(*node, kKey)) {
    const double number = table.finite(entry, kKey);
    if (!(number >= 0 && number <= kMaxMaskPlace_px && number == std::floor(number))) {
      table.refuse(entry, "camera.masks has to be pixels: x, y, width, height of each rectangle");
    }
    camera.masks.push_back(static_cast<int>(number));
  }
  const std::string fault = fault_of_masks(camera.masks, camera.width, camera.height);
  if (!fault.empty() || camera.masks.size() > 4 * kMaxMasks) {
    table.refuse(*node, "camera.masks: " + (fault.empty() ? "too many, expected 16 at most" : fault));
  }
}

CameraCalibration read_camera(const TableReader& table) {
  CameraCalibration camera;
  camera.name = table.text("name");
  camera.width = table.image_side("width");
  camera.height = table.image_side("height");
  camera.fx = table.positive("fx");
  camera.fy = table.positive("fy");
  camera.cx = table.number("cx");
  camera.cy = table.number("cy");
  const toml::array& distortion =
      table.array_of(table.node("distortion"), "distortion", camera.distortion.size());
  for (std::size_t k = 0; k < camera.distortion.size(); ++k) {
    camera.distortion[k] = table.finite(distortion[k], "distortion");
  }
  camera.T_camera_world = table.rigid("T_camera_world");
  read_masks(table, camera);
  return camera;
}

std::vector<CameraCalibration> read_cameras(const TableReader& root, const std::filesystem::path& file) {
  const toml::array& tables = root.array(root.node("camera"), "camera");
  std::vector<CameraCalibration> cameras;
  for (const toml::node& entry : tables) {
    if (!entry.is_table()) {
      root.refuse(entry, "camera has to be a list of tables: write [[camera]]");
    }
    const TableReader table(file, *entry.as_table(), "camera");
    CameraCalibration camera = read_camera(table);
    for (const CameraCalibration& other : cameras) {
      if (other.name == camera.name) {
        table.refuse(table.node("name"), "there are two cameras named " + in_quotes(camera.name));
      }
    }
    cameras.push_back(std::move(camera));
  }
  if (cameras.empty()) {
    root.refuse(tables, "a sequence needs at least one [[camera]]");
  }
  return cameras;
}

}  // namespace

void read_sequence_description(const std::filesystem::path& file, Sequence& sequence) {
  const toml::table content = parse(file);
  const TableReader root(file, content, "sequence.toml");
  check_format(root);
  sequence.note = content["note"].value_or(std::string());
  sequence.room.instruments = {read_catheter(table_of(root, file, "catheter"))};
  sequence.room.T_world_em = table_of(root, file, "registration").rigid("T_world_em");
  sequence.room.registered = true;
  sequence.room.cameras = read_cameras(root, file);
}

}  // namespace tubed
