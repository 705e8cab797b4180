#include "drivers/camera/pixel_format.h"

#include <linux/videodev2.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "firmware-like/image/image_size.h"

namespace plumbline::pixel_format_test {

using namespace plumbline::camera;

namespace {

using Bytes = std::vector<std::uint8_t>;

/// A colour image without sharp edges, blue, green, red.
cv::Mat Colours(int width, int height) {
  cv::Mat image(height, width, CV_8UC3);
  for (int v = 0; v < height; ++v) {
    for (int x = 0; x < width; ++x) {
      image.at<cv::Vec3b>(v, x) = {static_cast<unsigned char>(40 + 160 * x / width),
                                   static_cast<unsigned char>(60 + 120 * v / height),
                                   static_cast<unsigned char>(200 - 130 * x / width)};
    }
  }
  return image;
}

Bytes Jpeg(const cv::Mat& image, const std::vector<int>& how = {cv::IMWRITE_JPEG_QUALITY, 95}) {
  Bytes bytes;
  cv::imencode(".jpg", image, bytes, how);
  return bytes;
}

/// A JPEG file without its Huffman tables, as cameras send Motion JPEG.
Bytes WithoutTables(const Bytes& jpeg) {
  Bytes out(jpeg.begin(), jpeg.begin() + 2);
  std::size_t at = 2;
  while (jpeg[at + 1] != 0xDA) {
    const std::size_t length = 2 + 256U * jpeg[at + 2] + jpeg[at + 3];
    if (jpeg[at + 1] != 0xC4) out.insert(out.end(), jpeg.data() + at, jpeg.data() + at + length);
    at += length;
  }
  out.insert(out.end(), jpeg.data() + at, jpeg.data() + jpeg.size());
  return out;
}

RawImage Raw(PixelFormat format, image::ImageSize size, std::ptrdiff_t stride, const Bytes& bytes) {
  return {format, size, stride, bytes};
}

std::string FaultOf(const RawImage& image) {
  Bytes buffer;
  const auto luma = LumaOf(image, buffer);
  return luma ? "" : luma.error();
}

}  // namespace

TEST_CASE("pixel formats: names match the kernel's four-character codes") {
  CHECK(FourccOf(PixelFormat::kGrey) == V4L2_PIX_FMT_GREY);
  CHECK(FourccOf(PixelFormat::kNv12) == V4L2_PIX_FMT_NV12);
  CHECK(FourccOf(PixelFormat::kYuyv) == V4L2_PIX_FMT_YUYV);
  CHECK(FourccOf(PixelFormat::kUyvy) == V4L2_PIX_FMT_UYVY);
  CHECK(FourccOf(PixelFormat::kMjpeg) == V4L2_PIX_FMT_MJPEG);
  CHECK(PixelFormatOfFourcc(V4L2_PIX_FMT_MJPEG) == PixelFormat::kMjpeg);
  CHECK(FourccOf(PixelFormat::kDv) == V4L2_PIX_FMT_DV);
  CHECK_FALSE(PixelFormatOfFourcc(V4L2_PIX_FMT_H264));
  CHECK(FourccText(V4L2_PIX_FMT_DV) == "dvsd");
  CHECK(FourccText(0x01020304) == "????");
}

TEST_CASE("luma: grey and NV12 refer to the memory of the camera, including padding") {
  Bytes buffer;
  const Bytes bytes(60, 7);
  for (const PixelFormat format : {PixelFormat::kGrey, PixelFormat::kNv12}) {
    const auto luma = LumaOf(Raw(format, {8, 4}, 10, bytes), buffer);
    REQUIRE(luma);
    CHECK(luma->data == bytes.data());
    CHECK(luma->stride == 10);
    CHECK(luma->size() == image::ImageSize{8, 4});
  }
  CHECK(buffer.empty());
}

TEST_CASE("luma: every second byte of YUYV and UYVY") {
  const Bytes bytes = {1, 101, 2, 102, 3, 103, 4, 104, 0, 0, 5, 105, 6, 106, 7, 107, 8, 108};
  Bytes buffer;
  const auto yuyv = LumaOf(Raw(PixelFormat::kYuyv, {4, 2}, 10, bytes), buffer);
  REQUIRE(yuyv);
  CHECK(buffer == Bytes{1, 2, 3, 4, 5, 6, 7, 8});
  CHECK(yuyv->stride == 4);
  const auto uyvy = LumaOf(Raw(PixelFormat::kUyvy, {4, 2}, 10, bytes), buffer);
  REQUIRE(uyvy);
  CHECK(buffer == Bytes{101, 102, 103, 104, 105, 106, 107, 108});
}

TEST_CASE("luma: short frames and impossible sizes and strides are rejected") {
  const Bytes bytes(100);
  CHECK(FaultOf(Raw(PixelFormat::kGrey, {10, 10}, 10, bytes)).empty());
  CHECK_THAT(FaultOf(Raw(PixelFormat::kGrey, {10, 11}, 10, bytes)),
             Catch::Contains("a short frame: 100 bytes, but 10 x 11 px in GREY need 110"));
  CHECK_THAT(FaultOf(Raw(PixelFormat::kNv12, {10, 8}, 10, bytes)), Catch::Contains("need 120"));
  CHECK_THAT(FaultOf(Raw(PixelFormat::kYuyv, {10, 6}, 20, bytes)), Catch::Contains("need 120"));
  for (const image::ImageSize size :
       {image::ImageSize{0, 4}, {4, 0}, {-4, 4}, {1 << 30, 1 << 30}}) {
    CHECK_THAT(FaultOf(Raw(PixelFormat::kGrey, size, 1 << 30, bytes)),
               Catch::Contains("not possible"));
  }
  CHECK_THAT(FaultOf(Raw(PixelFormat::kYuyv, {3, 2}, 8, bytes)), Catch::Contains("not possible"));
  CHECK_THAT(FaultOf(Raw(PixelFormat::kNv12, {4, 3}, 4, bytes)), Catch::Contains("not possible"));
  for (const std::ptrdiff_t stride : {std::ptrdiff_t{9}, std::ptrdiff_t{-10}, PTRDIFF_MAX}) {
    CHECK_THAT(FaultOf(Raw(PixelFormat::kGrey, {10, 2}, stride, bytes)),
               Catch::Contains("a stride of"));
  }
}

TEST_CASE(
    "JPEG: luma as decoded by OpenCV, with and without Huffman tables, and with trailing bytes") {
  const cv::Mat image = Colours(96, 64);
  const Bytes jpeg = Jpeg(image);
  const cv::Mat expected = cv::imdecode(jpeg, cv::IMREAD_GRAYSCALE);
  Bytes littered = jpeg;
  littered.insert(littered.end(), 500, 0);  // as from a driver that reports the size of its buffer
  for (const Bytes& bytes : {jpeg, WithoutTables(jpeg), littered}) {
    Bytes buffer;
    const auto luma = LumaOf(Raw(PixelFormat::kMjpeg, {96, 64}, 0, bytes), buffer);
    REQUIRE(luma);
    const cv::Mat seen(64, 96, CV_8U, buffer.data());
    CHECK(cv::norm(seen, expected, cv::NORM_INF) == 0);
  }
  CHECK(WithoutTables(jpeg).size() < jpeg.size());
}

TEST_CASE("JPEG: garbage, truncation, damage, progressive coding and another size are rejected") {
  const Bytes jpeg = Jpeg(Colours(96, 64));
  const auto fault = [](const Bytes& bytes) {
    return FaultOf(Raw(PixelFormat::kMjpeg, {96, 64}, 0, bytes));
  };
  CHECK(fault(jpeg).empty());
  CHECK(fault({}) == "an empty frame");
  CHECK_THAT(fault(Bytes(5000, 0x5A)), Catch::Contains("damaged JPEG"));
  CHECK_THAT(fault({0xFF, 0xD8, 0xFF, 0xD9}), Catch::Contains("JPEG"));
  for (std::size_t keep = jpeg.size() - 3; keep > 2; keep = keep * 2 / 3) {
    INFO(keep);
    CHECK_FALSE(fault(Bytes(jpeg.data(), jpeg.data() + keep)).empty());
  }
  CHECK_THAT(fault(Jpeg(Colours(64, 96))),
             Catch::Contains("a JPEG of 64 x 96 px instead of the negotiated 96 x 64"));
  CHECK_THAT(fault(Jpeg(Colours(96, 64), {cv::IMWRITE_JPEG_PROGRESSIVE, 1})),
             Catch::Contains("not a baseline JPEG"));
  Bytes torn = jpeg;  // a packet in the middle is missing
  torn.erase(torn.begin() + static_cast<std::ptrdiff_t>(torn.size() * 2 / 3),
             torn.begin() + static_cast<std::ptrdiff_t>(torn.size() * 3 / 4));
  CHECK_FALSE(fault(torn).empty());
}

TEST_CASE("BGR: every format converts to the same colours as with OpenCV") {
  const image::ImageSize size{96, 64};
  const cv::Mat image = Colours(size.width, size.height);
  // Chroma that is the same for two pixels, from OpenCV's 4:2:0: Y, then U, then V.
  cv::Mat planes;
  cv::cvtColor(image, planes, cv::COLOR_BGR2YUV_I420);
  const std::uint8_t* y = planes.data;
  const std::uint8_t* u = y + 6144;
  const std::uint8_t* v = u + 1536;
  Bytes nv12(y, u), yuyv, uyvy;
  for (int i = 0; i < 48 * 32; ++i) nv12.insert(nv12.end(), {u[i], v[i]});
  for (int row = 0; row < 64; ++row) {
    for (int x = 0; x < 96; x += 2) {
      const std::uint8_t* pair = planes.ptr(row) + x;
      const int chroma = row / 2 * 48 + x / 2;
      yuyv.insert(yuyv.end(), {pair[0], u[chroma], pair[1], v[chroma]});
      uyvy.insert(uyvy.end(), {u[chroma], pair[0], v[chroma], pair[1]});
    }
  }
  cv::Mat expected;
  cv::cvtColor(planes, expected, cv::COLOR_YUV2BGR_I420);
  Bytes bgr;
  const auto difference = [&](const RawImage& raw, const cv::Mat& to) {
    if (const auto made = BgrOf(raw, bgr); !made) FAIL(made.error());
    return cv::norm(cv::Mat(64, 96, CV_8UC3, bgr.data()), to, cv::NORM_INF);
  };
  CHECK(difference(Raw(PixelFormat::kNv12, size, 96, nv12), expected) <= 2);
  CHECK(difference(Raw(PixelFormat::kYuyv, size, 192, yuyv), expected) <= 2);
  CHECK(difference(Raw(PixelFormat::kUyvy, size, 192, uyvy), expected) <= 2);
  const Bytes jpeg = Jpeg(image);
  CHECK(difference(Raw(PixelFormat::kMjpeg, size, 0, jpeg), cv::imdecode(jpeg, cv::IMREAD_COLOR)) ==
        0);
  const Bytes grey(y, u);
  cv::cvtColor(cv::Mat(64, 96, CV_8U, const_cast<std::uint8_t*>(y)), expected, cv::COLOR_GRAY2BGR);
  CHECK(difference(Raw(PixelFormat::kGrey, size, 96, grey), expected) == 0);
  CHECK_FALSE(BgrOf(Raw(PixelFormat::kGrey, size, 96, Bytes(10)), bgr));

  // Pure red by ITU-R BT.601 of limited range: Y 81, U 90, V 240. Padding behind each row.
  const auto is_red = [&](const RawImage& raw) {
    if (const auto made = BgrOf(raw, bgr); !made) FAIL(made.error());
    for (std::size_t i = 0; i < bgr.size(); i += 3) {
      if (bgr[i] > 3 || bgr[i + 1] > 3 || bgr[i + 2] < 252) return false;
    }
    return bgr.size() == 24;
  };
  CHECK(is_red(Raw(PixelFormat::kNv12, {4, 2}, 5,
                   {81, 81, 81, 81, 0, 81, 81, 81, 81, 0, 90, 240, 90, 240})));
  CHECK(is_red(Raw(PixelFormat::kYuyv, {4, 2}, 9,
                   {81, 90, 81, 240, 81, 90, 81, 240, 0, 81, 90, 81, 240, 81, 90, 81, 240})));
  CHECK(is_red(Raw(PixelFormat::kUyvy, {4, 2}, 9,
                   {90, 81, 240, 81, 90, 81, 240, 81, 0, 90, 81, 240, 81, 90, 81, 240, 81})));
}

}  // namespace plumbline::pixel_format_test
