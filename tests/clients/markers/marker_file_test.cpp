#include "clients/markers/marker_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

namespace tubed {
namespace {

namespace fs = std::filesystem;

/// A folder of files, gone with the object.
class Files {
 public:
  Files() : folder_(fs::temp_directory_path() / ("marker-files-" + std::to_string(::getpid()))) {
    fs::create_directories(folder_);
  }
  ~Files() { fs::remove_all(folder_); }
  Files(const Files&) = delete;
  Files& operator=(const Files&) = delete;

  [[nodiscard]] fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }

 private:
  fs::path folder_;
};

const std::string kMarkups = R"({
  "@schema": "https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/Resources/Schema/markups-schema-v1.0.3.json#",
  "markups": [{
    "type": "Fiducial", "coordinateSystem": "LPS", "coordinateUnits": "mm",
    "controlPoints": [
      {"id": "1", "label": "F-1", "position": [1.5, -2, 3], "positionStatus": "defined"},
      {"id": "2", "label": "F-2", "position": [0, 0, 0], "positionStatus": "undefined"},
      {"id": "3", "label": "F-3", "position": [4, 5, 6], "positionStatus": "defined"}]
  }]
})";

std::string refusal(const fs::path& file) {
  try {
    read_markers(file);
  } catch (const MarkerFileError& error) {
    return error.what();
  }
  return "not refused";
}

