#include "drivers/camera/v4l2_camera.h"

#include <catch2/catch.hpp>
#include <opencv2/imgcodecs.hpp>

#include "drivers/camera/registry.h"
#include "firmware-like/image/image_size.h"
#include "tests/drivers/camera/dv_frames.h"
#include "tests/drivers/camera/fake_v4l2.h"

namespace plumbline::v4l2_camera_test {

using namespace plumbline::camera;

namespace {

using test::FakeDevice;
using test::FakeFrame;
using test::FakeMachine;

constexpr std::uint32_t kWidth = 16, kHeight = 8;
constexpr std::size_t kPixels = std::size_t{kWidth} * kHeight;
constexpr double kTimeout_s = 0.1;

/// A uniform frame, GREY by default.
FakeFrame Level(int level, std::size_t bytes = kPixels) {
  FakeFrame frame;
  frame.bytes.assign(bytes, static_cast<std::uint8_t>(level));
  return frame;
}

FakeFrame Jpeg(int width, int height, int level) {
  FakeFrame frame;
  cv::imencode(".jpg", cv::Mat(height, width, CV_8U, cv::Scalar(level)), frame.bytes);
  return frame;
}

/// A machine with one camera at port 1-2.
struct Cell {
  explicit Cell(std::uint32_t fourcc = V4L2_PIX_FMT_GREY) {
    test::SetFakeTime(1000);
    Plug(fourcc);
  }
  void Plug(std::uint32_t fourcc) {
    device = &machine.Plug(0, "1-2", "A1");
    device->modes = {{fourcc, kWidth, kHeight, {30, 15}}};
  }
  void Make(V4l2CameraOptions options = {}) {
    if (options.device.empty()) options.device = "A1";
    options.tree = machine.tree();
    auto made = V4l2Camera::Create(options, test::FakeTime);
    if (!made) FAIL(made.error());
    camera = std::move(made).value();
  }
  CameraResult Read() { return camera->Read(kTimeout_s, frame); }
  int Seen() const { return frame.luma.row(kHeight - 1)[kWidth - 1]; }
  std::string Problem() const { return std::string(camera->problem()); }

  FakeMachine machine;
  FakeDevice* device = nullptr;
  std::unique_ptr<Camera> camera;
  CameraFrame frame;
};

}  // namespace

TEST_CASE("v4l2 camera: connects by itself, luma in place, the driver's time") {
  Cell cell;
  cell.Make();
  CHECK(cell.camera->identity().serial.empty());
  cell.device->coming = {Level(50), Level(60)};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.camera->identity().serial == "A1");
  CHECK(cell.camera->identity().mode == "GREY 16x8@30");
  CHECK(cell.frame.luma.size() == image::ImageSize{16, 8});
  CHECK(cell.Seen() == 50);
  CHECK(cell.frame.time_s == Approx(1000.03));
  const bool in_place = cell.frame.luma.data == cell.device->memory[0].bytes.data();
  CHECK(in_place);
  const std::uint64_t first = cell.frame.sequence;
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 60);
  CHECK(cell.frame.sequence == first + 1);
  CHECK(cell.camera->problem().empty());
  CHECK(cell.camera->TakeRemarks().empty());
}

TEST_CASE("v4l2 camera: no frame in time; after prolonged silence it is reopened") {
  Cell cell;
  cell.Make();
  CHECK(cell.Read() == CameraResult::kNoFrame);
  CHECK(test::FakeTime() == Approx(1000.1));
  CHECK_THAT(cell.Problem(), Catch::Contains("no frame within 0.1 s"));
  CameraResult result = CameraResult::kNoFrame;
  for (int i = 0; i < 100 && result == CameraResult::kNoFrame; ++i) result = cell.Read();
  CHECK(result == CameraResult::kLost);
  CHECK(test::FakeTime() == Approx(1005.1).margin(0.2));
  CHECK_THAT(cell.Problem(), Catch::Contains("no data for 5 s"));
  CHECK(cell.Read() == CameraResult::kWaiting);
  test::SetFakeTime(test::FakeTime() + 1);
  cell.device->coming = {Level(1)};
  CHECK(cell.Read() == CameraResult::kFrame);
  CHECK(cell.device->opened == 2);
}

