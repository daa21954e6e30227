#include "drivers/replay/sequence_writer.hpp"

#include <toml++/toml.h>

#include <array>
#include <charconv>
#include <stdexcept>
#include <utility>

#include "drivers/replay/room_tables.hpp"

namespace tubed {

namespace {

/// Shortest text that reads back as the same number.
std::string exact(double value) {
  std::array<char, 32> text{};
  const auto written = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), written.ptr};
}

toml::table description_of(const std::string& note, const RoomDescription& room) {
  const InstrumentDescription& instrument = room.instruments.front();
  toml::array offsets_mm;
  for (const CoilPlacement& coil : instrument.coils) offsets_mm.push_back(coil.offset_from_tip_mm);
  toml::array cameras;
  for (const CameraCalibration& camera : room.cameras) cameras.push_back(table_of(camera));
  toml::table catheter{{"id", instrument.id},
                       {"diameter_mm", instrument.diameter_mm},
                       {"length_mm", instrument.length_mm},
                       {"sensor_offsets_from_tip_mm", std::move(offsets_mm)}};
  if (!instrument.marks_mm.empty()) {
    toml::array marks_mm;
    for (const double mark_mm : instrument.marks_mm) marks_mm.push_back(mark_mm);
    catheter.insert("marks_mm", std::move(marks_mm));
    catheter.insert("mark_length_mm", instrument.mark_length_mm);
  }
  return toml::table{{"format", 1},
                     {"note", note},
                     {"catheter", std::move(catheter)},
                     {"registration", toml::table{{"T_world_em", rows_of(room.T_world_em)}}},
                     {"camera", std::move(cameras)}};
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

[[noreturn]] void say_incomplete(const std::filesystem::path& file) {
  throw SequenceError({file}, "was not written completely; is the disk full?");
}

void flush_checked(std::ofstream& stream, const std::filesystem::path& file) {
  if (stream.is_open() && !stream.flush()) say_incomplete(file);
}

std::string image_file(std::uint32_t frame, int camera) {
  return "images/" + std::to_string(camera) + "-" + std::to_string(frame) + ".png";
}

void close_checked(std::ofstream& stream, const std::filesystem::path& file) {
  if (!stream.is_open()) {
    return;
  }
  stream.close();
  if (!stream) say_incomplete(file);
}

std::string vector_fields(const Eigen::Vector3d& v) {
  return v.allFinite() ? exact(v.x()) + "," + exact(v.y()) + "," + exact(v.z()) : ",,";
}

/// The whole rotation where the tracker gave one, else the shortest one that turns +z onto the tangent.
Eigen::Quaterniond rotation_of(const CoilSample& coil) {
  constexpr double kMinSine = 0.2;
  if (!(coil.tangent_em.cross(coil.x_axis_em).norm() > kMinSine)) {  // true for NaN
    return rotation_from_z_to(coil.tangent_em);
  }
  Eigen::Matrix3d axes;
  const Eigen::Vector3d y = coil.tangent_em.cross(coil.x_axis_em).normalized();
  axes << y.cross(coil.tangent_em), y, coil.tangent_em;
  return Eigen::Quaterniond(axes).normalized();
}

std::string quaternion_fields(const CoilSample& coil) {
  if (!coil.tangent_em.allFinite()) {
    return ",,,";
  }
  const Eigen::Quaterniond q = rotation_of(coil);
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
  description << description_of(note, room) << '\n';
  for (const CameraCalibration& camera : room.cameras) {
    cameras_.push_back(camera.name);
  }
  close_checked(description, folder / "sequence.toml");
  frames_ = open_for_writing(folder / "frames.csv");
  frames_ << "frame,t_s,camera,file\n";
  measurements_ = open_for_writing(folder / "em.csv");
  measurements_ << "t_s,em_frame,sensor,status,x,y,z,tx,ty,tz,qw,qx,qy,qz,error\n";
}

void SequenceWriter::add_exposure(std::uint32_t frame, double t_s, int camera, const GreyImage& image) {
  const std::string file = image_file(frame, camera);
  write_image(folder_ / file, image);
  add_frame_row(frame, t_s, camera, file);
}

void SequenceWriter::add_encoded_exposure(std::uint32_t frame, double t_s, int camera,
                                          std::span<const std::uint8_t> png) {
  const std::string file = image_file(frame, camera);
  std::ofstream stream = open_for_writing(folder_ / file);
  stream.write(reinterpret_cast<const char*>(png.data()), static_cast<std::streamsize>(png.size()));
  close_checked(stream, folder_ / file);
  add_frame_row(frame, t_s, camera, file);
}

void SequenceWriter::add_instant_without_fluoroscopy(std::uint32_t frame, double t_s, int camera) {
  add_frame_row(frame, t_s, camera, "");
}

void SequenceWriter::add_frame_row(std::uint32_t frame, double t_s, int camera, const std::string& file) {
  frames_ << frame << ',' << exact(t_s) << ',' << cameras_.at(static_cast<std::size_t>(camera)) << ',' << file
          << '\n';
}

void SequenceWriter::add_geometry(std::uint32_t frame, const ViewGeometry& geometry) {
  if (!geometry_.is_open()) {
    geometry_ = open_for_writing(folder_ / "geometry.csv");
    geometry_ << "frame,fx,fy,cx,cy,qw,qx,qy,qz,x,y,z,"
                 "sigma_rx,sigma_ry,sigma_rz,sigma_x,sigma_y,sigma_z,pivot_depth\n";
  }
  geometry_ << frame;
  const auto add = [this](const auto& values) {
    for (const double value : values) geometry_ << ',' << exact(value);
  };
  add(std::array{geometry.fx, geometry.fy, geometry.cx, geometry.cy});
  add(geometry.q_camera_world);
  add(geometry.t_camera_world_mm);
  add(geometry.sigma.rotation_rad);
  add(geometry.sigma.translation_mm);
  add(std::array{geometry.sigma.pivot_depth_mm});
  geometry_ << '\n';
}

void SequenceWriter::add_measurement(const SequenceMeasurement& measurement) {
  for (int i = 0; i < measurement.coil_count; ++i) {
    const CoilSample& coil = measurement.coils[static_cast<std::size_t>(i)];
    measurements_ << exact(measurement.t_s) << ',' << measurement.em_frame << ',' << i + 1 << ','
                  << status_word(coil.status) << ',' << vector_fields(coil.p_em_mm) << ','
                  << vector_fields(coil.tangent_em) << ',' << quaternion_fields(coil) << ','
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

void SequenceWriter::flush() {
  flush_checked(frames_, folder_ / "frames.csv");
  flush_checked(measurements_, folder_ / "em.csv");
  flush_checked(geometry_, folder_ / "geometry.csv");
  flush_checked(truth_, folder_ / "truth.csv");
}

void SequenceWriter::finish() {
  close_checked(frames_, folder_ / "frames.csv");
  close_checked(measurements_, folder_ / "em.csv");
  close_checked(geometry_, folder_ / "geometry.csv");
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
    if (frame.geometry) {
      writer.add_geometry(frame.frame, *frame.geometry);
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
