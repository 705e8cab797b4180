#include "app/base/config/wrong_file.h"

#include <catch2/catch.hpp>

namespace plumbline::wrong_file_test {

using namespace plumbline::config;

namespace {

std::string Refusal(std::string_view bytes, const std::string& file, const Wanted& wanted) {
  FaultList faults;
  return RefuseWrongFile(bytes, file, wanted, faults) ? FaultsText(faults) : "";
}

}  // namespace

TEST_CASE("a file of another kind is refused by one message with place, meaning and remedy") {
  CHECK(Refusal("<?xml version='1.0'?>\n<robot name='a'><link name='b'/></robot>", "arm.urdf",
                kWantedCell) ==
        "arm.urdf:2: is recognised as a description of a robot (URDF) (robot), but a cell "
        "(cell.toml) "
        "is read here. Use `plumbline import-urdf arm.urdf --output cell.toml`\n");
  CHECK(
      Refusal("cell = \"arm.toml\"\n", "plumbline.toml", kWantedCell).find("cell = \"arm.toml\"") !=
      std::string::npos);
  CHECK_FALSE(Refusal("\x1F\x8B\x08", "lens.yaml", kWantedLens).empty());
}

TEST_CASE("what may be right is left to its reader") {
  CHECK(Refusal("", "a.toml", kWantedCell) != "");
  CHECK(Refusal("schema = 1\n", "a.toml", kWantedCell).empty());
  CHECK(Refusal("[robot]\nconvention = \"dh\"\n", "a.toml", kWantedCell).empty());
  CHECK(Refusal("text\n", "arm.urdf", kWantedCell).empty());  // only its name says so
  CHECK(Refusal("a;b\n1;2\n", "a.csv", kWantedMeasured).empty());
  CHECK(Refusal("image_width: 4\ncamera_matrix: [1]\n", "a.yaml", kWantedLens).empty());
}

TEST_CASE("a mesh whose name selects another reader is refused") {
  CHECK(Refusal("v 1 2 3\nf 1 2 3\n", "part.stl", kWantedMesh).find("rename it to .obj") !=
        std::string::npos);
  CHECK(Refusal("v 1 2 3\nf 1 2 3\n", "part.obj", kWantedMesh).empty());
}

}  // namespace plumbline::wrong_file_test
