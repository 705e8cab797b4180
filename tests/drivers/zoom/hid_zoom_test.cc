// HID sensor against a fake device: hidapi's functions are replaced by the linker (--wrap). Time
// passes only while the driver waits.
#include "drivers/zoom/hid_zoom.h"

#include <hidapi/hidapi.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <deque>
#include <vector>

using namespace plumbline;

using namespace plumbline::zoom;

namespace {

using Bytes = std::vector<std::uint8_t>;

struct Device {
  bool present = true;
  std::deque<Bytes> answers;  ///< one per request; empty: silence
  std::deque<Bytes> waiting;
  int opened = 0, closed = 0;
  double now_s = 1000;
};
Device device;
int handle = 0;

double Now() {
  return device.now_s;
}

HidOptions Options(bool asks = true) {
  HidOptions options;
  options.profile.name = "test lens";
  options.profile.vendor_id = 0x1234;
  options.profile.product_id = 0x5678;
  HidExchange exchange;
  if (asks) exchange.send = {{0x02, 0x55}};
  exchange.answer_id = 0x01;
  exchange.answer_bytes = 5;
  exchange.fields = {HidField{HidField::Meaning::kZoomCounts, 1, 2, true, false, 0xFFFFFFFF}};
  options.profile.exchanges = {exchange};
  return options;
}

std::unique_ptr<ZoomSensor> Sensor(bool asks = true) {
  device = {};
  auto made = HidZoom::Create(Options(asks), Now);
  if (!made) FAIL(made.error());
  return std::move(made).value();
}

}  // namespace

extern "C" {
hid_device* __wrap_hid_open(unsigned short, unsigned short, const wchar_t*) {
  if (!device.present) return nullptr;
  ++device.opened;
  return reinterpret_cast<hid_device*>(&handle);
}
void __wrap_hid_close(hid_device*) {
  ++device.closed;
  device.waiting.clear();
}
int __wrap_hid_write(hid_device*, const unsigned char*, std::size_t size) {
  if (!device.present) return -1;
  if (!device.answers.empty()) {
    device.waiting.push_back(device.answers.front());
    device.answers.pop_front();
  }
  return static_cast<int>(size);
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
}

TEST_CASE("HID: a report that is too short is rejected with its length") {
  for (const bool asks : {true, false}) {
    CAPTURE(asks);
    const auto sensor = Sensor(asks);
    device.answers = {{0x01, 0x12, 0x34, 0, 0}, {0x01, 0x12}, {0x01, 0x20, 0x00, 0, 0}};
    if (!asks) device.waiting.swap(device.answers);
    lens::ZoomReading reading;
    if (asks) {
      REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
      CHECK(reading.zoom_counts == 0x1234);
    }
    const lens::ZoomReading before = reading;
    CHECK(sensor->Read(reading) == ZoomResult::kProtocol);
    CHECK_THAT(std::string(sensor->problem()), Catch::Contains("test lens (HID 1234:5678)") &&
                                                   Catch::Contains("of 2 bytes is too short"));
    CHECK(reading.zoom_counts == before.zoom_counts);  // the last good reading is unchanged
    CHECK(device.closed == 1);                         // and the rest of the stream is discarded
    if (!asks) continue;
    while (sensor->Read(reading) == ZoomResult::kWaiting) device.now_s += 0.1;
    CHECK(reading.zoom_counts == 0x2000);
    CHECK(device.opened == 2);
  }
}

TEST_CASE("HID: only reports with other ids, silence, and a lost device") {
  const auto sensor = Sensor();
  lens::ZoomReading reading;
  device.answers = {{0x07, 1, 2, 3, 4}};
  CHECK(sensor->Read(reading) == ZoomResult::kTimeout);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("no answer in time"));
  device.now_s += 10;
  CHECK(sensor->Read(reading) == ZoomResult::kTimeout);  // silence
  device.now_s += 10;
  device.answers = {{0x01, 0x12, 0x34, 0, 0}};
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  device.present = false;
  CHECK(sensor->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("lost. Check its cable."));
  CHECK(sensor->Read(reading) == ZoomResult::kWaiting);
  device.now_s += 10;
  CHECK(sensor->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("Check that it is plugged in"));
  device.present = true;
  device.now_s += 10;
  device.answers = {{0x01, 0x00, 0x07, 0, 0}};
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.zoom_counts == 7);
}
