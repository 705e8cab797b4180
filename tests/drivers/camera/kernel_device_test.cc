// Tests on real or virtual cameras (vivid, v4l2loopback with a feeder, USB gadget): whatever
// `plumbline cameras` lists on this machine. SKIPPED if there are none.
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "drivers/camera/v4l2_camera.h"
#include "drivers/camera/v4l2_device.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::kernel_device_test {

using namespace plumbline::camera;

namespace {

constexpr double kPatience_s = 10;  // until a camera sends its first frame
constexpr int kFrames = 10;

/// Cameras with a supported format, one device each.
std::vector<V4l2Device> Cameras() {
  std::vector<V4l2Device> cameras;
  for (const V4l2Device& device : ListV4l2Devices()) {
    const auto offer = QueryV4l2Capabilities(device);
    if (offer && ChooseMode(offer->modes, {}) &&
        (cameras.empty() || NameWithPort(cameras.back()) != NameWithPort(device))) {
      cameras.push_back(device);
    }
  }
  return cameras;
}

bool Skip(const char* why) {
  std::cout << "SKIPPED: " << why << '\n';
  return true;
}

/// In the smallest supported mode, because a virtual machine is slow.
std::unique_ptr<Camera> Open(const std::string& selector, const V4l2Device& device) {
  V4l2CameraOptions options;
  options.device = selector;
  const auto offer = QueryV4l2Capabilities(device);
  if (!offer) FAIL(offer.error());
  for (const V4l2Mode& mode : offer->modes) {
    const image::ImageSize size = mode.largest, best = options.mode.size;
    const bool smaller =
        best == image::ImageSize{} || size.width * size.height < best.width * best.height;
    if (PixelFormatOfFourcc(mode.fourcc) && smaller) options.mode.size = size;
  }
  auto made = V4l2Camera::Create(options, MonotonicSeconds);
  if (!made) FAIL(made.error());
  return std::move(made).value();
}

/// Reads until a frame arrives, ignoring other results.
CameraResult ReadFrame(Camera& camera, CameraFrame& frame) {
  const double end_s = MonotonicSeconds() + kPatience_s;
  CameraResult result = CameraResult::kNoFrame;
  while (result != CameraResult::kFrame && MonotonicSeconds() < end_s) {
    result = camera.Read(0.2, frame);
    if (result == CameraResult::kWaiting) SleepSeconds(0.05);
  }
  return result;
}

}  // namespace

TEST_CASE("a camera of this machine streams: times and sequence ascend", "[v4l2-stream]") {
  const auto cameras = Cameras();
  if (cameras.empty() && Skip("no camera on this machine that sends what is read")) return;
  for (const V4l2Device& device : cameras) {
    const auto camera = Open(device.path, device);
    CameraFrame frame, last;
    for (int k = 0; k < kFrames; ++k) {
      INFO(device.path << " " << camera->problem());
      REQUIRE(ReadFrame(*camera, frame) == CameraResult::kFrame);
      CHECK(frame.time_s <= MonotonicSeconds());
      if (k > 0) CHECK(frame.time_s > last.time_s);
      if (k > 0) CHECK(frame.sequence > last.sequence);
      CHECK(frame.luma.data != nullptr);
      last = frame;
    }
    std::cout << device.path << ' ' << camera->identity().serial << ' ' << camera->identity().mode
              << '\n';
    for (const std::string& remark : camera->TakeRemarks()) std::cout << remark << '\n';
  }
}

TEST_CASE("two cameras of this machine at once", "[v4l2-two]") {
  const auto cameras = Cameras();
  if (cameras.size() < 2 && Skip("fewer than two cameras on this machine")) return;
  const auto first = Open(cameras[0].path, cameras[0]);
  const auto second = Open(cameras[1].path, cameras[1]);
  CameraFrame a, b;
  for (int k = 0; k < kFrames; ++k) {
    REQUIRE(ReadFrame(*first, a) == CameraResult::kFrame);
    REQUIRE(ReadFrame(*second, b) == CameraResult::kFrame);
    CHECK(a.luma.data != b.luma.data);
  }
  CHECK(first->identity().serial != second->identity().serial);
}

TEST_CASE("a vivid camera is unbound and rebound", "[v4l2-unplug]") {
  const std::filesystem::path driver = "/sys/bus/platform/drivers/vivid";
  const auto cameras = Cameras();
  const bool is_vivid = !cameras.empty() && cameras[0].driver == "vivid";
  if ((!is_vivid || access((driver / "unbind").c_str(), W_OK) != 0) &&
      Skip("no vivid here, or no right to unbind it")) {
    return;
  }
  const auto camera = Open("@" + cameras[0].port, cameras[0]);
  CameraFrame frame;
  REQUIRE(ReadFrame(*camera, frame) == CameraResult::kFrame);
  const std::uint64_t before = frame.sequence;
  std::ofstream(driver / "unbind") << "vivid.0" << std::flush;
  CameraResult result = CameraResult::kFrame;
  while (result == CameraResult::kFrame) result = camera->Read(1, frame);
  CHECK(result == CameraResult::kLost);
  INFO(camera->problem());
  std::ofstream(driver / "bind") << "vivid.0" << std::flush;
  REQUIRE(ReadFrame(*camera, frame) == CameraResult::kFrame);
  CHECK(frame.sequence > before);
}

TEST_CASE("the first camera is unplugged and replugged by hand", "[v4l2-replug]") {
  const auto cameras = Cameras();
  if ((cameras.empty() || std::getenv("PLUMBLINE_REPLUG") == nullptr) &&
      Skip("PLUMBLINE_REPLUG=1 asks somebody to replug a camera")) {
    return;
  }
  const auto camera = Open(StableName(cameras[0], cameras), cameras[0]);
  CameraFrame frame;
  REQUIRE(ReadFrame(*camera, frame) == CameraResult::kFrame);
  const CameraIdentity identity = camera->identity();
  std::cout << "now replug " << identity.serial << std::endl;
  const std::uint64_t before = frame.sequence;
  CameraResult result = CameraResult::kFrame;
  while (result != CameraResult::kLost) result = camera->Read(1, frame);
  std::cout << camera->problem() << std::endl;
  for (int k = 0; k < 6 && result != CameraResult::kFrame; ++k) result = ReadFrame(*camera, frame);
  INFO(camera->problem());
  REQUIRE(result == CameraResult::kFrame);
  CHECK(frame.sequence > before);
  CHECK(camera->identity().serial == identity.serial);
  CHECK(camera->identity().mode == identity.mode);
}

}  // namespace plumbline::kernel_device_test
