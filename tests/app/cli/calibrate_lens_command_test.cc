// plumbline calibrate-lens: output for a refused lens.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "tests/app/cli/board_sheet.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/renderer/pgm.h"

namespace plumbline::calibrate_lens_command_test {

using namespace plumbline::cli;

namespace {

/// Images of a board of 9 x 6 inner corners, and an empty one.
struct Files {
  test::TemporaryFolder folder;

  Files() {
    std::filesystem::create_directory(Path("frames"));
    renderer::Camera camera;
    camera.width = 640;
    camera.height = 480;
    camera.fx = camera.fy = 800;
    camera.cx = 319.5;
    camera.cy = 239.5;
    for (int k = 0; k < 3; ++k) {
      renderer::Sheet sheet = test::BoardSheet();
      sheet.X_CK = Eigen::Isometry3d::Identity();
      sheet.X_CK.translation() = Eigen::Vector3d(-0.08 + 0.01 * k, -0.05, 0.5);
      const auto shot = renderer::Render(camera, {sheet}, {}, 7 + static_cast<std::uint64_t>(k));
      renderer::WritePgm(Path("frames/" + std::to_string(k) + ".pgm"), shot);
    }
    renderer::WritePgm(Path("frames/9.pgm"),
                       {640, 480, std::vector<std::uint8_t>(std::size_t{640} * 480, 'x')});
  }
  std::string Path(const std::string& name) const { return folder.path() + "/" + name; }
  std::string Content(const std::string& name) const {
    std::ifstream file(Path(name));
    std::stringstream text;
    text << file.rdbuf();
    return text.str();
  }
  test::Answer Calibrate(const std::string& more) const {
    return test::RunCommand(AddCalibrateLensCommand,
                            "calibrate-lens --images " + Path("frames") + " " + more);
  }
};

}  // namespace

TEST_CASE("Another board than requested is named, and the counts add up") {
  const Files files;
  const test::Answer other = files.Calibrate("--board 17x11");
  INFO(other.out);
  CHECK(other.exit_code == 0);
  CHECK(other.out.find(
            "no image shows 17 x 11 inner corners, but 3 of 4 show 9 x 6; try --board 9x6") !=
        std::string::npos);
  CHECK(other.out.find("4 images: 0 used, 4 refused\n") != std::string::npos);
  const test::Answer right = files.Calibrate("--board 9x6");
  INFO(right.out);
  CHECK(right.out.find("--board") == std::string::npos);
  CHECK(right.out.find("4 images: 0 used, 1 refused, 3 valid but not used\n") != std::string::npos);
}

TEST_CASE("Images of two sizes, equally many, are refused and named") {
  const Files files;
  for (int k = 0; k < 4; ++k) {
    renderer::WritePgm(files.Path("frames/other" + std::to_string(k) + ".pgm"),
                       {320, 240, std::vector<std::uint8_t>(std::size_t{320} * 240, 'x')});
  }
  const test::Answer answer = files.Calibrate("--board 9x6");
  INFO(answer.out);
  CHECK(answer.out.find("4 images are 320 x 240 px and 4 images are 640 x 480 px") !=
        std::string::npos);
}

TEST_CASE("A refused lens is marked in OpenCV's file too") {
  const Files files;
  CHECK(files.Calibrate("--board 17x11 --yaml " + files.Path("lens.yaml")).exit_code == 0);
  const std::string yaml = files.Content("lens.yaml");
  CHECK_THAT(yaml,
             Catch::StartsWith("%YAML:1.0\n---\naccepted: 0\n# refused: no image shows 17 x 11"));
}

TEST_CASE("An option named in a reason does not end the comment of an XML file") {
  const Files files;
  CHECK(files.Calibrate("--board 17x11 --xml " + files.Path("lens.xml")).exit_code == 0);
  const std::string xml = files.Content("lens.xml");
  INFO(xml);
  CHECK(xml.find("try - -board 9x6 -->") != std::string::npos);
}

TEST_CASE("Declarations are part of the result") {
  const Files files;
  const auto declared = [&](const std::string& options) {
    const test::Answer answer = files.Calibrate("--board 9x6 --json - --quiet " + options);
    return text::JsonOrNull(answer.out)["declared"].dump();
  };
  CHECK(declared("") == "[]");
  CHECK(declared("--no-window") == "[\"no_window\"]");
  CHECK(declared("--fixed-focus --no-window") == "[\"no_window\",\"fixed_focus\"]");
}

TEST_CASE("Two outputs under one name are refused, however it is spelt") {
  const Files files;
  const test::Answer answer =
      files.Calibrate("--json " + files.Path("a.x") + " --yaml " + files.Path("frames/../a.x"));
  CHECK(answer.exit_code == 2);
  CHECK(answer.err.find("--yaml and --json are the same file") != std::string::npos);
  CHECK_FALSE(std::filesystem::exists(files.Path("a.x")));
}

TEST_CASE("An output that is one of the images is refused") {
  const Files files;
  const std::filesystem::directory_iterator images(files.Path("frames"));
  const std::string image = images->path().string();
  const auto size = std::filesystem::file_size(image);
  const test::Answer answer = files.Calibrate("--json " + image);
  CHECK(answer.exit_code == 2);
  CHECK(answer.err.find("--json would overwrite the input " + image + "; choose another file") !=
        std::string::npos);
  CHECK(std::filesystem::file_size(image) == size);
}

}  // namespace plumbline::calibrate_lens_command_test