TEST_CASE("v4l2 camera: only the newest frame is returned, and the sequence shows the gap") {
  Cell cell;
  cell.Make();
  cell.device->coming = {Level(1)};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  const std::uint64_t first = cell.frame.sequence;
  for (const int level : {2, 3, 4, 5, 6}) cell.device->Arrive(Level(level));
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 4);  // three buffers were free: frames 5 and 6 were lost
  CHECK(cell.frame.sequence == first + 3);
  FakeFrame late = Level(7);
  late.skipped = 10;
  cell.device->Arrive(late);
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 7);
  CHECK(cell.frame.sequence == first + 16);
  // The returned frame is not overwritten by later ones.
  for (const int level : {8, 9, 10, 11, 12}) cell.device->Arrive(Level(level));
  CHECK(cell.Seen() == 7);
}

TEST_CASE(
    "v4l2 camera: damaged and short frames are skipped; without a good one the result is "
    "unusable") {
  Cell cell;
  cell.Make();
  FakeFrame damaged = Level(1);
  damaged.flags |= V4L2_BUF_FLAG_ERROR;
  cell.device->coming = {damaged, Level(2, 100), Level(3)};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 3);
  const CameraFrame before = cell.frame;
  cell.device->coming = {Level(4, 100), Level(5, 100), Level(6, 100), Level(7, 100)};
  CHECK(cell.Read() == CameraResult::kUnusable);
  CHECK_THAT(cell.Problem(), Catch::Contains("a short frame: 100 bytes"));
  CHECK(cell.frame.sequence == before.sequence);
  cell.device->coming = {damaged, damaged, damaged, damaged};
  CHECK(cell.Read() == CameraResult::kUnusable);
  CHECK_THAT(cell.Problem(), Catch::Contains("damaged frames"));
  cell.device->coming = {Level(0, 0), Level(8)};  // an empty frame
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 8);
}

TEST_CASE("v4l2 camera: unplugged while streaming, back at another port, settings applied again") {
  Cell cell;
  cell.device->controls = {{V4L2_CID_FOCUS_AUTO, {0, 1, 1}}, {V4L2_CID_GAIN, {0, 100, 0}}};
  cell.Make({.device = {}, .settings = {.gain_counts = 40}});
  cell.device->coming = {Level(1), Level(1)};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.device->controls[V4L2_CID_FOCUS_AUTO].value == 0);
  CHECK(cell.device->controls[V4L2_CID_GAIN].value == 40);
  const CameraFrame before = cell.frame;
  cell.machine.Unplug(0);
  CHECK(cell.Read() == CameraResult::kLost);
  CHECK_THAT(cell.Problem(), Catch::Contains("lost: No such device"));
  CHECK(cell.Read() == CameraResult::kWaiting);
  CHECK_THAT(cell.Problem(), Catch::Contains(": lost"));
  test::SetFakeTime(test::FakeTime() + 1);
  CHECK(cell.Read() == CameraResult::kLost);
  CHECK_THAT(cell.Problem(), Catch::Contains("no camera A1 found. Check that it is plugged in"));

  FakeDevice& back = cell.machine.Plug(5, "2-1", "A1");
  back.modes = {{V4L2_PIX_FMT_GREY, kWidth, kHeight, {30}}};
  back.controls = {{V4L2_CID_FOCUS_AUTO, {0, 1, 1}}, {V4L2_CID_GAIN, {0, 100, 0}}};
  FakeFrame first = Level(9);
  first.skipped = 500;  // the driver restarts its counter at an arbitrary value
  back.coming = {first};
  test::SetFakeTime(test::FakeTime() + 6);
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 9);
  CHECK(cell.frame.sequence == before.sequence + 1);
  CHECK(cell.frame.time_s > before.time_s);
  CHECK(back.controls[V4L2_CID_FOCUS_AUTO].value == 0);
  CHECK(back.controls[V4L2_CID_GAIN].value == 40);
  CHECK(cell.camera->identity().serial == "A1");
}

