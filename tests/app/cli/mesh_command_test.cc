// plumbline mesh check, with the real plumbline-mesh process.
#include <algorithm>
#include <catch2/catch.hpp>
#include <fstream>

#include "app/base/text/json_text.h"
#include "app/cell/scene/mesh_format.h"
#include "app/cli/commands.h"
#include "tests/app/cell/scene/shapes.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::mesh_command_test {

using namespace plumbline::cli;
using test::RunCommand;

namespace {

struct MeshFiles {
  test::TemporaryFolder folder;
  std::string Write(const std::string& name, const std::string& content) const {
    const std::string path = folder.path() + "/" + name;
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }
};

}  // namespace

TEST_CASE("the content of a mesh is printed as text and as JSON") {
  const MeshFiles files;
  const std::string path =
      files.Write("bar.obj", "mtllib paint.mtl\n" + test::MeshFileText(test::Cuboid({600, 50, 40}),
                                                                       cell::MeshFormat::kObj));
  const auto text = RunCommand(AddMeshCommand, "mesh check " + path + " --unit mm");
  INFO(text.err);
  CHECK(text.exit_code == 0);
  CHECK(text.err.empty());
  for (const char* part :
       {"triangles    12", "vertices     8", "600 x 50 x 40 mm", "closed, 1 part", "outwards",
        "volume       1.2e+06 mm^3", "warning: ", "paint.mtl"}) {
    INFO(text.out << part);
    CHECK(text.out.find(part) != std::string::npos);
  }
  const auto answer = RunCommand(AddMeshCommand, "mesh check " + path + " --unit inch --json");
  CHECK(answer.exit_code == 0);
  const auto json = text::JsonOrNull(answer.out);
  CHECK(json["schema"] == 1);
  CHECK(json["unit"] == "inch");
  CHECK(json["size_mm"][0].get<double>() == Approx(600 * 25.4));
  CHECK(json["closed"] == true);
  CHECK(json["outside"] == std::vector<std::string>{"paint.mtl"});
  CHECK(json["facing"] == "outwards");
}

TEST_CASE("a missing unit is requested, not guessed") {
  const MeshFiles files;
  const std::string path = files.Write(
      "bar.stl", test::MeshFileText(test::Cuboid({600, 50, 40}), cell::MeshFormat::kStl));
  const auto text = RunCommand(AddMeshCommand, "mesh check " + path);
  CHECK(text.exit_code == 0);
  CHECK_THAT(text.out, Catch::Contains("600 x 50 x 40 in file units"));
  CHECK_THAT(text.out, Catch::Contains("no unit stated"));
  const auto json =
      text::JsonOrNull(RunCommand(AddMeshCommand, "mesh check " + path + " --json").out);
  CHECK(json["unit"].is_null());
  CHECK(json["size_file_unit"][0].get<double>() == Approx(600));
  CHECK_FALSE(json.contains("size_mm"));
  const auto metres = RunCommand(AddMeshCommand, "mesh check " + path + " --unit m");
  CHECK_THAT(metres.out, Catch::Contains("is m the right unit?"));
}

TEST_CASE("refusals and wrong arguments") {
  const MeshFiles files;
  const std::string cut = files.Write(
      "cut.stl",
      test::MeshFileText(test::Cuboid({1, 1, 1}), cell::MeshFormat::kStl).substr(0, 300));
  const auto refused = RunCommand(AddMeshCommand, "mesh check " + cut + " --unit mm");
  CHECK(refused.exit_code == 1);
  CHECK(refused.out.empty());
  CHECK_THAT(refused.err, Catch::Contains(cut + ": not a readable stl file"));
  const auto json = RunCommand(AddMeshCommand, "mesh check " + cut + " --json");
  CHECK(json.exit_code == 1);
  CHECK(text::JsonOrNull(json.out)["refused"].is_string());
  const std::string good =
      files.Write("good.stl", test::MeshFileText(test::Cuboid({1, 1, 1}), cell::MeshFormat::kStl));
  CHECK_THAT(RunCommand(AddMeshCommand, "mesh check " + good + " --max-triangles 11").err,
             Catch::Contains("the limit is 11"));
  CHECK(RunCommand(AddMeshCommand, "mesh check " + good + " --unit furlong").exit_code == 2);
  CHECK(RunCommand(AddMeshCommand, "mesh").exit_code == 2);
  CHECK(RunCommand(AddMeshCommand, "mesh check").exit_code == 2);
}

TEST_CASE("the limits in the reader, the help and the manual agree") {
  const cell::MeshLimits limits;
  const std::string triangles = std::to_string(limits.triangles) + " triangles";
  const std::string file = std::to_string(limits.file_bytes >> 20) + " MiB of file";
  const std::string memory = std::to_string(limits.memory_bytes >> 20) + " MiB of memory";
  const std::string processor = std::to_string(limits.cpu_s) + " s of processor time";
  const std::string whole = std::to_string(static_cast<int>(limits.wall_s)) + " s in total";
  const auto on_one_line = [](std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
  };
  const std::string help = on_one_line(RunCommand(AddMeshCommand, "mesh check --help").out);
  const std::string manual = on_one_line(test::FileText("docs/cameras.md"));
  for (const std::string& limit : {triangles, file, memory, processor, whole}) {
    CAPTURE(limit);
    CHECK(help.find(limit) != std::string::npos);
    CHECK(manual.find(limit) != std::string::npos);
  }
  // A looser limit would let a file pass that the overlay refuses.
  const auto looser = RunCommand(
      AddMeshCommand, "mesh check a.stl --max-triangles " + std::to_string(limits.triangles + 1));
  CHECK(looser.exit_code == 2);
}

}  // namespace plumbline::mesh_command_test
