// Frames made by libdv's encoder, the other half of what decodes them; what the standard says of
// their blocks is checked here by hand.
#include "drivers/camera/dv_image.h"

#include <libdv/dv.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>

#include "drivers/camera/pixel_format.h"

using namespace plumbline;

namespace {

using Bytes = std::vector<std::uint8_t>;
constexpr ImageSize kPal{720, 576}, kNtsc{720, 480};

Bytes Encoded(ImageSize size, const std::function<int(int x, int y)>& luma, int dct = DV_DCT_AUTO) {
  const bool pal = size == kPal;
  Bytes yuyv(static_cast<std::size_t>(2 * size.width * size.height), 128);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      yuyv[static_cast<std::size_t>(2 * (y * size.width + x))] =
          static_cast<std::uint8_t>(luma(x, y));
    }
  }
  Bytes frame(pal ? 144000 : 120000);
  dv_encoder_t* const encoder = dv_encoder_new(0, 0, 0);
  encoder->isPAL = pal ? 1 : 0;
  encoder->is16x9 = 0;
  encoder->vlc_encode_passes = 3;
  encoder->static_qno = 0;
  encoder->force_dct = dct;
  std::uint8_t* planes[3] = {yuyv.data(), nullptr, nullptr};
  dv_encode_full_frame(encoder, planes, e_dv_color_yuv, frame.data());
  time_t now = 1790000000;
  dv_encode_metadata(frame.data(), pal ? 1 : 0, 0, &now, 0);
  dv_encoder_free(encoder);
  return frame;
}

RawImage Raw(const Bytes& bytes, ImageSize size) {
  return {PixelFormat::kDv, size, 0, bytes};
}

std::string WhyNot(const Bytes& bytes, ImageSize size) {
  Bytes pixels;
  const auto why = DecodeDv(bytes, size, pixels);
  return why ? why->message : "";
}

}  // namespace

TEST_CASE("DV: a picture of either standard comes back") {
  for (const ImageSize size : {kPal, kNtsc}) {
    const auto smooth = [](int x, int y) {
      return static_cast<int>(126 + 50 * std::sin(0.02 * x) + 40 * std::cos(0.015 * y));
    };
    const Bytes frame = Encoded(size, smooth);
    Bytes buffer, bgr;
    const auto luma = LumaOf(Raw(frame, size), buffer);
    REQUIRE(luma);
    REQUIRE(luma->size() == size);
    int worst = 0;
    for (int y = 0; y < size.height - 1; ++y) {
      for (int x = 0; x < size.width; ++x) {
        worst = std::max(worst, std::abs(luma->row(y)[x] - smooth(x, y)));
      }
    }
    CHECK(worst <= 4);
    CHECK_FALSE(BgrOf(Raw(frame, size), bgr));
    CHECK(bgr.size() == static_cast<std::size_t>(3 * size.width * size.height));
  }
}

TEST_CASE("DV: what moves between the fields is not torn") {
  // A bright half that moved by 40 px within 20 ms: rows of the second field have it elsewhere.
  const Bytes frame = Encoded(
      kPal, [](int x, int y) { return x < (y % 2 == 0 ? 300 : 340) ? 100 : 150; }, DV_DCT_248);
  Bytes buffer;
  const auto luma = LumaOf(Raw(frame, kPal), buffer);
  REQUIRE(luma);
  for (int y = 0; y < kPal.height; ++y) {
    INFO("row " << y);
    CHECK(int{luma->row(y)[280]} < 110);
    CHECK(int{luma->row(y)[320]} > 130);
  }
}

TEST_CASE("DV: what is no sound frame is refused, with the reason") {
  const Bytes good = Encoded(kPal, [](int x, int) { return 16 + x / 4; });
  CHECK(WhyNot(good, kPal).empty());
  CHECK(WhyNot(good, {640, 480}) == "DV of 640 x 480 px is not possible");
  CHECK_THAT(WhyNot(good, kNtsc), Catch::Contains("no DV frame"));
  Bytes bad(good.begin(), good.end() - 1);
  CHECK(WhyNot(bad, kPal) == "a short frame: 143999 bytes where 720 x 576 px DV have 144000");
  bad = good;
  std::swap_ranges(bad.begin() + 80 * 7, bad.begin() + 80 * 8, bad.begin() + 80 * 22);
  CHECK(WhyNot(bad, kPal) == "no DV frame: block 7 is not what belongs there");
  bad = good;
  bad[80 * 151 + 80 * 8 + 3] = static_cast<std::uint8_t>(bad[80 * 151 + 80 * 8 + 3] | 0xF0);
  CHECK(WhyNot(bad, kPal) == "a damaged DV frame: the camera marked block 159");
  CHECK_THAT(WhyNot(Bytes(144000, 0xFF), kPal), Catch::Contains("block 0"));
}