TEST_CASE("v4l2 camera: each setting that the device rejects, changes or lacks is reported") {
  Cell cell;
  auto& controls = cell.device->controls;
  controls[V4L2_CID_EXPOSURE_AUTO] = {0, 3, 3};
  controls[V4L2_CID_EXPOSURE_ABSOLUTE] = {3, 2047, 250};
  controls[V4L2_CID_AUTO_WHITE_BALANCE] = {0, 1, 1, 1, true};
  controls[V4L2_CID_WHITE_BALANCE_TEMPERATURE] = {2800, 6500, 4000};
  controls[V4L2_CID_FOCUS_ABSOLUTE] = {0, 250, 0, 5};
  cell.Make(
      {.device = {},
       .settings = {
           .exposure_s = 0.005, .gain_counts = 3, .white_balance_K = 9000.0, .focus_counts = 42}});
  cell.device->coming = {Level(1)};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(controls[V4L2_CID_EXPOSURE_AUTO].value == V4L2_EXPOSURE_MANUAL);
  CHECK(controls[V4L2_CID_EXPOSURE_ABSOLUTE].value == 50);
  const std::string at = cell.machine.Path(0) + ": ";
  CHECK(cell.camera->TakeRemarks() ==
        std::vector<std::string>{
            at + "focus_counts: requested 42, the camera set 40",
            at + "gain_counts: not supported by this camera",
            at + "automatic white balance: the camera rejects 0: Device or resource busy",
            at + "white_balance_K: 9000 is outside the range 2800..6500 of this camera; left "
                 "unchanged"});
  CHECK(cell.camera->TakeRemarks().empty());
}

TEST_CASE("v4l2 camera: Motion JPEG; garbage and another size are skipped") {
  Cell cell(V4L2_PIX_FMT_MJPEG);
  cell.Make();
  cell.device->coming = {Level(0x5A), Jpeg(8, 8, 1), Jpeg(kWidth, kHeight, 99)};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.camera->identity().mode == "MJPG 16x8@30");
  CHECK(cell.Seen() == 99);
  REQUIRE(cell.camera->Bgr() != nullptr);
  CHECK(cell.camera->Bgr()->size() == 3 * kPixels);
  CHECK(cell.camera->Bgr()->at(1) == 99);
  cell.device->coming = {Jpeg(8, 8, 1), Jpeg(8, 8, 1), Jpeg(8, 8, 1), Jpeg(8, 8, 1)};
  CHECK(cell.Read() == CameraResult::kUnusable);
  CHECK_THAT(cell.Problem(),
             Catch::Contains("a JPEG of 8 x 8 px instead of the negotiated 16 x 8"));
  CHECK(cell.camera->Bgr() == nullptr);
  cell.device->coming = {Jpeg(kWidth, kHeight, 0)};  // a black frame is valid
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 0);
}

TEST_CASE("v4l2 camera: rows with padding, and YUYV") {
  Cell cell(V4L2_PIX_FMT_YUYV);
  cell.device->padding = 6;
  cell.Make();
  FakeFrame frame = Level(128, 2 * kPixels + std::size_t{6} * kHeight);
  for (std::size_t i = 0; i < frame.bytes.size(); i += 2) frame.bytes[i] = 77;
  cell.device->coming = {frame};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.Seen() == 77);
}

TEST_CASE("v4l2 camera: time stamps from another clock or impossible ones are replaced") {
  Cell cell;
  cell.Make();
  FakeFrame frame = Level(1);
  frame.older_s = 0.02;
  cell.device->coming = {frame};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.frame.time_s == Approx(1000.01));
  frame.flags = V4L2_BUF_FLAG_TIMESTAMP_UNKNOWN;
  cell.device->coming = {frame};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.frame.time_s == Approx(1000.06));
  frame.flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
  for (const double older_s : {900.0, -5.0}) {
    frame.older_s = older_s;
    cell.device->coming = {frame};
    REQUIRE(cell.Read() == CameraResult::kFrame);
    CHECK(cell.frame.time_s == Approx(test::FakeTime()));
  }
  frame.older_s = 0.5;  // earlier than the previous frame
  cell.device->coming = {frame};
  const double before_s = cell.frame.time_s;
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.frame.time_s > before_s);
}

