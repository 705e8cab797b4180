// Test on the graphics card of this computer, if it has one (modprobe vkms is enough) that no other
// program uses.
#include <catch2/catch.hpp>
#include <cstdio>
#include <filesystem>

#include "drivers/display/kms_display.h"
#include "firmware-like/image/image_size.h"

namespace plumbline::kms_kernel_test {

using namespace plumbline::display;

namespace {

class White : public DrawnPicture {
 public:
  explicit White(image::ImageSize size)
      : size_(size), pixels_(static_cast<std::size_t>(4 * size.width * size.height), 255) {}
  image::ImageSize size() const override { return size_; }
  PictureView ReadRows(int first, int count) override {
    return {pixels_.data() + 4 * first * size_.width, {size_.width, count}};
  }

 private:
  image::ImageSize size_;
  std::vector<std::uint8_t> pixels_;
};

}  // namespace

TEST_CASE("a real card shows one picture per refresh", "[kms]") {
  std::string card;
  for (int i = 0; i < 8; ++i) {
    const std::string path = "/dev/dri/card" + std::to_string(i);
    if (card.empty() && std::filesystem::exists(path)) card = path;
  }
  if (card.empty()) {
    std::puts("SKIPPED: no /dev/dri/card0; modprobe vkms makes one");
    return;
  }
  auto display = KmsDisplay::Create({.card = card}, MonotonicSeconds).value();
  if (display->Wait(1) != DisplayResult::kReady) {
    std::printf("SKIPPED: %s\n", std::string(display->problem()).c_str());
    return;
  }
  White picture(display->size());
  for (int i = 0; i < 10; ++i) {
    const DisplayResult shown = display->Show(picture);
    if (i == 0 && shown == DisplayResult::kLost) {
      std::printf("SKIPPED: %s\n", std::string(display->problem()).c_str());
      return;
    }
    REQUIRE(shown == DisplayResult::kShown);
    REQUIRE(display->Wait(1) == DisplayResult::kReady);
  }
}

}  // namespace plumbline::kms_kernel_test
