// plumbline cameras on a simulated kernel and on the test machine.
#include "app/cli/cameras_command.h"

#include <catch2/catch.hpp>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "tests/app/cli/run_command.h"
#include "tests/drivers/camera/fake_v4l2.h"

namespace plumbline::cameras_command_test {

using namespace plumbline::cli;

TEST_CASE("Cameras with their names, modes and settings") {
  test::FakeMachine machine;
  auto& usual = machine.Plug(0, "1-2", "A1");
  usual.modes = {{V4L2_PIX_FMT_YUYV, 640, 480, {30, 15}}, {V4L2_PIX_FMT_H264, 720, 576, {25}}};
  usual.controls = {{V4L2_CID_EXPOSURE_ABSOLUTE, {3, 2047, 250}},
                    {V4L2_CID_ZOOM_ABSOLUTE, {0, 500, 100}}};
  machine.Plug(1, "1-3", "").modes = {{V4L2_PIX_FMT_GREY, 320, 240, {}}};
  machine.Plug(2, "1-4", "B").gone = true;

  const auto cameras = text::JsonOrNull(CamerasJson(machine.tree()))["cameras"];
  REQUIRE(cameras.size() == 3);
  CHECK(cameras[0]["device"] == machine.Path(0));
  CHECK(cameras[0]["select"] == "A1");
  CHECK(cameras[0]["port"] == "1-2");
  CHECK(cameras[0]["problem"].is_null());
  REQUIRE(cameras[0]["modes"].size() == 2);
  CHECK(cameras[0]["modes"][0] == nlohmann::json{{"format", "YUYV"},
                                                 {"readable", true},
                                                 {"width", 640},
                                                 {"height", 480},
                                                 {"rates_hz", {30.0, 15.0}}});
  CHECK(cameras[0]["modes"][1]["readable"] == false);
  REQUIRE(cameras[0]["controls"].size() == 2);
  CHECK(cameras[0]["controls"][0]["name"] == "exposure_s");
  CHECK(cameras[0]["controls"][0]["value"].get<double>() == Approx(0.025));
  CHECK(cameras[0]["controls"][1]["largest"] == 500.0);
  CHECK(cameras[1]["select"] == "046d:0825@1-3");
  CHECK(cameras[2]["problem"].get<std::string>().find("cannot be opened") == 0);

  const std::string text = CamerasText(machine.tree());
  CHECK_THAT(text, Catch::Contains("--camera A1\n  YUYV 640x480 at 30, 15 Hz\n"));
  CHECK_THAT(text, Catch::Contains("  formats not supported by Plumbline: H264\n"));
  CHECK_THAT(text, Catch::Contains("exposure_s 0.025 (0.0003..0.2047"));
  CHECK_THAT(text, Catch::Contains("no serial number"));
  CHECK_THAT(text, Catch::Contains("cannot be opened"));

  const auto table = CameraTable(machine.tree(), "1");
  REQUIRE(table);
  CHECK_THAT(*table, Catch::StartsWith("[camera]"));
  CHECK_THAT(*table, Catch::EndsWith("device = \"A1\"\nwidth_px = 640\nheight_px = 480\n"
                                     "rate_hz = 30.0\n"));
  CHECK_THAT(CameraTable(machine.tree(), "3").error(), Catch::Contains("cannot be opened"));
  CHECK_THAT(CameraTable(machine.tree(), "4").error(), Catch::Contains("lists 1 to 3"));
  CHECK(CameraTable(machine.tree(), "A1").value() == *table);
  CHECK(CameraTable(machine.tree(), machine.Path(0)).value() == *table);
  CHECK_THAT(CameraTable(machine.tree(), "046d:0825@1-3").value(),
             Catch::Contains("device = \"046d:0825@1-3\""));
  CHECK_THAT(CameraTable(machine.tree(), "C7").error(), Catch::Contains("no camera C7 found"));
  CHECK_THAT(CameraTable(machine.tree(), "/dev/none").error(), Catch::Contains("no camera"));
}

TEST_CASE("A DV camcorder has no size to choose") {
  test::FakeMachine machine;
  machine.Plug(0, "1-2", "A1").modes = {{V4L2_PIX_FMT_DV, 0, 0, {10000000}}};
  const auto cameras = text::JsonOrNull(CamerasJson(machine.tree()))["cameras"];
  CHECK(cameras[0]["modes"][0] == nlohmann::json{{"format", "dvsd"},
                                                 {"readable", true},
                                                 {"rates_hz", nlohmann::json::array()}});
  CHECK_THAT(CamerasText(machine.tree()), Catch::Contains("  dvsd in the size of its frames\n"));
  const auto table = CameraTable(machine.tree(), "1");
  REQUIRE(table);
  CHECK_THAT(*table, Catch::EndsWith("device = \"A1\"\n"));
}

TEST_CASE("A machine without cameras, and the test machine") {
  const test::FakeMachine machine;
  CHECK(CamerasText(machine.tree()) == "no cameras\n");
  CHECK(text::JsonOrNull(CamerasJson(machine.tree()))["cameras"].empty());
  const test::Answer answer = test::RunCommand(AddCamerasCommand, "cameras --json");
  CHECK(answer.exit_code == 0);
  CHECK(text::JsonOrNull(answer.out)["cameras"].is_array());
}

}  // namespace plumbline::cameras_command_test
