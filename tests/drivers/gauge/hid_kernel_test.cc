// HID gauge against a virtual keyboard of the kernel (uhid), if available.
#include <fcntl.h>
#include <linux/input.h>
#include <linux/uhid.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "drivers/gauge/gauge.h"
#include "drivers/hid/hid_device.h"
#include "drivers/os/descriptor.h"

namespace plumbline::hid_kernel_test {

using namespace plumbline::gauge;
using namespace std::chrono_literals;

namespace {

constexpr int kVendor = 0xF00D, kProduct = 0x2F02;

/// Boot keyboard without LEDs [USB HID 1.11, appendix E.6].
constexpr std::uint8_t kKeyboardDescriptor[] = {
    0x05, 0x01, 0x09, 0x06, 0xA1, 0x01, 0x05, 0x07, 0x19, 0xE0, 0x29, 0xE7, 0x15, 0x00, 0x25,
    0x01, 0x75, 0x01, 0x95, 0x08, 0x81, 0x02, 0x95, 0x01, 0x75, 0x08, 0x81, 0x01, 0x95, 0x06,
    0x75, 0x08, 0x15, 0x00, 0x25, 0x65, 0x05, 0x07, 0x19, 0x00, 0x29, 0x65, 0x81, 0x00, 0xC0};

/// Exists until it is destroyed.
class UhidKeyboard {
 public:
  UhidKeyboard() : device_(open("/dev/uhid", O_RDWR | O_CLOEXEC)) {
    uhid_event event{};
    event.type = UHID_CREATE2;
    std::strcpy(reinterpret_cast<char*>(event.u.create2.name), "plumbline test gauge");
    std::memcpy(event.u.create2.rd_data, kKeyboardDescriptor, sizeof kKeyboardDescriptor);
    event.u.create2.rd_size = sizeof kKeyboardDescriptor;
    event.u.create2.bus = 0x03;
    event.u.create2.vendor = kVendor;
    event.u.create2.product = kProduct;
    Write(event);
  }
  void Type(const std::vector<std::uint8_t>& keys) const {
    for (const std::uint8_t key : keys) {
      for (const std::uint8_t down : {key, std::uint8_t{0}}) {
        uhid_event event{};
        event.type = UHID_INPUT2;
        event.u.input2.size = 8;
        event.u.input2.data[2] = down;
        Write(event);
      }
    }
  }

 private:
  void Write(const uhid_event& event) const {
    if (write(device_.get(), &event, sizeof event) < 0) std::abort();
  }
  os::Descriptor device_;
};

bool Await(Gauge& gauge, GaugeResult wanted, double& reading_m) {
  for (const auto end = std::chrono::steady_clock::now() + 10s;
       std::chrono::steady_clock::now() < end;) {
    if (gauge.Read(0.05, reading_m) == wanted) return true;
    std::this_thread::sleep_for(20ms);
  }
  return false;
}

}  // namespace

TEST_CASE("HID gauge: a virtual keyboard is read, and its keys are not free", "[uhid]") {
  if (access("/dev/uhid", R_OK | W_OK) != 0) {
    std::cout << "SKIPPED: no /dev/uhid\n";
    return;
  }
  GaugeOptions options;
  options.kind = GaugeKind::kHid;
  options.hid = {kVendor, kProduct, ""};
  options.format = FindGaugeFormat("plain");
  Gauge gauge(options);
  double reading_m = 0;
  CHECK(gauge.Read(0.01, reading_m) == GaugeResult::kLost);
  const UhidKeyboard keyboard;
  REQUIRE(Await(gauge, GaugeResult::kNothing, reading_m));
  int inputs = 0;
  for (const std::string& path : hid::DeviceFilesOf(options.hid)) {
    if (path.find("event") == std::string::npos) continue;
    ++inputs;
    const os::Descriptor other(open(path.c_str(), O_RDONLY | O_CLOEXEC));
    REQUIRE(other.get() >= 0);
    CHECK(ioctl(other.get(), EVIOCGRAB, 1) == -1);
    CHECK(errno == EBUSY);
  }
  REQUIRE(inputs > 0);
  std::this_thread::sleep_for(300ms);
  CHECK(gauge.Read(0.05, reading_m) == GaugeResult::kNothing);
  keyboard.Type({0x2D, 0x1E, 0x37, 0x22, 0x28});  // "-1.5" and Enter
  REQUIRE(Await(gauge, GaugeResult::kReading, reading_m));
  CHECK(reading_m == Approx(-1.5e-3));
}

}  // namespace plumbline::hid_kernel_test
