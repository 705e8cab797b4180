#include "drivers/camera/v4l2_device.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/drivers/camera/fake_v4l2.h"

namespace plumbline::v4l2_device_test {

using namespace plumbline::camera;

namespace {

std::string PathOf(std::string_view selector, const std::vector<V4l2Device>& devices) {
  const auto device = SelectV4l2Device(selector, devices);
  return device ? device->path : device.error();
}

}  // namespace

TEST_CASE("v4l2 devices: capture devices are listed by number with serial, model and port") {
  test::FakeMachine machine;
  machine.Plug(10, "2-1.4", "");
  machine.Plug(2, "1-2", "A1B2");
  machine.Plug(3, "1-2", "A1B2").caps = V4L2_CAP_META_CAPTURE | V4L2_CAP_STREAMING;
  std::filesystem::create_directories(machine.tree().sysfs + "/vbi0");
  std::filesystem::create_directories(machine.tree().sysfs + "/video7x");
  const auto devices = ListV4l2Devices(machine.tree());
  REQUIRE(devices.size() == 2);
  CHECK(devices[0].path == machine.Path(2));
  CHECK(devices[0].serial == "A1B2");
  CHECK(devices[0].port == "1-2");
  CHECK(devices[0].model == "046d:0825");
  CHECK(devices[0].name == "Fake camera");
  CHECK(devices[0].driver == "fake");
  CHECK(devices[1].serial.empty());
  CHECK(StableName(devices[0], devices) == "A1B2");
  CHECK(StableName(devices[1], devices) == "046d:0825@2-1.4");
  CHECK(ListV4l2Devices({"/no/such/place", "/dev"}).empty());
}

TEST_CASE("v4l2 devices: a device that does not answer is listed with the reason") {
  test::FakeMachine machine;
  machine.Plug(0, "1-2", "A").gone = true;
  const auto devices = ListV4l2Devices(machine.tree());
  REQUIRE(devices.size() == 1);
  CHECK_THAT(devices[0].problem, Catch::Contains("cannot be opened"));
  CHECK(devices[0].serial == "A");
}

TEST_CASE(
    "v4l2 devices: a multi-planar node is listed with the reason, another node is preferred") {
  test::FakeMachine machine;
  machine.Plug(0, "1-2", "A").caps = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  auto devices = ListV4l2Devices(machine.tree());
  REQUIRE(devices.size() == 1);
  CHECK_THAT(devices[0].problem, Catch::Contains("multi-planar") && Catch::Contains("USB camera"));
  CHECK(PathOf("A", devices) == machine.Path(0));
  machine.Plug(1, "1-2", "A");
  devices = ListV4l2Devices(machine.tree());
  CHECK(PathOf("A", devices) == machine.Path(1));
  // A memory-to-memory codec is not a camera.
  machine.Plug(2, "1-3", "B").caps = V4L2_CAP_VIDEO_M2M_MPLANE | V4L2_CAP_STREAMING;
  CHECK(ListV4l2Devices(machine.tree()).size() == 2);
}

TEST_CASE("v4l2 devices: selected by path, link, serial or port; equal serials by their port") {
  test::FakeMachine machine;
  machine.Plug(0, "1-1", "SN0001");
  machine.Plug(1, "1-1", "SN0001");  // a second node of the first camera
  machine.Plug(4, "1-2", "SN0001");
  machine.Plug(6, "1-3", "");
  machine.Plug(8, "1-4", "ALONE");
  const auto devices = ListV4l2Devices(machine.tree());
  const std::string link = machine.tree().dev + "/by-id";
  std::filesystem::create_symlink("video4", link);
  CHECK(PathOf(link, devices) == machine.Path(4));
  CHECK(PathOf(machine.Path(6), devices) == machine.Path(6));
  CHECK(PathOf("/dev/elsewhere", devices) == "/dev/elsewhere");
  CHECK(PathOf("ALONE", devices) == machine.Path(8));
  CHECK(PathOf("ALONE@1-4", devices) == machine.Path(8));
  CHECK(PathOf("SN0001@1-1", devices) == machine.Path(0));
  CHECK(PathOf("SN0001@1-2", devices) == machine.Path(4));
  CHECK(PathOf("@1-3", devices) == machine.Path(6));
  CHECK(PathOf("046d:0825@1-3", devices) == machine.Path(6));
  CHECK(PathOf("SN0001", devices) ==
        "2 cameras have the serial number SN0001. Add the port to select one: SN0001@1-1 or "
        "SN0001@1-2");
  CHECK_THAT(PathOf("ALONE@1-2", devices), Catch::Contains("no camera ALONE@1-2 found"));
  CHECK_THAT(PathOf("", devices), Catch::Contains("no camera "));
  CHECK(StableName(devices[0], devices) == "SN0001@1-1");
}

}  // namespace plumbline::v4l2_device_test
