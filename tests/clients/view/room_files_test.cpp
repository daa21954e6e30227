#include "clients/view/room_files.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

namespace tubed {
namespace {

namespace fs = std::filesystem;

std::string binary_stl(std::uint32_t stated, std::size_t written) {
  std::string bytes(84 + 50 * written, '\0');
  std::memcpy(bytes.data() + 80, &stated, sizeof stated);
  return bytes;
}

std::string vtk(const std::string& attributes) {
  return "<?xml version=\"1.0\"?>\n<VTKFile " + attributes + ">\n<PolyData></PolyData>\n</VTKFile>\n";
}

/// What a person reads; "" when it is taken.
std::string refusal(const std::string& name, const std::string& bytes) {
  try {
    kind_of_surface(name, bytes);
    return "";
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
}

void expect_refusal(const std::string& name, const std::string& bytes, const std::string& words) {
  const std::string said = refusal(name, bytes);
  EXPECT_TRUE(said.starts_with(name + ": ")) << said;
  EXPECT_NE(said.find(words), std::string::npos) << said;
}

TEST(Surface, IsKnownByItsContentWhateverItsName) {
  EXPECT_EQ(kind_of_surface("a.vtp", binary_stl(3, 3)), "stl");
  EXPECT_EQ(kind_of_surface("a.stl", vtk("type=\"PolyData\" version=\"1.0\"")), "vtp");
  EXPECT_EQ(kind_of_surface("a", "solid x\n facet normal 0 0 1\n"), "stl");
}

TEST(Surface, ABinaryFileMayBeginAsTextDoes) {
  std::string bytes = binary_stl(2, 2);
  bytes.replace(0, 11, "solid facet");
  EXPECT_EQ(kind_of_surface("a.stl", bytes), "stl");
}

TEST(Surface, BytesBehindTheTrianglesDoNoHarm) {
  EXPECT_EQ(kind_of_surface("a.stl", binary_stl(2, 2) + "made by a program"), "stl");
}

TEST(Surface, AByteOrderMarkAndBlanksDoNoHarm) {
  EXPECT_EQ(kind_of_surface("a.vtp", "\xEF\xBB\xBF\r\n" + vtk("type='PolyData'")), "vtp");
}

TEST(Surface, WhatWasCutOffIsRefused) {
  expect_refusal("a.stl", binary_stl(3, 2), "would have 234 bytes, and it has 184");
  expect_refusal("a.vtp", "<VTKFile type=\"PolyData\"><PolyData>", "was it cut off");
}

TEST(Surface, OtherKindsOfVtkDataAreRefusedWithWhatToDo) {
  expect_refusal("a.vtu", vtk("type=\"UnstructuredGrid\""), "extract its surface and save that as .vtp");
  expect_refusal("a.vtk", "# vtk DataFile Version 4.2\nx\nBINARY\n", "save it as VTK XML PolyData (.vtp)");
  expect_refusal("a.xml", "<html></html>", "no VTK file");
}

TEST(Surface, CompressionThatThePageCannotUndoIsRefusedWithWhatToDo) {
  EXPECT_EQ(refusal("a.vtp", vtk("type=\"PolyData\" compressor=\"vtkZLibDataCompressor\"")), "");
  for (const char* const library : {"vtkLZ4DataCompressor", "vtkLZMADataCompressor"}) {
    expect_refusal("a.vtp", vtk("type=\"PolyData\" compressor=\"" + std::string(library) + "\""),
                   std::string(library) + ", which is not read: save it with zlib or without compression");
  }
}

TEST(Surface, WhatIsNoneIsRefused) {
  for (const std::string& bytes : {std::string("ply\n"), std::string(200, 'a'), std::string("\0", 1)}) {
    expect_refusal("a.ply", bytes, "neither STL nor VTK XML PolyData");
  }
}

/// A file that goes with the object.
class File {
 public:
  File(const std::string& name, const std::string& text)
      : folder_(fs::temp_directory_path() / ("room-files-" + std::to_string(::getpid()))),
        file_(folder_ / name) {
    fs::create_directories(folder_);
    std::ofstream(file_, std::ios::binary) << text;
  }
  ~File() { fs::remove_all(folder_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] std::string path() const { return file_.string(); }

 private:
  fs::path folder_;
  fs::path file_;
};

TEST(Surface, IsNotedWithoutTheFolder) {
  const File file("aorta.stl", binary_stl(1, 1));
  VesselNote note;
  EXPECT_EQ(read_surface(file.path(), note).size(), 134U);
  EXPECT_EQ(note.name, "aorta.stl");
  EXPECT_EQ(note.kind, "stl");
  EXPECT_EQ(note.size, 134U);
}

TEST(Surface, OfMoreThan64MegabytesIsRefused) {
  const File file("large.stl", "");
  fs::resize_file(file.path(), (64U << 20U) + 1);
  VesselNote note;
  EXPECT_THROW(read_surface(file.path(), note), std::invalid_argument);
}

std::string csv(std::size_t count) {
  std::string text = "name,x,y,z\n";
  for (std::size_t i = 0; i < count; ++i) text += "M" + std::to_string(i) + ",1,2,3\n";
  return text;
}

TEST(Points, AreShownUpToALimit) {
  EXPECT_EQ(read_points(File("a.csv", csv(kMaxPoints)).path()).markers.size(), kMaxPoints);
  EXPECT_THROW(read_points(File("a.csv", csv(kMaxPoints + 1)).path()), std::invalid_argument);
}

TEST(Points, AFileThatIsWrongIsAWrongArgument) {
  EXPECT_THROW(read_points("/nowhere/a.csv"), std::invalid_argument);
  EXPECT_THROW(read_points(File("a.csv", "name,x,y,z\nM1,1,2\n").path()), std::invalid_argument);
}

}  // namespace
}  // namespace tubed
