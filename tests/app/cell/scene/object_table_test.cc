// Object table: the shipped example, every fault, and edits at run time.
#include "app/cell/scene/object_table.h"

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "app/base/config/body_reader.h"
#include "app/cell/scene/mesh_file.h"
#include "app/cell/scene/object_table_file.h"
#include "drivers/files/text_file.h"
#include "tests/app/base/config/wrong_line.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::object_table_test {

using namespace plumbline::cell;

namespace {

const char* const kTable = R"(
schema = 1
background = false
[clip]
on = { frame = "base" }
normal = [0.0, 3.0, 4.0]
distance_mm = 250.0
grid = false
[[object]]
number = 1
name = "gripper"
file = "meshes/gripper.wrl"
unit = "inch"
on = { frame = "flange" }
xyz_mm = [100.0, 0.0, 0.0]
rpy_deg = [0.0, 0.0, 90.0]
scale = 2.0
bends = true
colour = [0.1, 0.2, 0.3, 0.4]
[[object]]
number = 2
name = "car body"
file = "/models/body.STL"
unit = "mm"
on = { body = "cell" }
visible = false
occludes = true
[[object]]
number = 7
name = "part"
file = "part.glb"
unit = "m"
on = { tag = 17 }
[[pair]]
objects = ["gripper", "car body"]
near_mm = 20.0
end_mm = 2.0
[[line]]
name = "axis"
on = { frame = "world" }
points_mm = [[0.0, 0.0, 0.0], [0.0, 0.0, 1000.0]]
width_px = 4.0
dashed = true
[[line]]
name = "approach"
on = { tag = 3 }
points_mm = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [20.0, 5.0, 0.0]]
sweep = "part"
against = ["car body", "gripper"]
sweep_rpy_deg = [0.0, 0.0, 90.0]
sweep_point_mm = [10.0, 0.0, 0.0]
[[point]]
name = "tip"
of = "gripper"
xyz_mm = [0.0, 0.0, 24.0]
[[point]]
name = "bracket"
on = { body = "cell" }
xyz_mm = [1.0, 2.0, 3.0]
[[distance]]
name = "gap"
from = "tip"
to = "bracket"
[[distance]]
name = "clearance"
from = "part"
to = "bracket"
)";

target::TagDatabase Tags() {
  target::TagDatabase tags;
  tags.bodies.resize(2);
  tags.bodies[0].name = "cell";
  tags.bodies[0].tags.push_back(target::BodyTag{3, 0.08, Pose()});
  tags.bodies[1].name = "gripper";
  for (const int id : {10, 12}) tags.bodies[1].tags.push_back(target::BodyTag{id, 0.08, Pose()});
  tags.tags.push_back(target::StandaloneTag{17, 0.05});
  return tags;
}

bool ReadTable(const std::string& text, config::FaultList& faults) {
  const target::TagDatabase tags = Tags();
  return ObjectTableFromText(text, "objects.toml", &tags, faults).has_value();
}

}  // namespace

