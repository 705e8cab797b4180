// Displays against a fake kernel. Whether a real card behaves the same is tested by
// kms_kernel_test.cc if there is one.
#include <catch2/catch.hpp>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "drivers/display/registry.h"
#include "firmware-like/image/image_size.h"
#include "tests/drivers/display/fake_card.h"

namespace plumbline::display_device_test {

using namespace plumbline::display;

namespace {

double now_s = 0;
double Now() {
  return now_s;
}
void Pass(double seconds) {
  now_s += seconds;
}

/// Picture whose pixels encode their coordinates.
class Marked : public DrawnPicture {
 public:
  explicit Marked(image::ImageSize size, int mark = 0) : size_(size) {
    for (int v = 0; v < size.height; ++v) {
      for (int u = 0; u < size.width; ++u) {
        for (const int c : {u, v, mark, 77}) pixels_.push_back(static_cast<std::uint8_t>(c));
      }
    }
  }
  image::ImageSize size() const override { return size_; }
  PictureView ReadRows(int first, int count) override {
    return {pixels_.data() + 4 * first * size_.width, {size_.width, count}};
  }

 private:
  image::ImageSize size_;
  std::vector<std::uint8_t> pixels_;
};

std::uint32_t XrgbAt(int u, int v, int mark) {
  return static_cast<std::uint32_t>((u & 255) << 16 | (v & 255) << 8 | mark);
}

std::ptrdiff_t Descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), {});
}

/// Card memory mapped into this process.
int MappedPictures() {
  std::ifstream maps("/proc/self/maps");
  int count = 0;
  for (std::string line; std::getline(maps, line);) {
    if (line.find("memfd:dumb") != std::string::npos) ++count;
  }
  return count;
}

std::unique_ptr<Display> Kms(const test::FakeCard& card, const KmsOptions& more = {}) {
  KmsOptions options = more;
  options.card = card.path;
  return KmsDisplay::Create(options, Now, Pass).value();
}

}  // namespace

TEST_CASE("a monitor gets its mode with the first picture, and buffers alternate") {
  test::FakeCard card;
  auto display = Kms(card);
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  CHECK(display->size() == image::ImageSize{1280, 720});
  for (int mark = 1; mark < 5; ++mark) {
    Marked picture({1280, 720}, mark);
    REQUIRE(display->Show(picture) == DisplayResult::kShown);
    CHECK(display->Wait(0) == DisplayResult::kBusy);
    CHECK(display->Show(picture) == DisplayResult::kBusy);
    CHECK(card.Pixel(700, 300) != XrgbAt(700, 300, mark));  // the front buffer is not touched
    card.Refresh();
    REQUIRE(display->Wait(0) == DisplayResult::kReady);
    CHECK(card.Pixel(700, 300) == XrgbAt(700, 300, mark));
    CHECK(card.Pixel(1279, 719) == XrgbAt(1279, 719, mark));
  }
  CHECK(card.modes_set() == 1);
  CHECK(card.mode() == image::ImageSize{1280, 720});
  CHECK(card.buffers() == 2);
  display.reset();
  CHECK(card.buffers() == 0);
}

TEST_CASE("the mode of the requested size is used, otherwise the preferred one") {
  test::FakeCard card;
  auto small = Kms(card, {.card = "", .connector = "HDMI-A-1", .size = {640, 480}});
  REQUIRE(small->Wait(0) == DisplayResult::kReady);
  CHECK(small->size() == image::ImageSize{640, 480});
  small.reset();
  auto other = Kms(card, {.card = "", .connector = "", .size = {800, 600}});
  REQUIRE(other->Wait(0) == DisplayResult::kReady);
  CHECK(other->size() == image::ImageSize{1280, 720});
}

