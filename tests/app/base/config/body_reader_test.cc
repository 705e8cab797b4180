#include "app/base/config/body_reader.h"

#include <catch2/catch.hpp>

namespace plumbline::body_reader_test {

using namespace plumbline::config;

TEST_CASE("Tags and bodies are read as written") {
  FaultList faults;
  const auto database = TagDatabaseFromText(R"(schema = 1
[[tag]]
id = 17
size_mm = 50.0
[[body]]
name = "gripper"
size_mm = 80.0
[[body.tag]]
id = 3
xyz_mm = [1.0, 2.0, 3.0]
rpy_deg = [0.0, 0.0, 90.0]
[[body.tag]]
id = 4
size_mm = 40.0
xyz_mm = [0.0, 0.0, 0.0]
)",
                                            "bodies.toml", faults);
  INFO(FaultsText(faults));
  REQUIRE(database);
  CHECK(database->SideOf(17) == 0.05);
  CHECK(database->SideOf(3) == 0.08);
  CHECK(database->SideOf(4) == 0.04);
  CHECK_FALSE(database->SideOf(5));
  CHECK(database->BodyOf(17) == nullptr);
  REQUIRE(database->BodyOf(3) != nullptr);
  CHECK(database->BodyOf(3)->name == "gripper");
  CHECK_FALSE(database->BodyOf(3)->place_sd_m);
  const Pose X = database->BodyOf(3)->tags[0].X_KM;
  CHECK((X * Vec3(1, 0, 0) - Vec3(0.001, 1.002, 0.003)).norm() < 1e-12);
  CHECK(database->DrawnByOf(3) == target::DrawnBy::kUnspecified);
}

TEST_CASE("drawn_by holds for the file, a body or a tag, the inner one first") {
  FaultList faults;
  const auto database = TagDatabaseFromText(R"(schema = 1
drawn_by = "opencv"
[[tag]]
id = 17
size_mm = 50.0
[[body]]
name = "gripper"
size_mm = 80.0
drawn_by = "apriltag"
[[body.tag]]
id = 3
xyz_mm = [1.0, 2.0, 3.0]
[[body.tag]]
id = 4
drawn_by = "opencv"
xyz_mm = [0.0, 0.0, 0.0]
)",
                                            "bodies.toml", faults);
  INFO(FaultsText(faults));
  REQUIRE(database);
  CHECK(database->DrawnByOf(17) == target::DrawnBy::kOpenCv);
  CHECK(database->DrawnByOf(3) == target::DrawnBy::kAprilTag);
  CHECK(database->DrawnByOf(4) == target::DrawnBy::kOpenCv);
  CHECK(database->DrawnByOf(99) == target::DrawnBy::kOpenCv);
  FaultList wrong;
  CHECK_FALSE(TagDatabaseFromText("schema = 1\ndrawn_by = \"aruco\"\n", "bodies.toml", wrong));
  CHECK_THAT(FaultsText(wrong), Catch::Contains("bodies.toml:2 drawn_by"));
}

TEST_CASE("All faults of the file are reported at once") {
  FaultList faults;
  CHECK_FALSE(TagDatabaseFromText(R"(schema = 2
[[tag]]
id = 3
[[body]]
name = "part"
[[body.tag]]
id = 3
size_mm = 9000
xyz_mm = [0, 0]
[[body]]
name = "part"
colour = "red"
)",
                                  "bodies.toml", faults));
  const std::string text = FaultsText(faults);
  for (const char* part : {"schema", "size_mm", "is already used in line 3", "9000", "xyz_mm",
                           "name of another body", "colour", "at least one [[body.tag]]"}) {
    INFO(text << "\nlooked for: " << part);
    CHECK(text.find(part) != std::string::npos);
  }
  faults = {};
  CHECK_FALSE(TagDatabaseFromText("[[body", "bodies.toml", faults));
  CHECK(faults.HasFaults());
}

}  // namespace plumbline::body_reader_test
