// HID gauge against a fake device: hidapi's functions and the grab are replaced by the linker
// (--wrap). Time passes only while the driver waits.
#include <fcntl.h>
#include <hidapi/hidapi.h>
#include <linux/input.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <cstdarg>
#include <deque>
#include <filesystem>
#include <fstream>
#include <vector>

#include "drivers/gauge/gauge.h"

using namespace plumbline;

using namespace plumbline::gauge;

namespace {

namespace fs = std::filesystem;

using Bytes = std::vector<std::uint8_t>;

struct Device {
  bool present = true, keyboard = true, grab_allowed = true;
  std::deque<Bytes> waiting;
  int opened = 0, grabs = 0;
  double now_s = 1000;
};
Device device;
int handle = 0;

double Now() {
  return device.now_s;
}

/// A hidraw device with one input device, as the kernel lists them.
hid::InputFolders Folders() {
  const fs::path root = fs::temp_directory_path() / ("plumbline_hid_" + std::to_string(getpid()));
  const fs::path event = root / "hidraw/hidraw7/device/input/input9/event3";
  fs::create_directories(event);
  fs::create_directories(root / "input");
  std::ofstream(root / "input/event3") << "";
  return {(root / "hidraw").string(), (root / "input").string()};
}

Gauge GaugeOf(const char* format) {
  GaugeOptions options;
  options.kind = GaugeKind::kHid;
  options.hid = {0x0FE7, 0x4001, ""};
  options.format = FindGaugeFormat(format);
  return Gauge(options, std::make_unique<HidPort>(options.hid, Folders()), Now);
}

void Type(const std::vector<std::uint8_t>& keys) {
  for (const std::uint8_t key : keys) {
    device.waiting.push_back({0, 0, key, 0, 0, 0, 0, 0});
    device.waiting.push_back({0, 0, 0, 0, 0, 0, 0, 0});
  }
}

void Settle(Gauge& gauge) {
  double reading_m = 0;
  for (int k = 0; k < 5; ++k) REQUIRE(gauge.Read(0.06, reading_m) == GaugeResult::kNothing);
}

}  // namespace

extern "C" {
hid_device* __wrap_hid_open(unsigned short vendor, unsigned short product, const wchar_t*) {
  if (!device.present || vendor != 0x0FE7 || product != 0x4001) return nullptr;
  ++device.opened;
  return reinterpret_cast<hid_device*>(&handle);
}
void __wrap_hid_close(hid_device*) {
  device.waiting.clear();
}
int __wrap_hid_read_timeout(hid_device*, unsigned char* data, std::size_t size, int wait_ms) {
  if (!device.present) return -1;
  if (device.waiting.empty()) {
    device.now_s += 1e-3 * wait_ms;
    return 0;
  }
  const Bytes report = device.waiting.front();
  device.waiting.pop_front();
  const std::size_t taken = std::min(size, report.size());
  std::copy_n(report.begin(), taken, data);
  return static_cast<int>(taken);
}
hid_device_info* __wrap_hid_get_device_info(hid_device*) {
  static char path[] = "/dev/hidraw7";
  static hid_device_info info{};
  info.path = path;
  info.usage_page = device.keyboard ? 1 : 0xFF00;
  info.usage = device.keyboard ? 6 : 1;
  return &info;
}
int __wrap_ioctl(int, unsigned long request, ...) {
  if (request != EVIOCGRAB) return -1;
  if (!device.grab_allowed) {
    errno = EBUSY;
    return -1;
  }
  ++device.grabs;
  return 0;
}
}

TEST_CASE("HID gauge: what it types is a reading, and its keys are taken exclusively") {
  device = {};
  Gauge gauge = GaugeOf("plain");
  Settle(gauge);
  CHECK(device.grabs == 1);
  double reading_m = 0;
  Type({0x2D, 0x1E, 0x37});
  CHECK(gauge.Read(0.05, reading_m) == GaugeResult::kNothing);
  Type({0x22, 0x28});  // "-1.5" and Enter, in two parts
  REQUIRE(gauge.Read(0.05, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(-1.5e-3));
  Type({0x3A, 0x28});  // F1
  REQUIRE(gauge.Read(0.05, reading_m) == GaugeResult::kUnreadable);
  CHECK_THAT(std::string(gauge.problem()),
             Catch::Contains("HID 0FE7:4001: unreadable data: \"?\" is not a line of the format "
                             "\"plain\"; check `format` of [[gauge]]"));
}

TEST_CASE("HID gauge: a device whose keys cannot be taken is not used") {
  device = {};
  device.grab_allowed = false;
  Gauge gauge = GaugeOf("plain");
  double reading_m = 0;
  REQUIRE(gauge.Read(0.05, reading_m) == GaugeResult::kLost);
  CHECK_THAT(std::string(gauge.problem()), Catch::Contains("event3, which cannot be taken "
                                                           "exclusively"));
  CHECK_FALSE(gauge.connected());
}

TEST_CASE("HID gauge: vendor reports hold the text of the format") {
  device = {};
  device.keyboard = false;
  Gauge gauge = GaugeOf("mitutoyo");
  Settle(gauge);
  CHECK(device.grabs == 0);
  Bytes report = {0x01};
  for (const char c : std::string("01A+0000.123\r")) {
    report.push_back(static_cast<std::uint8_t>(c));
  }
  report.resize(32);
  device.waiting = {report};
  double reading_m = 0;
  REQUIRE(gauge.Read(0.05, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(1.23e-4));
  CHECK(gauge.Read(0.05, reading_m) == GaugeResult::kNothing);
}

TEST_CASE("HID gauge: unplugged and found again; half a reading is not completed by the next") {
  device = {};
  Gauge gauge = GaugeOf("plain");
  Settle(gauge);
  Type({0x1E, 0x1F});
  double reading_m = 0;
  CHECK(gauge.Read(0.05, reading_m) == GaugeResult::kNothing);
  device.present = false;
  REQUIRE(gauge.Read(0.05, reading_m) == GaugeResult::kLost);
  CHECK(std::string(gauge.problem()) == "HID 0FE7:4001: lost. Check its cable.");
  CHECK(gauge.Read(0.05, reading_m) == GaugeResult::kWaiting);
  device.now_s += 1;
  CHECK(gauge.Read(0.05, reading_m) == GaugeResult::kLost);
  CHECK_THAT(std::string(gauge.problem()), Catch::Contains("Check that it is plugged in"));
  device.present = true;
  device.now_s += 2;
  Settle(gauge);
  CHECK(device.grabs == 2);
  Type({0x20, 0x28});
  REQUIRE(gauge.Read(0.05, reading_m) == GaugeResult::kReading);
  CHECK(reading_m == Approx(3e-3));
}
