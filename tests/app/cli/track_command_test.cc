// plumbline track on rendered images and on faulty input.
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <thread>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/app/vision/tracking/tag_scene.h"
#include "tests/drivers/camera/dv_frames.h"
#include "tests/renderer/pgm.h"

namespace plumbline::track_command_test {

using namespace plumbline::cli;
using test::Answer;
using test::RunCommand;

namespace {

constexpr std::size_t kPixels = std::size_t{480} * 360;

renderer::Camera Camera() {
  renderer::Camera camera;
  camera.width = 480;
  camera.height = 360;
  camera.fx = camera.fy = 800;
  camera.cx = 240;
  camera.cy = 180;
  return camera;
}

struct Files {
  test::TemporaryFolder folder;
  std::string image, lens, bodies;

  Files() {
    image = Path("frame.pgm");
    lens = Path("lens.json");
    bodies = Path("bodies.toml");
    const target::TagFamily family = *target::TagFamilyOfName("36h11");
    test::TagScene scene;
    scene.camera = Camera();
    scene.Add(family, 5, test::FacingPose({-0.09, 0, 0.8}, 0.4, 1, 0));
    scene.Add(family, 6, test::FacingPose({0.09, 0.01, 0.8}, 0.4, 2, 0));
    const auto shot = renderer::Render(scene.camera, scene.sheets, {}, 1);
    renderer::WritePgm(image, shot);
    WriteLens(true, 480);
  }
  std::string Path(const std::string& name) const { return folder.path() + "/" + name; }
  static void Write(const std::string& path, const std::string& text) {
    std::ofstream(path, std::ios::binary) << text;
  }
  void WriteLens(bool accepted, int width) const {
    Write(lens, text::JsonText(nlohmann::json{{"schema", 1},
                                              {"accepted", accepted},
                                              {"image_size", {width, 360}},
                                              {"fx", 800.0},
                                              {"fy", 800.0},
                                              {"cx", 240.0},
                                              {"cy", 180.0},
                                              {"distortion", {0.0, 0.0, 0.0, 0.0, 0.0}}}));
  }
  Answer Track(const std::string& more) const {
    return RunCommand(AddTrackCommand,
                      "track --image " + image + " --intrinsics " + lens + " " + more);
  }
};

/// Writes the bytes to a FIFO while it is read; gives up after 10 s.
void WriteToFifo(const std::string& path, std::span<const std::uint8_t> bytes) {
  const os::Descriptor fifo(open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  for (int k = 0; k < 10000 && !bytes.empty(); ++k) {
    const ssize_t wrote = write(fifo.get(), bytes.data(), bytes.size());
    if (wrote > 0) bytes = bytes.subspan(static_cast<std::size_t>(wrote));
    if (wrote <= 0) SleepSeconds(1e-3);
  }
  SleepSeconds(0.01);  // the FIFO is discarded with its last descriptor
}

}  // namespace

TEST_CASE("Tags as JSON: ids, corners from the top left clockwise, poses with deviations") {
  const Files files;
  const Answer answer = files.Track("--tag-size-mm 80 --json");
  INFO(answer.err);
  REQUIRE(answer.exit_code == 0);
  CHECK(answer.err.empty());
  const auto json = text::JsonOrNull(answer.out);
  REQUIRE(json["tags"].size() == 2);
  CHECK(json["bodies"].empty());
  const auto& tag = json["tags"][0];
  CHECK(tag["id"] == 5);
  CHECK(tag["ambiguous"] == false);
  const auto& corners = tag["corners_px"];
  REQUIRE(corners.size() == 4);
  CHECK(corners[0][0] < corners[1][0]);
  CHECK(corners[1][1] < corners[2][1]);
  CHECK(corners[3][0] < corners[2][0]);
  const auto& pose = tag["pose"];
  CHECK(pose["t_mm"][0].get<double>() == Approx(-90).margin(0.2));
  CHECK(pose["t_mm"][2].get<double>() == Approx(800).margin(1));
  CHECK(pose["quaternion_wxyz"].size() == 4);
  CHECK(pose["quaternion_wxyz"][0].get<double>() == Approx(std::cos(0.2)).margin(0.01));
  CHECK(pose["sd"]["t_mm"][2].get<double>() > 0);
  CHECK(pose["sd"]["rotation_deg"].size() == 3);
  const Answer text = files.Track("--tag-size-mm 80");
  CHECK(text.out.find("tag 5") != std::string::npos);
}

TEST_CASE("Bodies are read from a file; its faults are reported with their lines") {
  const Files files;
  Files::Write(files.bodies, R"(schema = 1
[[body]]
name = "part"
size_mm = 80
[[body.tag]]
id = 5
xyz_mm = [0, 0, 0]
)");
  const Answer answer = files.Track("--bodies " + files.bodies + " --json");
  REQUIRE(answer.exit_code == 0);
  const auto json = text::JsonOrNull(answer.out);
  REQUIRE(json["bodies"].size() == 1);
  CHECK(json["bodies"][0]["name"] == "part");
  CHECK(json["tags"][0]["pose"].is_object());
  CHECK(json["tags"][1]["pose"].is_null());  // its size is not known
  Files::Write(files.bodies, "schema = 1\n[[body]]\nname = \"part\"\n");
  const Answer faulty = files.Track("--bodies " + files.bodies);
  CHECK(faulty.exit_code == 1);
  CHECK(faulty.err.find("bodies.toml:2") != std::string::npos);
}

TEST_CASE("A body that is not visible, and an id outside the family, are reported") {
  const Files files;
  const auto body = [](const char* name, int id) {
    return std::string("[[body]]\nname = \"") + name +
           "\"\nsize_mm = 80\n[[body.tag]]\nid = " + std::to_string(id) + "\nxyz_mm = [0, 0, 0]\n";
  };
  Files::Write(files.bodies, "schema = 1\n" + body("part", 5) + body("gripper", 40));
  const Answer answer = files.Track("--bodies " + files.bodies);
  INFO(answer.err);
  REQUIRE(answer.exit_code == 0);
  CHECK(answer.out.find("gripper          not visible\n") != std::string::npos);
  CHECK(answer.out.find("part             not seen") == std::string::npos);
  Files::Write(files.bodies, "schema = 1\n" + body("part", 587));
  const Answer beyond = files.Track("--bodies " + files.bodies);
  CHECK(beyond.exit_code == 1);
  CHECK(beyond.err.find("bodies.toml: 36h11 has no tag 587, only 0..586") != std::string::npos);
}

TEST_CASE("An image without tags is not an error") {
  const Files files;
  renderer::WritePgm(files.image, {480, 360, std::vector<std::uint8_t>(kPixels, 'x')});
  const Answer answer = files.Track("--tag-size-mm 80 --json");
  CHECK(answer.exit_code == 0);
  CHECK(text::JsonOrNull(answer.out)["tags"].empty());
}

TEST_CASE("Colour and 16-bit images are read") {
  const Files files;
  std::ifstream file(files.image, std::ios::binary);
  std::string grey((std::istreambuf_iterator<char>(file)), {});
  grey.erase(0, grey.size() - kPixels);
  std::string colour = "P6\n480 360\n255\n", deep = "P5\n480 360\n65535\n";
  for (const char level : grey) {
    colour += std::string(3, level);
    deep += std::string{level, 0};
  }
  for (const std::string& kind : {colour, deep}) {
    Files::Write(files.image, kind);
    const Answer answer = files.Track("--tag-size-mm 80 --json");
    REQUIRE(answer.exit_code == 0);
    CHECK(text::JsonOrNull(answer.out)["tags"].size() == 2);
  }
}

TEST_CASE("Unusable input is refused with a remedy") {
  const Files files;
  const auto refused = [&](const std::string& more, int code, const std::string& word) {
    const Answer answer = files.Track(more);
    INFO(answer.err);
    CHECK(answer.exit_code == code);
    CHECK(answer.out.empty());
    CHECK(answer.err.find(word) != std::string::npos);
  };
  refused("", 2, "--tag-size-mm");
  refused("--tag-size-mm 80 --family 12h3", 2, "36h11");
  CHECK(files.Track("--tag-size-mm 80 --threshold 256").exit_code == 2);
  CHECK(files.Track("--tag-size-mm 80 --threshold -1").exit_code == 2);
  CHECK(files.Track("--tag-size-mm nan").exit_code == 2);
  refused("--tag-size-mm 80 --bodies " + files.Path("none.toml"), 1, "none.toml");
  files.WriteLens(true, 640);
  refused("--tag-size-mm 80", 1, "480 x 360 pixels");
  files.WriteLens(false, 480);
  refused("--tag-size-mm 80", 1, "--force");
  CHECK(files.Track("--tag-size-mm 80 --force").exit_code == 0);
  Files::Write(files.lens, "{}");
  refused("--tag-size-mm 80", 1, "lens.json");
  files.WriteLens(true, 480);
  Files::Write(files.image, "no image");
  refused("--tag-size-mm 80", 1, "frame.pgm");
  std::remove(files.image.c_str());
  refused("--tag-size-mm 80", 1, "No such file");
}

TEST_CASE("A recording as camera: one line of JSON per frame, with time and sequence") {
  const Files files;
  const std::string recording = files.Path("recording.csv");
  Files::Write(files.Path("broken.pgm"), "no image");
  Files::Write(recording, "t_s,file\n4,frame.pgm\n4.05,broken.pgm\n4.1,\n4.15,frame.pgm\n");
  const auto track = [&](const std::string& more) {
    return RunCommand(AddTrackCommand, "track --camera " + recording + " --intrinsics " +
                                           files.lens + " --tag-size-mm 80 " + more);
  };
  const Answer answer = track("--fast --json");
  INFO(answer.err);
  REQUIRE(answer.exit_code == 0);
  std::istringstream lines(answer.out);
  std::vector<nlohmann::json> frames;
  for (std::string line; std::getline(lines, line);) frames.push_back(text::JsonOrNull(line));
  REQUIRE(frames.size() == 2);
  CHECK(frames[0]["t_s"] == 0.0);
  CHECK(frames[1]["t_s"].get<double>() == Approx(0.15));
  CHECK(frames[1]["sequence"] == 3);
  for (const auto& frame : frames) {
    CHECK(frame["tags"].size() == 2);
    CHECK(frame["tags"][0]["pose"]["t_mm"][2].get<double>() == Approx(800).margin(1));
  }
  CHECK(answer.err.find("broken.pgm: not a readable image") != std::string::npos);
  CHECK(answer.err.find("the camera was lost at this point") != std::string::npos);
  CHECK(answer.err.find("camera restored") != std::string::npos);
  const Answer text = track("--fast --frames 1");
  CHECK(text.exit_code == 0);
  CHECK(text.out.find("frame 0, 0.000 s:") == 0);
  CHECK(text.out.find("frame 3") == std::string::npos);
  CHECK(track("--fast --repeat --frames 9 --json").exit_code == 0);
}

TEST_CASE("A DV camcorder: corners of one field, although the tag was elsewhere in the other") {
  test::DvEncoder encoder(true);
  if (!encoder.usable()) {
    WARN("SKIPPED: this libavcodec has no DV encoder");
    return;
  }
  // The picture that is measured has square pixels and is half a line below the frame.
  renderer::Camera square = renderer::Pinhole(787, 576, 800);
  renderer::Camera frame = square;
  frame.width = 720;
  frame.fx = square.fx * 720 / 787;
  frame.cx = (square.cx + 0.5) * 720 / 787 - 0.5;
  square.cy -= 0.5;
  const target::TagFamily family = *target::TagFamilyOfName("36h11");
  const auto pose = [](double x_m) { return test::FacingPose({x_m, 0.02, 0.6}, 0.4, 1, 0.2); };
  const auto shot = [&](double x_m) {
    test::TagScene scene;
    scene.camera = frame;
    scene.Add(family, 5, pose(x_m));
    return renderer::Render(frame, scene.sheets, {}, 1);
  };
  const renderer::Image now = shot(-0.03), earlier = shot(-0.035);
  const std::vector<std::uint8_t> bytes = encoder.Encode([&](int column, int line) {
    const auto pixel = static_cast<std::size_t>(720 * line + column);
    return 16 + (line % 2 == 1 ? now : earlier).grey[pixel] * 219 / 255.0;
  });
  const Files files;
  const std::string fifo = files.Path("camcorder");
  REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
  Files::Write(files.lens, text::JsonText(nlohmann::json{{"schema", 1},
                                                         {"accepted", true},
                                                         {"image_size", {787, 576}},
                                                         {"fx", square.fx},
                                                         {"fy", square.fy},
                                                         {"cx", square.cx},
                                                         {"cy", square.cy},
                                                         {"distortion", {0, 0, 0, 0, 0}}}));
  std::thread writer([&] { WriteToFifo(fifo, bytes); });
  const Answer answer =
      RunCommand(AddTrackCommand, "track --camera " + fifo + " --intrinsics " + files.lens +
                                      " --tag-size-mm 80 --frames 1 --json");
  writer.join();
  INFO(answer.err);
  REQUIRE(answer.exit_code == 0);
  const auto json = text::JsonOrNull(answer.out);
  REQUIRE(json["tags"].size() == 1);
  const auto corners = test::TagCorners(0.08);
  for (std::size_t k = 0; k < 4; ++k) {
    const Eigen::Vector2d expected = renderer::PixelOf(square, pose(-0.03) * corners[k]);
    CHECK(json["tags"][0]["corners_px"][k][0].get<double>() == Approx(expected.x()).margin(0.1));
    CHECK(json["tags"][0]["corners_px"][k][1].get<double>() == Approx(expected.y()).margin(0.1));
  }
}

TEST_CASE("An unusable camera is refused with a remedy") {
  const Files files;
  const auto refused = [&](const std::string& camera, int code, const std::string& word) {
    const Answer answer = RunCommand(
        AddTrackCommand, "track --intrinsics " + files.lens + " --tag-size-mm 80 " + camera);
    INFO(answer.err);
    CHECK(answer.exit_code == code);
    CHECK(answer.out.empty());
    CHECK(answer.err.find(word) != std::string::npos);
  };
  refused("", 2, "--image FILE or --camera");
  refused("--camera x --image y", 2, "--image FILE or --camera");
  refused("--camera NO-SUCH-SERIAL", 1, "plumbline cameras lists");
  refused("--camera /dev/no-such-video", 1, "is the camera plugged in");
  refused("--camera " + files.Path("none.csv"), 1, "No such file");
  Files::Write(files.Path("bad.csv"), "t_s,file\n0,none.png\n");
  refused("--camera " + files.Path("bad.csv"), 1, "no usable frame");
  refused("--camera " + files.folder.path() + " --size 12", 2, "");
  refused("--image y --frames 3", 2, "");
  files.WriteLens(true, 640);
  refused("--fast --camera " + files.folder.path(), 1, "calibrated at 640 x 360");
}

}  // namespace plumbline::track_command_test