TEST_CASE("every key is read and converted to SI") {
  config::FaultList faults;
  const target::TagDatabase tags = Tags();
  const auto table = ObjectTableFromText(kTable, "/etc/cell/objects.toml", &tags, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(table);
  CHECK(faults.All().empty());
  CHECK_FALSE(table->background);
  REQUIRE(table->clip);
  CHECK(table->clip->normal_K.isApprox(Vec3(0, 0.6, 0.8)));
  CHECK(table->clip->distance_m == Approx(0.25));
  CHECK_FALSE(table->clip->grid);
  REQUIRE(table->objects.size() == 3);
  const SceneObject& gripper = table->objects[0];
  CHECK(gripper.file == "/etc/cell/meshes/gripper.wrl");
  CHECK(gripper.unit_m == 0.0254);
  CHECK(gripper.on == Carrier{Carrier::Kind::kFlange, "", 0});
  CHECK((gripper.X_KO * Vec3(1, 0, 0)).isApprox(Vec3(0.1, 1, 0)));
  CHECK(gripper.scale == 2);
  CHECK(gripper.bends);
  CHECK(gripper.colour.a == 0.4F);
  CHECK(table->objects[1].file == "/models/body.STL");
  CHECK(table->objects[1].on == Carrier{Carrier::Kind::kBody, "cell", 0});
  CHECK(table->objects[1].occludes);
  CHECK_FALSE(table->objects[1].visible);
  CHECK(table->objects[2].on == Carrier{Carrier::Kind::kTag, "", 17});
  CHECK(table->pairs[0].b == 1);
  CHECK(table->pairs[0].near_m == Approx(0.02));
  CHECK(table->pairs[0].end_m == Approx(0.002));
  CHECK(table->lines[0].dashed);
  CHECK_FALSE(table->lines[0].sweep);
  REQUIRE(table->lines[1].sweep);
  const SceneSweep& sweep = *table->lines[1].sweep;
  CHECK(sweep.object == 2);
  CHECK(sweep.against == std::vector<std::size_t>{1, 0});
  CHECK((sweep.X_KO * Vec3(0.01, 0, 0)).norm() < 1e-12);  // the point follows the path
  CHECK(table->lines[1].points_K[2].isApprox(Vec3(0.02, 0.005, 0)));
  CHECK(std::get<std::size_t>(table->points[0].of) == 0);
  CHECK(std::get<Carrier>(table->points[1].of).body == "cell");
  CHECK_FALSE(table->distances[0].from.is_object);
  CHECK(table->distances[1].from.is_object);
  CHECK(table->distances[1].from.place == 2);
}

TEST_CASE("each fault is reported with its line and a suggestion") {
  ExpectOneFaultEach(
      kTable, "objects.toml",
      {{"schema = 1", "schema = 2", "schema: 2 is outside 1..1"},
       {"normal = [0.0, 3.0, 4.0]", "normal = [0.0, 0.0, 0.0]",
        "clip.normal: [0, 0, 0] has zero length"},
       {"number = 7", "number = 2", "object[3].number: 2 is the number of another object"},
       {"name = \"approach\"", "name = \"axis\"",
        "line[2].name: \"axis\" is used by another table of this kind"},
       {"unit = \"inch\"", "unit = \"furlong\"",
        "object[1].unit: \"furlong\" must be one of um, mm, cm, m, inch, ft"},
       {"unit = \"inch\"", "", "@9 object[1].unit: missing; expected a string in quotes"},
       {"file = \"part.glb\"", "file = \"part.step\"",
        "object[3].file: \"part.step\" must end in one of .wrl, .stl, .obj, .ply, .gltf, .glb"},
       {"on = { tag = 17 }", "on = { tag = 16 }",
        "object[3].on.tag: 16 is not defined in the file of tags and bodies; the nearest of 4 is "
        "17"},
       {"on = { tag = 17 }", "on = { body = \"griper\" }",
        "object[3].on.body: \"griper\" is not defined in the file of tags and bodies; did you mean "
        "\"gripper\"?"},
       {"on = { tag = 17 }", "on = { frame = \"flansch\" }",
        "object[3].on.frame: \"flansch\" is not one of \"world\", \"base\", \"flange\""},
       {"on = { tag = 17 }", "on = { tag = 17, frame = \"world\" }",
        "object[3].on: needs exactly one of body = \"...\", tag = ..., link = ..., frame = "
        "\"world\", \"base\" or \"flange\""},
       {"on = { tag = 17 }", "on = { link = 0 }", "object[3].on.link: 0 is outside 1..12"},
       {"occludes = true", "bends = true",
        "object[2].bends: true needs on = { frame = \"flange\" }: an object on a tag or "
        "body is already drawn where the bent tool carries it"},
       {"scale = 2.0", "scale = -1.0", "object[1].scale: -1 is outside 0.001..1000"},
       {"visible = false", "visble = false",
        "object[2].visble: unknown key; did you mean \"visible\"?"},
       {"colour = [0.1, 0.2, 0.3, 0.4]", "colour = [0.1]",
        "object[1].colour: [0.1] is not a list of 3 numbers (red, green, blue) or 4 (and opacity)"},
       {"objects = [\"gripper\", \"car body\"]", "objects = [\"gripper\", \"car bdy\"]",
        "pair[1].objects: [\"gripper\", \"car bdy\"] names \"car bdy\", which is not an object; "
        "did you mean \"car body\"?"},
       {"objects = [\"gripper\", \"car body\"]", "objects = [\"gripper\", \"gripper\"]",
        "pair[1].objects: [\"gripper\", \"gripper\"] is not a list of two different objects"},
       {"points_mm = [[0.0, 0.0, 0.0], [0.0, 0.0, 1000.0]]", "points_mm = [[0.0, 0.0, 0.0]]",
        "line[1].points_mm: [[0, 0, 0]] is not a list of two or more points of 3 numbers"},
       {"against = [\"car body\", \"gripper\"]", "against = [\"part\"]",
        "line[2].against: [\"part\"] names the swept object itself"},
       {"of = \"gripper\"", "of = \"griper\"",
        "point[1].of: \"griper\" names \"griper\", which is not an object; did you mean "
        "\"gripper\"?"},
       {"to = \"bracket\"\n[[distance]]", "to = \"brackett\"\n[[distance]]",
        "distance[1].to: \"brackett\" is neither a point nor an object; did you mean \"bracket\"?"},
       {"from = \"part\"", "from = \"bracket\"",
        "@67 distance[2].to: \"bracket\" is the same as from"}},
      ReadTable);
}

TEST_CASE("all faults are reported at once; without a tag file tags are not checked") {
  config::FaultList faults;
  CHECK_FALSE(
      ReadTable("[[object]]\nname = \"a\"\n[[line]]\nname = \"b\"\nagainst = [\"a\"]\n", faults));
  const std::string text = config::FaultsText(faults);
  for (const char* key : {"schema", "object[1].number", "object[1].file", "object[1].unit",
                          "object[1].on", "line[1].on", "line[1].points_mm", "line[1].against"}) {
    INFO(text << key);
    CHECK(text.find(key) != std::string::npos);
  }
  config::FaultList none;
  CHECK(ObjectTableFromText(kTable, "objects.toml", nullptr, none));
}

TEST_CASE(
    "the example table matches its tag file, and its meshes are closed bodies of their size") {
  config::FaultList faults;
  const auto bodies = files::ReadTextFile("config/bodies.toml"),
             text = files::ReadTextFile("config/objects.toml");
  REQUIRE(bodies);
  REQUIRE(text);
  const auto tags = config::TagDatabaseFromText(*bodies, "config/bodies.toml", faults);
  REQUIRE(tags);
  const auto table = ObjectTableFromText(*text, "config/objects.toml", &*tags, faults);
  INFO(config::FaultsText(faults));
  REQUIRE(table);
  CHECK(faults.All().empty());
  for (const SceneObject& object : table->objects) {
    const auto mesh = ReadMeshFile(object.file, object.unit_m, {}, PLUMBLINE_MESH);
    INFO(object.file << (mesh ? "" : mesh.error()));
    REQUIRE(mesh);
    CHECK(mesh->checked.facts.facing() == scene::Facing::kOutwards);
    CHECK(mesh->checked.facts.degenerate == 0);
    CHECK(mesh->checked.facts.max_O.z() < 1);
    CHECK(mesh->checked.facts.max_O.z() > 0.05);
  }
}

TEST_CASE("a saved table is read again; a faulty one leaves the previous table in use") {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() + "/objects.toml";
  const auto save = [&path](const std::string& text) { std::ofstream(path) << text; };
  const target::TagDatabase tags = Tags();
  ObjectTableFile file(path, &tags);
  const auto missing = file.Poll();
  REQUIRE(missing);
  CHECK_FALSE(missing->accepted);
  CHECK_THAT(config::FaultsText(missing->faults), Catch::Contains("cannot be read"));
  CHECK_FALSE(file.Poll());
  CHECK_FALSE(file.table());

  save(kTable);
  CHECK_FALSE(file.Poll());  // may be incomplete
  const auto first = file.Poll();
  REQUIRE(first);
  CHECK(first->accepted);
  CHECK(file.table()->objects.size() == 3);
  CHECK_FALSE(file.Poll());

  save("schema = 1\n[[object]]\nname = \"half");
  CHECK_FALSE(file.Poll());
  const auto faulty = file.Poll();
  REQUIRE(faulty);
  CHECK_FALSE(faulty->accepted);
  CHECK(faulty->faults.HasFaults());
  CHECK(file.table()->objects.size() == 3);
  CHECK_FALSE(file.Poll());

  save("schema = 1\n");
  file.Poll();
  const auto empty = file.Poll();
  REQUIRE(empty);
  CHECK(empty->accepted);
  CHECK_FALSE(empty->faults.All().empty());  // a warning: no objects
  CHECK(file.table()->objects.empty());

  std::filesystem::remove(path);
  file.Poll();
  const auto gone = file.Poll();
  REQUIRE(gone);
  CHECK_FALSE(gone->accepted);
  CHECK(file.table());
}

}  // namespace plumbline::object_table_test