TEST_CASE("v4l2 camera: busy, unsuitable or without the mode: the remedy is reported") {
  const auto problem = [](Cell& cell, const V4l2CameraOptions& options = {}) {
    cell.Make(options);
    CHECK(cell.Read() == CameraResult::kLost);
    return cell.Problem();
  };
  Cell busy;
  busy.device->busy = true;
  CHECK_THAT(problem(busy), Catch::Contains("whether another program uses the camera"));
  Cell output;
  output.device->caps = V4L2_CAP_VIDEO_OUTPUT | V4L2_CAP_STREAMING;
  CHECK_THAT(problem(output, {.device = output.machine.Path(0)}),
             Catch::Contains("does not support streaming capture"));
  Cell planes;
  planes.device->caps = V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_STREAMING;
  CHECK_THAT(problem(planes), Catch::Contains("multi-planar") && Catch::Contains("USB camera"));
  Cell small;
  CHECK_THAT(problem(small, {.device = {}, .mode = {.size = {640, 480}}}),
             Catch::Contains("no 640 x 480 px in a supported format; the camera offers GREY 16x8"));
  Cell stubborn;
  stubborn.device->modes.insert(stubborn.device->modes.begin(), {V4L2_PIX_FMT_H264, 32, 32, {30}});
  stubborn.device->ignores_format = true;
  CHECK_THAT(problem(stubborn), Catch::Contains("but set H264 32x32"));
  Cell absent;
  CHECK_THAT(problem(absent, {.device = "/dev/no-such-video"}),
             Catch::Contains("is the camera plugged in"));
}

TEST_CASE("v4l2 camera: DV has the size of its frames; a damaged frame costs one picture") {
  test::DvEncoder encoder(false);
  if (!encoder.usable()) {
    WARN("SKIPPED: this libavcodec has no DV encoder");
    return;
  }
  Cell cell;
  cell.device->modes = {{V4L2_PIX_FMT_DV, 720, 480, {}}};  // room for a frame
  // The requested size is that of other cameras; DV has only one.
  cell.Make({.device = {}, .mode = {.size = {1920, 1080}}, .dv_decoder = PLUMBLINE_DV});
  FakeFrame damaged;
  damaged.bytes = encoder.Uniform(90);
  for (std::size_t block = 0; block < damaged.bytes.size(); block += 80) {
    if (damaged.bytes[block] >> 5 != 4) continue;
    for (std::size_t k = 4; k < 80; ++k)
      damaged.bytes[block + k] = static_cast<std::uint8_t>(block / 80 * 31 + k * 7);
  }
  FakeFrame first, cut, last;
  first.bytes = encoder.Uniform(60);
  last.bytes = encoder.Uniform(120);
  cut.bytes.assign(last.bytes.begin(), last.bytes.begin() + 100000);
  cell.device->coming = {first, damaged, cut, last};
  const auto level = [&] { return cell.frame.luma.row(240)[300]; };
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.camera->identity().mode == "dvsd 655x480@29.97");
  CHECK(cell.frame.luma.size() == image::ImageSize{655, 480});
  CHECK(level() == 60);
  REQUIRE(cell.camera->Bgr() != nullptr);
  CHECK(cell.camera->Bgr()->size() == 3 * 655 * 480);
  const std::uint64_t sequence = cell.frame.sequence;
  REQUIRE(cell.camera->Read(0.2, cell.frame) == CameraResult::kFrame);
  CHECK(level() == 120);
  CHECK(cell.frame.sequence == sequence + 3);
  CHECK(cell.device->opened == 1);
  CHECK(cell.camera->TakeRemarks().empty());
  cell.device->coming = {damaged};
  CHECK(cell.Read() == CameraResult::kUnusable);
  CHECK_THAT(cell.Problem(), Catch::Contains("damaged DV frame"));
  CHECK(cell.camera->Bgr() == nullptr);
}

TEST_CASE("v4l2 camera: a rate that the device does not reach is reported") {
  Cell cell;
  cell.Make({.device = {}, .mode = {.rate_hz = 60}});
  cell.device->coming = {Level(1)};
  REQUIRE(cell.Read() == CameraResult::kFrame);
  CHECK(cell.camera->TakeRemarks() ==
        std::vector<std::string>{
            cell.machine.Path(0) +
            ": GREY 16x8 runs at 30 frames per second instead of the requested 60"});
}