TEST_CASE("an unplugged monitor is reported and found again with another mode") {
  test::FakeCard card;
  auto display = Kms(card);
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  Marked picture({1280, 720});
  REQUIRE(display->Show(picture) == DisplayResult::kShown);
  card.connected = false;  // with a pending flip
  now_s += 0.6;
  CHECK(display->Wait(0.01) == DisplayResult::kLost);
  CHECK(std::string(display->problem()) == card.path + ", HDMI-A-1: monitor disconnected");
  CHECK(display->Show(picture) == DisplayResult::kLost);
  CHECK(display->Wait(0) == DisplayResult::kWaiting);
  now_s += 0.2;
  CHECK(display->Wait(0) == DisplayResult::kLost);
  CHECK(std::string(display->problem()) == card.path + ": no monitor connected to any of HDMI-A-1");
  card.connected = true;
  card.modes = {{640, 480}};
  now_s += 5;
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  CHECK(display->size() == image::ImageSize{640, 480});
  CHECK(display->Show(picture) == DisplayResult::kSizeMismatch);
  Marked smaller({640, 480}, 9);
  REQUIRE(display->Show(smaller) == DisplayResult::kShown);
  card.Refresh();
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  CHECK(card.mode() == image::ImageSize{640, 480});
  CHECK(card.Pixel(5, 6) == XrgbAt(5, 6, 9));
}

TEST_CASE("disconnecting a monitor a hundred times in every way leaks nothing") {
  test::FakeCard card;
  auto display = Kms(card);
  const std::ptrdiff_t descriptors = Descriptors();
  const int mapped = MappedPictures();
  for (int k = 0; k < 100; ++k) {
    now_s += 10;
    INFO("unplugged " << k << " times");
    REQUIRE(display->Wait(0) == DisplayResult::kReady);
    Marked picture(display->size(), k);
    REQUIRE(display->Show(picture) == DisplayResult::kShown);
    card.Refresh();
    REQUIRE(display->Wait(0) == DisplayResult::kReady);
    CHECK(card.Pixel(20, 10) == XrgbAt(20, 10, k));
    CHECK(card.buffers() == 2);
    const int refusals[] = {0, EACCES, ENODEV, EINVAL};
    card.refuse_commits_with = refusals[k % 4];
    if (card.refuse_commits_with != 0) {  // reported by the flip itself
      CHECK(display->Show(picture) == DisplayResult::kLost);
    } else {  // reported by the connector, with or without a pending flip
      if (k % 8 == 0) REQUIRE(display->Show(picture) == DisplayResult::kShown);
      card.connected = false;
      now_s += 0.6;
      CHECK(display->Wait(0) == DisplayResult::kLost);
      card.Refresh();
    }
    CHECK_FALSE(display->problem().empty());
    CHECK(card.buffers() == 0);
    CHECK(Descriptors() == descriptors);
    CHECK(MappedPictures() == mapped);
    card.connected = true;
    card.refuse_commits_with = 0;
  }
}

TEST_CASE("without a monitor the connectors are probed at most once a second") {
  test::FakeCard card;
  card.connected = false;
  auto display = Kms(card);
  const double start_s = now_s;
  int losses = 0;
  while (now_s < start_s + 600) losses += display->Wait(0.02) == DisplayResult::kLost ? 1 : 0;
  CHECK(losses < 610);
  CHECK(card.probes() == losses * 2);  // libdrm queries the number, then the entries
  card.connected = true;
  while (display->Wait(0.02) != DisplayResult::kReady) REQUIRE(now_s < start_s + 602);
}

TEST_CASE("a card that never completes a flip is reopened") {
  test::FakeCard card;
  auto display = Kms(card);
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  Marked picture({1280, 720});
  REQUIRE(display->Show(picture) == DisplayResult::kShown);
  now_s += 1.9;
  CHECK(display->Wait(0) == DisplayResult::kBusy);
  now_s += 0.2;
  CHECK(display->Wait(0) == DisplayResult::kLost);
  now_s += 5;
  CHECK(display->Wait(0) == DisplayResult::kReady);
  CHECK(display->Show(picture) == DisplayResult::kShown);
}