TEST(MarkerFile, ACsvHasNamesAndPlacesInAnyOrderOfColumns) {
  const Files files;

  const MarkerFile read =
      read_markers(files.write("m.csv", "x,name,z,y\n1,M1,3,2\n4,M2,6,5\n"), MarkerAxes::kRas);

  ASSERT_EQ(read.markers.size(), 2);
  EXPECT_EQ(read.markers[0].name, "M1");
  EXPECT_EQ(read.markers[0].p_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(read.axes, MarkerAxes::kRas);
}

TEST(MarkerFile, MarkupsOfSlicerSayTheirAxesAndPointsThatWereNotPlacedAreLeftOut) {
  const Files files;

  const MarkerFile read = read_markers(files.write("m.mrk.json", kMarkups));

  ASSERT_EQ(read.markers.size(), 2);
  EXPECT_EQ(read.markers[0].name, "F-1");
  EXPECT_EQ(read.markers[0].p_mm, Eigen::Vector3d(1.5, -2, 3));
  EXPECT_EQ(read.markers[1].name, "F-3");
  EXPECT_EQ(read.axes, MarkerAxes::kLps);
}

TEST(MarkerFile, AnFcsvSaysItsAxesByWordOrNumber) {
  const Files files;
  const std::string rows =
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
      "vtkMRMLMarkupsFiducialNode_0,1,2,3,0,0,0,1,1,1,0,F-1,,\n";
  const std::string version = "# Markups fiducial file version = 4.11\n";

  for (const auto& [word, axes] :
       std::vector<std::pair<std::string, MarkerAxes>>{{"0", MarkerAxes::kRas},
                                                       {"1", MarkerAxes::kLps},
                                                       {"RAS", MarkerAxes::kRas},
                                                       {"LPS", MarkerAxes::kLps}}) {
    const MarkerFile read =
        read_markers(files.write("m.fcsv", version + "# CoordinateSystem = " + word + "\n" + rows));
    EXPECT_EQ(read.axes, axes) << word;
    EXPECT_EQ(read.markers.at(0).name, "F-1");
    EXPECT_EQ(read.markers.at(0).p_mm, Eigen::Vector3d(1, 2, 3));
  }
}

TEST(MarkerFile, BetweenLpsAndRasXAndYChangeTheirSign) {
  const MarkerFile lps{"m", MarkerAxes::kLps, {{"M1", {1, 2, 3}}}};
  const MarkerFile unknown{"m", MarkerAxes::kAsWritten, {{"M1", {1, 2, 3}}}};

  EXPECT_EQ(along(lps, MarkerAxes::kRas).markers[0].p_mm, Eigen::Vector3d(-1, -2, 3));
  EXPECT_EQ(along(lps, MarkerAxes::kLps).markers[0].p_mm, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(along(unknown, MarkerAxes::kRas).markers[0].p_mm, Eigen::Vector3d(1, 2, 3));
}

TEST(MarkerFile, WhatIsWrittenIsRead) {
  const Files files;
  const fs::path file = files.write("m.csv", "");

  write_markers(file, {{"M1", {1.25, -2, 3}}, {"M2", {0, 0.5, 1e3}}});

  const MarkerFile read = read_markers(file);
  ASSERT_EQ(read.markers.size(), 2);
  EXPECT_EQ(read.markers[1].name, "M2");
  EXPECT_EQ(read.markers[1].p_mm, Eigen::Vector3d(0, 0.5, 1000));
}

TEST(MarkerFile, WhatCannotBeUsedIsRefusedWithItsPlace) {
  const Files files;
  const std::string fcsv = "# CoordinateSystem = LPS\nid,1,2,3,0,0,0,1,1,1,0,";
  const auto replaced = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  struct Case {
    std::string name;
    std::string text;
    std::string place;
    std::string word;
  };
  const std::vector<Case> cases{
      {"m.csv", "", "m.csv:1:1", "empty"},
      {"m.csv", "name,x,y,z\n", "m.csv", "no marker"},
      {"m.csv", "name,x,y\nM1,1,2\n", "m.csv:1:1", "'z' is missing"},
      {"m.csv", "name,x,y,z\nM1,1,nan,3\n", "m.csv:2:6", "not finite"},
      {"m.csv", "name,x,y,z\nM1,1,-1e300,3\n", "m.csv:2", "10 km away"},
      {"m.csv", "name,x,y,z\nM1,1,2\n", "m.csv:2", "3 fields"},
      {"m.csv", "name;x;y;z\nM1;1,5;2;3\n", "m.csv:1:1", "separated by ';'"},
      {"m.csv", "name\tx\ty\tz\nM1\t1\t2\t3\n", "m.csv:1:1", "separated by tabs"},
      {"m.csv", "name,x,y,z\nM1,1,5,2,5,3\n", "m.csv:2", "written with a comma"},
      {"m.csv", std::string("\xFF\xFEn\0a\0", 6), "m.csv:1:1", "save it as UTF-8"},
      {"m.csv", "name,x,y,z\nM1,1,2,3\nM1,4,5,6\n", "m.csv:3:1", "there twice"},
      {"m.csv", "name,x,y,z\n,1,2,3\n", "m.csv:2:1", "no name"},
      {"m.mrk.json", "{\n  \"markups\": [,]}", "m.mrk.json:2:15", "no JSON"},
      {"m.mrk.json", "{}", "m.mrk.json", "no \"markups\""},
      {"m.mrk.json", "[1]", "m.mrk.json", "no \"markups\""},
      {"m.mrk.json", replaced(kMarkups, "Fiducial", "Line"), "m.mrk.json", "type Fiducial"},
      {"m.mrk.json", replaced(kMarkups, "\"coordinateSystem\": \"LPS\",", ""), "/markups/0",
       "coordinateSystem"},
      {"m.mrk.json", replaced(kMarkups, "\"LPS\"", "\"IJK\""), "/markups/0", "expected LPS or RAS"},
      {"m.mrk.json", replaced(kMarkups, "\"mm\"", "\"m\""), "/markups/0", "expected mm"},
      {"m.mrk.json", replaced(kMarkups, "[4, 5, 6]", "[4, 5]"), "/markups/0/controlPoints/2",
       "three numbers"},
      {"m.mrk.json", replaced(kMarkups, "v1.0.3", "v2.0.0"), "m.mrk.json", "schema"},
      {"m.mrk.json", replaced(kMarkups, "F-3", "F-1"), "/markups/0/controlPoints/2", "there twice"},
      {"m.fcsv", "id,1,2,3,0,0,0,1,1,1,0,F-1,,\n", "m.fcsv:1:1", "CoordinateSystem"},
      {"m.fcsv", "# CoordinateSystem = 2\n", "m.fcsv:1:1", "expected LPS or RAS"},
      {"m.fcsv", fcsv, "m.fcsv:2:1", "no name"},
      {"m.fcsv", "# CoordinateSystem = LPS\nid,1,2\n", "m.fcsv:2:1", "too few"},
      {"m.fcsv", "# CoordinateSystem = LPS\nid,1,a,3,0,0,0,1,1,1,0,F\n", "m.fcsv:2:1", "not a number"},
      {"m.fcsv", "# CoordinateSystem = LPS\nid,1,inf,3,0,0,0,1,1,1,0,F\n", "m.fcsv:2:1", "not finite"},
  };
  for (const Case& one : cases) {
    const std::string words = refusal(files.write(one.name, one.text));
    EXPECT_NE(words.find(one.place), std::string::npos) << words;
    EXPECT_NE(words.find(one.word), std::string::npos) << words;
  }
  EXPECT_NE(refusal("/nowhere/m.csv").find("no such file"), std::string::npos);
}

}  // namespace
}  // namespace tubed
