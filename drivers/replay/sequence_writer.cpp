#include "drivers/replay/sequence_writer.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <stdexcept>

namespace tubed {

namespace {

/// Shortest text that reads back as the same number.
std::string exact(double value) {
  std::array<char, 32> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), written.ptr};
}

/// As a TOML float, which needs a dot or an exponent.
std::string toml_float(double value) {
  const std::string text = exact(value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string toml_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char character : text) {
    if (character == '"' || character == '\\') {
      quoted += '\\';
    }
    quoted += static_cast<unsigned char>(character) < 0x20 ? ' ' : character;
  }
  return quoted + "\"";
}

std::string toml_matrix(const RigidTransform& transform) {
  std::string text = "[";
  for (int row = 0; row < 4; ++row) {
    text += row == 0 ? "[" : ", [";
    for (int column = 0; column < 4; ++column) {
      text += (column == 0 ? "" : ", ") + toml_float(transform.matrix()(row, column));
    }
    text += "]";
  }
  return text + "]";
}

template <typename Range, typename Words>
std::string toml_list(const Range& range, const Words& words) {
  std::string text = "[";
  for (const auto& entry : range) {
    text += (text.size() == 1 ? "" : ", ") + words(entry);
  }
  return text + "]";
}

std::string catheter_table(const InstrumentDescription& instrument) {
  return "\n[catheter]\nid = " + toml_text(instrument.id) +
         "\ndiameter_mm = " + toml_float(instrument.diameter_mm) +
         "\nlength_mm = " + toml_float(instrument.length_mm) + "\nsensor_offsets_from_tip_mm = " +
         toml_list(instrument.coils,
                   [](const CoilPlacement& coil) { return toml_float(coil.offset_from_tip_mm); }) +
         "\n";
}

std::string camera_table(const CameraCalibration& camera) {
  return "\n[[camera]]\nname = " + toml_text(camera.name) + "\nwidth = " + std::to_string(camera.width) +
         "\nheight = " + std::to_string(camera.height) + "\nfx = " + toml_float(camera.fx) +
         "\nfy = " + toml_float(camera.fy) + "\ncx = " + toml_float(camera.cx) +
         "\ncy = " + toml_float(camera.cy) + "\ndistortion = " + toml_list(camera.distortion, toml_float) +
         "\nT_camera_world = " + toml_matrix(camera.T_camera_world) + "\n";
}

void check_room(const RoomDescription& room) {
  if (room.instruments.size() != 1) {
    throw std::logic_error("a sequence folder holds exactly one instrument");
  }
  int sensor = 1;
  for (const CoilPlacement& coil : room.instruments.front().coils) {
    if (coil.sensor != sensor++ || coil.flipped) {
      throw std::logic_error(
          "coils of a sequence folder are sensors 1, 2, 3, ... from the tip, none flipped");
    }
  }
}

std::ofstream open_for_writing(const std::filesystem::path& file) {
  std::ofstream stream(file, std::ios::binary | std::ios::trunc);
  if (!stream) {
    throw SequenceError({file}, "cannot be created; check the folder's permissions");
  }
  return stream;
}

void close_checked(std::ofstream& stream, const std::filesystem::path& file) {
  if (!stream.is_open()) {
    return;
  }
  stream.close();
  if (!stream) {
    throw SequenceError({file}, "was not written completely; is the disk full?");
  }
}

std::string vector_fields(const Eigen::Vector3d& v) {
  return v.allFinite() ? exact(v.x()) + "," + exact(v.y()) + "," + exact(v.z()) : ",,";
}

std::string quaternion_fields(const Eigen::Vector3d& tangent) {
  if (!tangent.allFinite()) {
    return ",,,";
  }
  const auto q = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), tangent);
  return exact(q.w()) + "," + exact(q.x()) + "," + exact(q.y()) + "," + exact(q.z());
}

}  // namespace