TEST_CASE("errors of a card are reported with the remedy") {
  test::FakeCard card;
  auto display = Kms(card);
  Marked picture({1280, 720});
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  card.refuse_commits_with = EBUSY;
  CHECK(display->Show(picture) == DisplayResult::kBusy);
  card.refuse_commits_with = EACCES;
  CHECK(display->Show(picture) == DisplayResult::kLost);
  CHECK(std::string(display->problem()).find("Stop the desktop") != std::string::npos);
  card.atomic = false;
  now_s += 5;
  CHECK(display->Wait(0) == DisplayResult::kLost);
  CHECK(std::string(display->problem()).find("no atomic mode setting") != std::string::npos);
  card.atomic = true;
  auto elsewhere = Kms(card, {.card = "", .connector = "DP-2"});
  CHECK(elsewhere->Wait(0) == DisplayResult::kLost);
  CHECK(std::string(elsewhere->problem()) ==
        card.path + ": no monitor connected to DP-2; the card has HDMI-A-1");
  auto missing = KmsDisplay::Create({.card = "/nowhere/card9"}, Now, Pass).value();
  CHECK(missing->Wait(0) == DisplayResult::kLost);
  CHECK(std::string(missing->problem()).find("/nowhere/card9: cannot be opened") == 0);
}

namespace {

fb_var_screeninfo ScreenInfo(unsigned width, unsigned height, unsigned bits) {
  fb_var_screeninfo var{};
  var.xres = width;
  var.yres = height;
  var.bits_per_pixel = bits;
  const bool wide = bits == 32;
  var.red = {wide ? 16U : 11U, wide ? 8U : 5U, 0};
  var.green = {wide ? 8U : 5U, wide ? 8U : 6U, 0};
  var.blue = {0, wide ? 8U : 5U, 0};
  return var;
}

std::unique_ptr<Display> Framebuffer(const test::FakeFramebuffer& device) {
  return FramebufferDisplay::Create({.device = device.path}, Now, Pass).value();
}

}  // namespace

TEST_CASE("a framebuffer holds the picture in its visible part; 16-bit colours are rounded") {
  constexpr std::size_t kStride = 4 * 70;
  fb_var_screeninfo var = ScreenInfo(64, 48, 32);
  var.yoffset = 3;
  test::FakeFramebuffer device(var, kStride, kStride * 60);
  auto display = Framebuffer(device);
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  CHECK(display->size() == image::ImageSize{64, 48});
  Marked picture({64, 48}, 200);
  REQUIRE(display->Show(picture) == DisplayResult::kShown);
  const std::vector<std::uint8_t> bytes = device.Bytes();
  std::uint32_t pixel = 0;
  std::memcpy(&pixel, bytes.data() + (3 + 40) * kStride + 4 * 17, 4);
  CHECK(pixel == XrgbAt(17, 40, 200));
  CHECK(bytes[2 * kStride] == 0);           // above
  CHECK(bytes[3 * kStride + 4 * 64] == 0);  // beside
  CHECK(bytes[(3 + 48) * kStride] == 0);    // below

  device.var = ScreenInfo(64, 48, 16);  // the mode changes while in use
  device.fix.line_length = 128;
  now_s += 1;
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  REQUIRE(display->Show(picture) == DisplayResult::kShown);
  std::uint16_t word = 0;
  std::memcpy(&word, device.Bytes().data() + 40 * 128 + 2 * 17, 2);
  CHECK(word ==
        ((17 * 31 + 127) / 255 << 11 | (40 * 63 + 127) / 255 << 5 | (200 * 31 + 127) / 255));
}

