#include "drivers/camera/v4l2_modes.h"

#include <linux/videodev2.h>

#include <catch2/catch.hpp>

#include "firmware-like/image/image_size.h"

namespace plumbline::v4l2_modes_test {

using namespace plumbline::camera;

namespace {

V4l2Mode Discrete(std::uint32_t fourcc, image::ImageSize size, std::vector<double> rates_hz) {
  return {fourcc, size, size, {1, 1}, std::move(rates_hz)};
}

/// A typical USB 2 camera: large raw frames are slow.
std::vector<V4l2Mode> Webcam() {
  return {Discrete(V4L2_PIX_FMT_H264, {3840, 2160}, {30}),
          Discrete(V4L2_PIX_FMT_MJPEG, {1920, 1080}, {30, 15}),
          Discrete(V4L2_PIX_FMT_MJPEG, {640, 480}, {30}),
          Discrete(V4L2_PIX_FMT_YUYV, {1920, 1080}, {5}),
          Discrete(V4L2_PIX_FMT_YUYV, {1280, 720}, {10, 5}),
          Discrete(V4L2_PIX_FMT_YUYV, {640, 480}, {60, 29.97, 15})};
}

std::string Chosen(const std::vector<V4l2Mode>& modes, const ModeRequest& request) {
  const auto choice = ChooseMode(modes, request);
  return choice ? ModeText(choice->format, choice->size, choice->rate_hz) : choice.error();
}

}  // namespace

TEST_CASE("mode: the preferred format that is fast enough, at the slowest sufficient rate") {
  CHECK(Chosen(Webcam(), {.size = {640, 480}}) == "YUYV 640x480@29.97");
  CHECK(Chosen(Webcam(), {.size = {640, 480}, .rate_hz = 30}) == "YUYV 640x480@29.97");
  CHECK(Chosen(Webcam(), {.size = {640, 480}, .rate_hz = 50}) == "YUYV 640x480@60");
  CHECK(Chosen(Webcam(), {.size = {1920, 1080}}) == "MJPG 1920x1080@30");
  CHECK(Chosen(Webcam(), {.size = {1920, 1080}, .rate_hz = 5}) == "YUYV 1920x1080@5");
  CHECK(Chosen(Webcam(), {}) == "MJPG 1920x1080@30");
  CHECK(Chosen(Webcam(), {.rate_hz = 40}) == "YUYV 640x480@60");
}

TEST_CASE("mode: the fastest if none is fast enough") {
  CHECK(Chosen(Webcam(), {.size = {1920, 1080}, .rate_hz = 100}) == "MJPG 1920x1080@30");
  CHECK(Chosen(Webcam(), {.rate_hz = 100}) == "YUYV 640x480@60");
  CHECK(Chosen(Webcam(), {.size = {1280, 720}}) == "YUYV 1280x720@10");
}

TEST_CASE("mode: only the requested formats, in the requested order") {
  const std::vector<PixelFormat> jpeg = {PixelFormat::kMjpeg};
  CHECK(Chosen(Webcam(), {.size = {640, 480}, .formats = jpeg}) == "MJPG 640x480@30");
  CHECK(Chosen(Webcam(),
               {.size = {640, 480}, .formats = {PixelFormat::kMjpeg, PixelFormat::kYuyv}}) ==
        "MJPG 640x480@30");
  CHECK_THAT(Chosen(Webcam(), {.size = {1280, 720}, .formats = jpeg}),
             Catch::Contains("no 1280 x 720 px in a supported format; the camera offers H264"));
  CHECK_THAT(Chosen({}, {}), Catch::StartsWith("no supported format; the camera offers nothing"));
}

TEST_CASE("mode: unsupported formats are reported with the remedy") {
  struct Case {
    std::uint32_t fourcc;
    const char *name, *remedy;
  };
  for (const Case& one : {Case{V4L2_PIX_FMT_H264, "H264 720x576", "Motion JPEG or raw"},
                          {V4L2_PIX_FMT_SRGGB8, "RGGB 720x576", "monochrome"},
                          {V4L2_PIX_FMT_Y16, "Y16  720x576", "8 bits"}}) {
    for (const image::ImageSize size : {image::ImageSize{}, {720, 576}}) {
      const std::string error = Chosen({Discrete(one.fourcc, {720, 576}, {25})}, {.size = size});
      CHECK_THAT(error, Catch::Contains(std::string("offers ") + one.name) &&
                            Catch::Contains("supported are GREY, NV12, YUYV, UYVY, MJPG, dvsd") &&
                            Catch::Contains(one.remedy));
    }
  }
  // If another size would do, the message does not name the supported formats.
  CHECK_THAT(Chosen(Webcam(), {.size = {1280, 1024}}), !Catch::Contains("supported are"));
}

TEST_CASE("mode: DV if nothing else is supported, at its own size and rate") {
  const V4l2Mode tape{.fourcc = V4L2_PIX_FMT_DV};
  const V4l2Mode film = Discrete(V4L2_PIX_FMT_H264, {1920, 1080}, {30});
  CHECK(Chosen({film, tape}, {}) == "dvsd 0x0");
  CHECK(Chosen({tape}, {.size = {640, 480}, .rate_hz = 60}) == "dvsd 0x0");
  std::vector<V4l2Mode> both = Webcam();
  both.push_back(tape);
  CHECK(Chosen(both, {}) == "MJPG 1920x1080@30");
  CHECK_THAT(Chosen(both, {.size = {1280, 1024}}), Catch::Contains("no 1280 x 1024"));
  CHECK(Chosen(both, {.formats = {PixelFormat::kDv}}) == "dvsd 0x0");
  CHECK_THAT(Chosen({tape}, {.formats = {PixelFormat::kGrey}}),
             Catch::Contains("the camera offers dvsd"));
}

TEST_CASE("mode: a range of sizes, and a camera that reports no rate") {
  const V4l2Mode range{V4L2_PIX_FMT_GREY, {160, 120}, {1920, 1200}, {16, 8}, {}};
  CHECK(Chosen({range}, {}) == "GREY 1920x1200");
  CHECK(Chosen({range}, {.size = {640, 480}}) == "GREY 640x480");
  CHECK_THAT(Chosen({range}, {.size = {650, 480}}), Catch::Contains("no 650 x 480"));
  CHECK_THAT(Chosen({range}, {.size = {2000, 1200}}), Catch::Contains("offers GREY 1920x1200"));
}

}  // namespace plumbline::v4l2_modes_test