SequenceWriter::SequenceWriter(const std::filesystem::path& folder, const std::string& note,
                               const RoomDescription& room)
    : folder_(folder) {
  check_room(room);
  std::error_code error;
  std::filesystem::create_directories(folder / "images", error);
  if (error) {
    throw SequenceError({folder}, "cannot be created: " + error.message());
  }
  std::ofstream description = open_for_writing(folder / "sequence.toml");
  description << "format = 1\nnote = " << toml_text(note) << "\n"
              << catheter_table(room.instruments.front())
              << "\n[registration]\nT_world_em = " << toml_matrix(room.T_world_em) << "\n";
  for (const CameraCalibration& camera : room.cameras) {
    description << camera_table(camera);
    cameras_.push_back(camera.name);
  }
  close_checked(description, folder / "sequence.toml");
  frames_ = open_for_writing(folder / "frames.csv");
  frames_ << "frame,t_s,camera,file\n";
  measurements_ = open_for_writing(folder / "em.csv");
  measurements_ << "t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n";
}

void SequenceWriter::add_exposure(std::uint32_t frame, double t_s, int camera, const GreyImage& image) {
  const std::string file = "images/" + std::to_string(camera) + "-" + std::to_string(frame) + ".png";
  write_image(folder_ / file, image);
  add_frame_row(frame, t_s, camera, file);
}

void SequenceWriter::add_instant_without_fluoroscopy(std::uint32_t frame, double t_s, int camera) {
  add_frame_row(frame, t_s, camera, "");
}

void SequenceWriter::add_frame_row(std::uint32_t frame, double t_s, int camera, const std::string& file) {
  frames_ << frame << ',' << exact(t_s) << ',' << cameras_.at(static_cast<std::size_t>(camera)) << ',' << file
          << '\n';
}

void SequenceWriter::add_measurement(const SequenceMeasurement& measurement) {
  for (int i = 0; i < measurement.coil_count; ++i) {
    const CoilSample& coil = measurement.coils[static_cast<std::size_t>(i)];
    measurements_ << exact(measurement.t_s) << ',' << measurement.em_frame << ',' << i + 1 << ','
                  << status_word(coil.status) << ',' << vector_fields(coil.p_em_mm) << ','
                  << vector_fields(coil.tangent_em) << ',' << quaternion_fields(coil.tangent_em) << ','
                  << exact(coil.indicator) << '\n';
  }
}

void SequenceWriter::add_truth(const SequenceTruth& truth) {
  if (!truth_.is_open()) {
    truth_ = open_for_writing(folder_ / "truth.csv");
    truth_ << "frame,s_mm,x,y,z\n";
  }
  for (Eigen::Index s = 0; s < truth.points_world_mm.cols(); ++s) {
    truth_ << truth.frame << ',' << s << ',' << vector_fields(truth.points_world_mm.col(s)) << '\n';
  }
}

void SequenceWriter::finish() {
  close_checked(frames_, folder_ / "frames.csv");
  close_checked(measurements_, folder_ / "em.csv");
  close_checked(truth_, folder_ / "truth.csv");
}

void write_sequence(const std::filesystem::path& folder, const Sequence& sequence,
                    const std::vector<GreyImage>& images) {
  SequenceWriter writer(folder, sequence.note, sequence.room);
  std::size_t next_image = 0;
  for (const SequenceFrame& frame : sequence.frames) {
    if (frame.fluoroscopy_on()) {
      writer.add_exposure(frame.frame, frame.t_s, frame.camera, images.at(next_image++));
    } else {
      writer.add_instant_without_fluoroscopy(frame.frame, frame.t_s, frame.camera);
    }
  }
  for (const SequenceMeasurement& measurement : sequence.measurements) {
    writer.add_measurement(measurement);
  }
  for (const SequenceTruth& truth : sequence.truth) {
    writer.add_truth(truth);
  }
  writer.finish();
}

}  // namespace tubed