TEST_CASE("a framebuffer keeps its rate, and is reopened after a loss") {
  test::FakeFramebuffer device(ScreenInfo(32, 20, 32), 128, 128 * 20);
  auto display = Framebuffer(device);
  REQUIRE(display->Wait(0) == DisplayResult::kReady);
  Marked picture({32, 20}), other({32, 21});
  CHECK(display->Show(other) == DisplayResult::kSizeMismatch);
  REQUIRE(display->Show(picture) == DisplayResult::kShown);
  CHECK(display->Wait(0.001) == DisplayResult::kBusy);
  CHECK(display->Wait(0.1) == DisplayResult::kReady);
  device.gone = true;
  CHECK(display->Wait(0) == DisplayResult::kLost);
  CHECK(std::string(display->problem()).find("was lost") != std::string::npos);
  CHECK(display->Show(picture) == DisplayResult::kLost);
  CHECK(display->Wait(0) == DisplayResult::kWaiting);
  device.gone = false;
  now_s += 6;
  CHECK(display->Wait(0) == DisplayResult::kReady);
}

TEST_CASE("losing a framebuffer a hundred times leaks nothing") {
  test::FakeFramebuffer device(ScreenInfo(32, 20, 32), 128, 128 * 20);
  auto display = Framebuffer(device);
  const std::ptrdiff_t descriptors = Descriptors();
  for (int k = 0; k < 100; ++k) {
    now_s += 10;
    REQUIRE(display->Wait(0) == DisplayResult::kReady);
    Marked picture({32, 20}, k);
    REQUIRE(display->Show(picture) == DisplayResult::kShown);
    device.gone = true;
    now_s += 1;
    CHECK(display->Wait(0) == DisplayResult::kLost);
    CHECK(Descriptors() == descriptors);
    device.gone = false;
  }
}

TEST_CASE("invalid framebuffers are rejected with the reason") {
  const auto refusal = [](const fb_var_screeninfo& var, std::size_t stride, std::size_t bytes) {
    test::FakeFramebuffer device(var, stride, bytes);
    auto display = Framebuffer(device);
    CHECK(display->Wait(0) == DisplayResult::kLost);
    return std::string(display->problem());
  };
  fb_var_screeninfo var = ScreenInfo(64, 48, 32);
  CHECK(refusal(var, 256, 256 * 47).find("exceed its memory") != std::string::npos);
  CHECK(refusal(var, 255, 256 * 48).find("exceed its memory") != std::string::npos);
  CHECK(refusal(ScreenInfo(64, 48, 8), 64, 64 * 48).find("8 bits") != std::string::npos);
  var.red.offset = 28;
  CHECK(refusal(var, 256, 256 * 48).find("colours") != std::string::npos);
  var = ScreenInfo(64, 48, 32);
  var.yoffset = 4000000000U;
  CHECK(refusal(var, 256, 256 * 48).find("exceed its memory") != std::string::npos);
}

TEST_CASE("NoDisplay becomes ready at its rate") {
  auto display = NoDisplay::Create({.size = {640, 480}, .rate_hz = 10}, Now, Pass).value();
  Marked picture({640, 480});
  const double start_s = now_s;
  int shown = 0;
  while (now_s < start_s + 2) {
    if (display->Wait(0.03) == DisplayResult::kReady &&
        display->Show(picture) == DisplayResult::kShown) {
      ++shown;
    }
  }
  CHECK(shown == Approx(20).margin(1));
  CHECK_FALSE(NoDisplay::Create({.size = {640, 0}}, Now, Pass).ok());
  CHECK_FALSE(NoDisplay::Create({.rate_hz = 0}, Now, Pass).ok());
}

TEST_CASE("displays are created by kind") {
  for (const char* const kind : {"kms", "framebuffer", "none"}) CHECK(MakeDisplay(kind, {}).ok());
  const auto unknown = MakeDisplay("wayland", {});
  REQUIRE_FALSE(unknown.ok());
  CHECK(unknown.error() == "display \"wayland\" is not one of kms, framebuffer, none");
}

}  // namespace plumbline::display_device_test