TEST_CASE("v4l2 camera: two with one serial number are distinguished by their port") {
  Cell cell;
  FakeDevice& other = cell.machine.Plug(1, "1-3", "A1");
  other.modes = {{V4L2_PIX_FMT_GREY, kWidth, kHeight, {30}}};
  cell.Make();
  CHECK(cell.Read() == CameraResult::kLost);
  CHECK_THAT(cell.Problem(), Catch::Contains("Add the port to select one: A1@1-2 or A1@1-3"));

  cell.Make({.device = "A1@1-2"});
  auto second =
      std::move(V4l2Camera::Create({.device = cell.machine.Path(1), .tree = cell.machine.tree()},
                                   test::FakeTime))
          .value();
  CameraFrame frame;
  for (int k = 0; k < 5; ++k) {
    cell.device->coming = {Level(10 + k)};
    other.coming = {Level(20 + k)};
    REQUIRE(cell.Read() == CameraResult::kFrame);
    REQUIRE(second->Read(kTimeout_s, frame) == CameraResult::kFrame);
    CHECK(cell.Seen() == 10 + k);
    CHECK(frame.luma.row(0)[0] == 20 + k);
  }
  CHECK(cell.camera->identity().serial == "A1@1-2");
  CHECK(second->identity().serial == "A1@1-3");
  // The first is unplugged; the second is not disturbed and keeps its name after a reconnection.
  cell.machine.Unplug(0);
  CHECK(cell.Read() == CameraResult::kLost);
  other.coming = {Level(30)};
  CHECK(second->Read(kTimeout_s, frame) == CameraResult::kFrame);
  cell.machine.Unplug(1);
  CHECK(second->Read(kTimeout_s, frame) == CameraResult::kLost);
  FakeDevice& back = cell.machine.Plug(1, "1-3", "A1");
  back.modes = {{V4L2_PIX_FMT_GREY, kWidth, kHeight, {30}}};
  back.coming = {Level(31)};
  test::SetFakeTime(test::FakeTime() + 6);
  CHECK(second->Read(kTimeout_s, frame) == CameraResult::kFrame);
  CHECK(second->identity().serial == "A1@1-3");
}

TEST_CASE("v4l2 camera: a device not in sysfs is named by its driver and bus") {
  Cell cell;
  DeviceTree nothing = cell.machine.tree();
  nothing.sysfs += "/none";
  auto camera = std::move(V4l2Camera::Create({.device = cell.machine.Path(0), .tree = nothing},
                                             test::FakeTime))
                    .value();
  cell.device->coming = {Level(1)};
  REQUIRE(camera->Read(kTimeout_s, cell.frame) == CameraResult::kFrame);
  CHECK(camera->identity().serial == "fake@fake-bus");
}

TEST_CASE("v4l2 camera: impossible options are rejected") {
  const auto why = [](const V4l2CameraOptions& options) {
    const auto made = V4l2Camera::Create(options, test::FakeTime);
    return made ? "" : made.error();
  };
  CHECK(why({.device = "A"}).empty());
  CHECK_THAT(why({.device = ""}), Catch::Contains("plumbline cameras"));
  CHECK_THAT(why({.device = "A", .mode = {.size = {640, 0}}}),
             Catch::Contains("is not a valid size"));
  CHECK_THAT(why({.device = "A", .mode = {.rate_hz = 0}}), Catch::Contains("0.01..1000"));
  CHECK_THAT(why({.device = "A", .settings = {.exposure_s = -1.0}}), Catch::Contains("exposure"));
  CHECK_THAT(why({.device = "A", .settings = {.white_balance_K = 0.0}}), Catch::Contains("white"));
  CHECK(MakeCamera("v4l2", {.v4l2 = {.device = "A"}}));
}

TEST_CASE("v4l2 camera: the sequence continues across counter overflow and reconnection") {
  CHECK(NextSequence(7, 3, 4) == 8);
  CHECK(NextSequence(7, 3, 9) == 13);
  CHECK(NextSequence(7, 0xFFFFFFFF, 1) == 9);
  CHECK(NextSequence(7, std::nullopt, 500) == 8);
  CHECK(NextSequence(7, 0, 0) == 8);    // a driver that does not count
  CHECK(NextSequence(7, 100, 2) == 8);  // one that restarts
}

}  // namespace plumbline::v4l2_camera_test
