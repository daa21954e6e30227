#include "clients/calibration/marker_pairs.hpp"

#include <algorithm>

#include "idl/printable_text.hpp"

namespace tubed {

namespace {

constexpr std::size_t kMinMarkers = 3;
constexpr std::size_t kMaxMarkers = 1000;  // nobody touches as many; which are exchanged is asked of each
constexpr double kSame_mm = 1e-6;

std::vector<std::string> names_of(const std::vector<Marker>& markers) {
  std::vector<std::string> names;
  for (const Marker& marker : markers) names.push_back(marker.name);
  return names;
}

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

const Marker* find(const std::vector<Marker>& markers, const std::string& name) {
  const auto found =
      std::find_if(markers.begin(), markers.end(), [&](const Marker& marker) { return marker.name == name; });
  return found == markers.end() ? nullptr : &*found;
}

std::vector<std::string> not_in(const std::vector<std::string>& names,
                                const std::vector<std::string>& others) {
  std::vector<std::string> missing;
  std::copy_if(names.begin(), names.end(), std::back_inserter(missing),
               [&](const std::string& name) { return !contains(others, name); });
  return missing;
}

/// The touched markers under the world's names.
std::vector<Marker> named_by_order(const MarkerFile& world, const MarkerFile& touched) {
  if (world.markers.size() != touched.markers.size()) {
    throw MarkerFileError(touched.name + " has " + std::to_string(touched.markers.size()) + " markers, " +
                          world.name + " " + std::to_string(world.markers.size()) +
                          ": by order both need as many; name them alike instead");
  }
  std::vector<Marker> named = touched.markers;
  for (std::size_t i = 0; i < named.size(); ++i) named[i].name = world.markers[i].name;
  return named;
}

void refuse_unmatched(const MarkerFile& world, const MarkerFile& touched, std::size_t in_common) {
  if (in_common < kMinMarkers && std::min(world.markers.size(), touched.markers.size()) >= kMinMarkers) {
    throw MarkerFileError("the names do not match: " + world.name + " has " +
                          list_of(names_of(world.markers)) + ", " + touched.name + " has " +
                          list_of(names_of(touched.markers)) +
                          "; name them alike, or pair them in the order of the files with --by-order");
  }
}

void refuse_too_many(const MarkerFile& file) {
  if (file.markers.size() > kMaxMarkers) {
    throw MarkerFileError(file.name + " has " + std::to_string(file.markers.size()) + " markers, expected " +
                          std::to_string(kMaxMarkers) + " at most: is it a surface or a path?");
  }
}

/// Also where one of them was turned from LPS to RAS. A tracker never has the world's numbers.
void refuse_same_places(const MarkerFile& world, const MarkerFile& touched, const MarkerPairs& pairs) {
  if (pairs.size() >= kMinMarkers &&
      (pairs.p_em_mm.cwiseAbs() - pairs.p_world_mm.cwiseAbs()).cwiseAbs().maxCoeff() < kSame_mm) {
    throw MarkerFileError(touched.name + " has the places of " + world.name +
                          ": expected where a probe touched them, in the tracker's frame");
  }
}

}  // namespace

MarkerPairs MarkerPairs::without(std::size_t index) const {
  MarkerPairs others;
  others.p_world_mm.resize(3, p_world_mm.cols() - 1);
  others.p_em_mm.resize(3, p_em_mm.cols() - 1);
  for (std::size_t i = 0; i < size(); ++i) {
    if (i == index) continue;
    const auto column = static_cast<Eigen::Index>(others.names.size());
    others.p_world_mm.col(column) = p_world_mm.col(static_cast<Eigen::Index>(i));
    others.p_em_mm.col(column) = p_em_mm.col(static_cast<Eigen::Index>(i));
    others.names.push_back(names[i]);
  }
  return others;
}

PairedMarkers pair_markers(const MarkerFile& world, const MarkerFile& touched, Correspondence correspondence,
                           const std::vector<std::string>& excluded) {
  refuse_too_many(world);
  refuse_too_many(touched);
  const std::vector<Marker> named =
      correspondence == Correspondence::kByOrder ? named_by_order(world, touched) : touched.markers;
  const std::vector<std::string> world_names = names_of(world.markers);
  const std::vector<std::string> touched_names = names_of(named);
  const auto unknown = not_in(excluded, world_names);
  if (!unknown.empty()) {
    throw MarkerFileError("--exclude " + printable_text(unknown.front()) + ": " + world.name +
                          " has no such marker; it has " + list_of(world_names));
  }
  PairedMarkers paired;
  std::vector<Eigen::Vector3d> p_em_mm;
  std::vector<Eigen::Vector3d> p_world_mm;
  std::size_t in_common = 0;
  for (const Marker& marker : world.markers) {
    const Marker* const partner = find(named, marker.name);
    in_common += partner == nullptr ? 0 : 1;
    if (partner == nullptr || contains(excluded, marker.name)) continue;
    paired.pairs.names.push_back(marker.name);
    p_world_mm.push_back(marker.p_mm);
    p_em_mm.push_back(partner->p_mm);
  }
  refuse_unmatched(world, touched, in_common);
  paired.pairs.p_world_mm.resize(3, static_cast<Eigen::Index>(p_world_mm.size()));
  paired.pairs.p_em_mm.resize(3, static_cast<Eigen::Index>(p_em_mm.size()));
  for (std::size_t i = 0; i < p_em_mm.size(); ++i) {
    paired.pairs.p_world_mm.col(static_cast<Eigen::Index>(i)) = p_world_mm[i];
    paired.pairs.p_em_mm.col(static_cast<Eigen::Index>(i)) = p_em_mm[i];
  }
  refuse_same_places(world, touched, paired.pairs);
  const auto remark = [&](const char* words, const std::vector<std::string>& names) {
    if (!names.empty()) paired.remarks.push_back(words + list_of(names));
  };
  remark("left out as asked: ", excluded);
  remark("not touched: ", not_in(world_names, touched_names));
  remark("touched, but not among the markers of the world: ", not_in(touched_names, world_names));
  return paired;
}

}  // namespace tubed
