// HID and GPIO against virtual kernel devices, if available; and the zoom of the camera named by
// $PLUMBLINE_V4L2_ZOOM.
#include <fcntl.h>
#include <linux/uhid.h>
#include <poll.h>
#include <unistd.h>

#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <thread>

#include "drivers/zoom/gpio_zoom.h"
#include "drivers/zoom/hid_zoom.h"
#include "drivers/zoom/v4l2_zoom.h"

namespace plumbline::kernel_device_test {

using namespace plumbline::zoom;

namespace {

constexpr int kVendor = 0xF00D, kProduct = 0x2F01;
constexpr double kPatience_s = 5;

/// A vendor report 0x01 in (4 bytes) and 0x02 out (1 byte).
constexpr std::uint8_t kDescriptor[] = {
    0x06, 0x00, 0xFF,        // usage page: vendor
    0x09, 0x01, 0xA1, 0x01,  // collection
    0x85, 0x01, 0x09, 0x02, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x04, 0x81, 0x02, 0x85,
    0x02, 0x09, 0x03, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08, 0x95, 0x01, 0x91, 0x02, 0xC0};

/// HID device created through uhid; answers every output report with `answer`.
class UhidLens {
 public:
  explicit UhidLens(std::vector<std::uint8_t> answer)
      : fd_(open("/dev/uhid", O_RDWR | O_CLOEXEC)), answer_(std::move(answer)) {
    uhid_event event{};
    event.type = UHID_CREATE2;
    std::strcpy(reinterpret_cast<char*>(event.u.create2.name), "plumbline test lens");
    std::memcpy(event.u.create2.rd_data, kDescriptor, sizeof kDescriptor);
    event.u.create2.rd_size = sizeof kDescriptor;
    event.u.create2.bus = 0x03;
    event.u.create2.vendor = kVendor;
    event.u.create2.product = kProduct;
    Write(event);
    thread_ = std::thread([this] { Run(); });
  }
  UhidLens(const UhidLens&) = delete;
  UhidLens& operator=(const UhidLens&) = delete;
  ~UhidLens() {
    stop_ = true;
    thread_.join();
    close(fd_);  // removes the device
  }

 private:
  void Run() {
    while (!stop_) {
      pollfd wait{.fd = fd_, .events = POLLIN, .revents = 0};
      if (poll(&wait, 1, 20) <= 0) continue;
      uhid_event event{};
      if (read(fd_, &event, sizeof event) <= 0 || event.type != UHID_OUTPUT) continue;
      uhid_event input{};
      input.type = UHID_INPUT2;
      std::copy(answer_.begin(), answer_.end(), input.u.input2.data);
      input.u.input2.size = static_cast<std::uint16_t>(answer_.size());
      Write(input);
    }
  }
  void Write(const uhid_event& event) const {
    if (write(fd_, &event, sizeof event) < 0) std::abort();
  }

  int fd_;
  std::vector<std::uint8_t> answer_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

HidOptions LensOptions() {
  HidOptions options;
  options.profile.name = "test lens";
  options.profile.vendor_id = kVendor;
  options.profile.product_id = kProduct;
  HidExchange exchange;
  exchange.send = {{0x02, 0x55}};
  exchange.answer_id = 0x01;
  exchange.answer_bytes = 5;
  exchange.fields = {HidField{HidField::Meaning::kZoomCounts, 1, 2, true, false, 0xFFFFFFFF}};
  options.profile.exchanges = {exchange};
  options.timeout_s = kPatience_s;
  return options;
}

/// Reads until `done` accepts the result, for at most 20 s: an emulated computer is slow.
template <typename Done>
ZoomResult ReadUntil(ZoomSensor& sensor, lens::ZoomReading& reading, const Done& done) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
  ZoomResult result = ZoomResult::kWaiting;
  while (std::chrono::steady_clock::now() < end) {
    result = sensor.Read(reading);
    if (done(result)) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return result;
}

/// Reads until the line's motion is seen. The kernel delivers an edge some time after it was
/// caused.
ZoomResult ReadUntilMoved(ZoomSensor& sensor, lens::ZoomReading& reading) {
  return ReadUntil(sensor, reading,
                   [&](ZoomResult result) { return result == ZoomResult::kOk && reading.moved; });
}

}  // namespace

TEST_CASE("HID: a missing device is reported with the remedy", "[uhid-absent]") {
  auto sensor = HidZoom::Create(LensOptions(), MonotonicSeconds);
  REQUIRE(sensor);
  lens::ZoomReading reading;
  CHECK(sensor.value()->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(sensor.value()->problem()), Catch::Contains("F00D:2F01"));
  CHECK_THAT(std::string(sensor.value()->problem()), Catch::Contains("udev rule"));
  HidOptions unsound = LensOptions();
  unsound.profile.exchanges.clear();
  CHECK_FALSE(HidZoom::Create(unsound, MonotonicSeconds).ok());
  HidOptions hasty = LensOptions();
  hasty.timeout_s = 0;
  CHECK_FALSE(HidZoom::Create(hasty, MonotonicSeconds).ok());
}

TEST_CASE("GPIO: a missing chip is reported, invalid settings are rejected", "[gpio-absent]") {
  auto sensor = GpioZoom::Create({.chip = "no-such-chip"}, MonotonicSeconds);
  REQUIRE(sensor);
  lens::ZoomReading reading;
  CHECK(sensor.value()->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(sensor.value()->problem()), Catch::Contains("gpiodetect"));
  CHECK(sensor.value()->Read(reading) == ZoomResult::kWaiting);
  CHECK_FALSE(GpioZoom::Create({.chip = "x", .line = -1}, MonotonicSeconds).ok());
  CHECK_FALSE(GpioZoom::Create({.chip = "x", .debounce_s = 2}, MonotonicSeconds).ok());
}

TEST_CASE("HID: request and answer, a short report, unplugged and replugged", "[uhid]") {
  if (access("/dev/uhid", R_OK | W_OK) != 0) {
    std::cout << "SKIPPED: no /dev/uhid\n";
    return;
  }
  auto sensor = std::move(HidZoom::Create(LensOptions(), MonotonicSeconds)).value();
  lens::ZoomReading reading;
  {
    const UhidLens lens({0x01, 0x12, 0x34, 0, 0});
    const auto read = [](ZoomResult result) { return result == ZoomResult::kOk; };
    REQUIRE(ReadUntil(*sensor, reading, read) == ZoomResult::kOk);
    CHECK(reading.zoom_counts == 0x1234);
  }
  CHECK(sensor->Read(reading) == ZoomResult::kLost);
  {
    const UhidLens lens({0x01, 0x12});
    // A kernel may drop reports that are shorter than declared, as Linux 6.1 of Debian 12 does now.
    const auto refused = [](ZoomResult result) {
      return result == ZoomResult::kProtocol || result == ZoomResult::kTimeout;
    };
    CHECK(refused(ReadUntil(*sensor, reading, [&](ZoomResult result) {
      return result == ZoomResult::kOk || refused(result);
    })));
  }
}

TEST_CASE("GPIO: pulses of a simulated line", "[gpio-sim]") {
  namespace fs = std::filesystem;
  const fs::path chip = "/sys/kernel/config/gpio-sim/plumbline-" + std::to_string(getpid());
  std::error_code failed;
  if (!fs::create_directories(chip / "bank0", failed) || failed) {
    std::cout << "SKIPPED: no gpio-sim\n";
    return;
  }
  const auto put = [](const fs::path& path, const char* text) { std::ofstream(path) << text; };
  const auto get = [](const fs::path& path) {
    std::string text;
    std::ifstream(path) >> text;
    return text;
  };
  put(chip / "bank0/num_lines", "2");
  put(chip / "live", "1");
  const std::string name = get(chip / "bank0/chip_name");
  const fs::path pull =
      fs::path("/sys/devices/platform") / get(chip / "dev_name") / name / "sim_gpio1/pull";
  {
    auto sensor = std::move(GpioZoom::Create({.chip = name, .line = 1}, MonotonicSeconds)).value();
    lens::ZoomReading reading;
    REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
    CHECK(reading.moved);  // earlier motion is unknown
    REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
    CHECK_FALSE(reading.moved);
    put(pull, "pull-up");
    REQUIRE(ReadUntilMoved(*sensor, reading) == ZoomResult::kOk);
    CHECK(reading.moved);
    CHECK(reading.motion == lens::LensMotion::kMoving);
    put(pull, "pull-down");
    bool moved = false;
    ReadUntil(*sensor, reading, [&](ZoomResult result) {
      moved = moved || reading.moved;
      return result == ZoomResult::kOk && reading.motion == lens::LensMotion::kSettled;
    });
    CHECK(moved);
    CHECK(reading.motion == lens::LensMotion::kSettled);
    REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
    CHECK_FALSE(reading.moved);
  }
  put(chip / "live", "0");
  fs::remove(chip / "bank0");
  fs::remove(chip);
}

TEST_CASE("V4L2: the zoom of a real camera", "[v4l2]") {
  const char* device = std::getenv("PLUMBLINE_V4L2_ZOOM");
  if (device == nullptr) {
    std::cout << "SKIPPED: no $PLUMBLINE_V4L2_ZOOM\n";
    return;
  }
  auto sensor = std::move(V4l2Zoom::Create({.device = device}, MonotonicSeconds)).value();
  lens::ZoomReading reading;
  const ZoomResult result = sensor->Read(reading);
  INFO(sensor->problem());
  REQUIRE(result == ZoomResult::kOk);
  CHECK(reading.zoom_counts);
}

}  // namespace plumbline::kernel_device_test
