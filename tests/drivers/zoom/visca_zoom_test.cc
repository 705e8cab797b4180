#include "drivers/zoom/visca_zoom.h"

#include <atomic>
#include <catch2/catch.hpp>
#include <filesystem>
#include <memory>

#include "tests/app/temporary_folder.h"
#include "tests/drivers/zoom/fake_visca_camera.h"

namespace plumbline::visca_zoom_test {

using namespace plumbline::zoom;

namespace {

using test::BlockOf;
using test::Bytes;
using test::CameraAnswers;
using test::FakeViscaCamera;

constexpr double kAnswered_s = 5;       // timeout if an answer is expected
constexpr double kUnanswered_s = 0.05;  // timeout if none is expected

std::unique_ptr<ZoomSensor> Sensor(const std::string& device, double timeout_s = kAnswered_s,
                                   int address = 1) {
  ViscaOptions options;
  options.device = device;
  options.address = address;
  options.timeout_s = timeout_s;
  auto sensor = ViscaZoom::Create(options, MonotonicSeconds);
  if (!sensor) FAIL(sensor.error());
  return std::move(sensor).value();
}

const Bytes kAddressSet = {0x88, 0x30}, kAskBlock = {0x81, 0x09, 0x7E};

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

TEST_CASE("a camera with a lens block is addressed once, then queried") {
  std::atomic<int> zoom{0x1606};
  FakeViscaCamera camera(
      CameraAnswers([&zoom] { return BlockOf(zoom, 0x1234, false, zoom == 7); }));
  const auto sensor = Sensor(camera.device());
  lens::ZoomReading reading;
  const double before_s = MonotonicSeconds();
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.zoom_counts == 0x1606);
  CHECK(reading.focus_counts == 0x1234);
  CHECK(reading.digital_zoom == false);
  CHECK(reading.motion == lens::LensMotion::kSettled);
  CHECK(reading.time_s >= before_s);
  CHECK(reading.time_s <= MonotonicSeconds());
  zoom = 7;
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.motion == lens::LensMotion::kMoving);
  zoom = 0x4001;  // beyond the optical range
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.digital_zoom == true);
  CHECK(camera.RequestCount(kAddressSet) == 1);
}

TEST_CASE("a camera without lens block and without focus inquiry") {
  FakeViscaCamera camera([](const Bytes& request) -> Bytes {
    if (request[1] == 0x30) return {0x88, 0x30, 0x02, 0xFF};
    if (request == Bytes{0x81, 0x09, 0x04, 0x47, 0xFF}) return {0x90, 0x50, 3, 2, 1, 0, 0xFF};
    return {0x90, 0x60, 0x02, 0xFF};
  });
  const auto sensor = Sensor(camera.device());
  for (int i = 0; i < 3; ++i) {
    lens::ZoomReading reading;
    REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
    CHECK(reading.zoom_counts == 0x3210);
    CHECK_FALSE(reading.focus_counts);
    CHECK(reading.digital_zoom == false);
    CHECK(reading.motion == lens::LensMotion::kUnknown);
  }
  CHECK(camera.RequestCount(kAskBlock) == 1);  // an unsupported inquiry is sent only once
  CHECK(camera.RequestCount({0x81, 0x09, 0x04, 0x48}) == 1);
}

TEST_CASE("other packets before the answer are ignored") {
  const Bytes before[] = {
      {0xA0, 0x50, 1, 2, 3, 4, 0xFF},        // another camera's position
      {0xA0, 0x60, 0x41, 0xFF},              // another camera's error
      {0x90, 0x41, 0xFF, 0x90, 0x51, 0xFF},  // a command's ack and completion
      {0x90, 0x50, 1, 2, 3, 4, 0xFF},        // an answer of another length
      {0x12, 0x34, 0x56, 0xFF},              // garbage
      Bytes(100, 0x55) + Bytes{0xFF},        // garbage longer than any buffer
      {0xFF, 0xFF, 0xFF},
      {0x90, 0x38, 0xFF},  // a network change
  };
  for (const Bytes& noise : before) {
    CAPTURE(noise);
    FakeViscaCamera camera(
        CameraAnswers([&noise] { return noise + BlockOf(0x2222, 5, false, false); }));
    const auto sensor = Sensor(camera.device());
    lens::ZoomReading reading;
    REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
    CHECK(reading.zoom_counts == 0x2222);
  }
}

TEST_CASE("an answer of another length is reported as one, not as silence") {
  FakeViscaCamera camera(CameraAnswers([] { return Bytes{0x90, 0x50, 1, 2, 3, 4, 0xFF}; }));
  const auto sensor = Sensor(camera.device(), kUnanswered_s);
  lens::ZoomReading reading;
  CHECK(sensor->Read(reading) == ZoomResult::kProtocol);
  CHECK_THAT(std::string(sensor->problem()),
             Catch::Contains("answers, but not to this inquiry: 7 bytes instead of 16. "));
  CHECK_FALSE(reading.zoom_counts);
}

TEST_CASE("answers from another address are ignored, and that address is reported") {
  FakeViscaCamera camera([](const Bytes& request) -> Bytes {
    if (request[1] == 0x30) return {0x88, 0x30, 0x04, 0xFF};
    Bytes block = BlockOf(0x2222, 5, false, false);
    block[0] = 0xB0;  // camera 3 answers every request
    return block;
  });
  const auto sensor = Sensor(camera.device(), kUnanswered_s);
  lens::ZoomReading reading;
  CHECK(sensor->Read(reading) == ZoomResult::kTimeout);
  CHECK_THAT(std::string(sensor->problem()),
             Catch::Contains(": camera 1 does not answer, but camera 3 does. Check"));
  CHECK_FALSE(reading.zoom_counts);
}

TEST_CASE("an answer in pieces, and one followed by another packet") {
  FakeViscaCamera camera(CameraAnswers([] { return Bytes{}; }));
  camera.SetAnswer([&camera](const Bytes& request) -> Bytes {
    if (request[1] == 0x30) return {0x88, 0x30, 0x02, 0xFF};
    for (const std::uint8_t byte : BlockOf(0x1357, 1, false, false)) camera.SendBytes({byte});
    return {0x90, 0x50, 9, 9, 9, 9, 0xFF};  // left over, must not be taken for the next answer
  });
  const auto sensor = Sensor(camera.device());
  for (int i = 0; i < 5; ++i) {
    lens::ZoomReading reading;
    REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
    CHECK(reading.zoom_counts == 0x1357);
  }
}

TEST_CASE("error replies are reported as text") {
  FakeViscaCamera camera(CameraAnswers([] { return Bytes{0x90, 0x61, 0x41, 0xFF}; }));
  const auto sensor = Sensor(camera.device());
  lens::ZoomReading reading;
  reading.zoom_counts = 5;
  CHECK(sensor->Read(reading) == ZoomResult::kRefused);
  CHECK(reading.zoom_counts == 5);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("not executable"));
  camera.SetAnswer(CameraAnswers([] { return BlockOf(1, 2, false, false); }));
  CHECK(sensor->Read(reading) == ZoomResult::kOk);
}

TEST_CASE("a lens block of the right length with invalid nibbles is rejected") {
  FakeViscaCamera camera(CameraAnswers([] {
    Bytes block = BlockOf(1, 2, false, false);
    block[3] = 0x77;
    return block;
  }));
  const auto sensor = Sensor(camera.device());
  lens::ZoomReading reading;
  CHECK(sensor->Read(reading) == ZoomResult::kProtocol);
  CHECK_FALSE(reading.zoom_counts);
}

TEST_CASE("silence and garbage end at the timeout; the late answer is discarded") {
  FakeViscaCamera camera(CameraAnswers([] { return Bytes{}; }));
  const auto sensor = Sensor(camera.device(), kUnanswered_s);
  lens::ZoomReading reading;
  CHECK(sensor->Read(reading) == ZoomResult::kTimeout);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("no answer"));
  camera.SetAnswer([](const Bytes&) { return Bytes{1, 2, 3, 0xFF}; });
  CHECK(sensor->Read(reading) == ZoomResult::kProtocol);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("baud"));
  CHECK_FALSE(reading.zoom_counts);

  // The late answer arrives just before the reply to AddressSet, because a camera answers in order.
  // Only packets after that reply count.
  camera.SetAnswer([](const Bytes& request) -> Bytes {
    if (request[1] == 0x30) return BlockOf(0x0001, 0, false, false) + Bytes{0x88, 0x30, 2, 0xFF};
    return BlockOf(0x0002, 0, false, false);
  });
  const int addressed = camera.RequestCount(kAddressSet);
  while (sensor->Read(reading) != ZoomResult::kOk) {
  }
  CHECK(reading.zoom_counts == 2);
  CHECK(camera.RequestCount(kAddressSet) > addressed);
}

TEST_CASE("after a network change, or with too few cameras, addresses are assigned again") {
  std::atomic<int> cameras{2};
  FakeViscaCamera camera([&cameras](const Bytes& request) -> Bytes {
    if (request[1] == 0x30) return {0x88, 0x30, static_cast<std::uint8_t>(cameras + 1), 0xFF};
    Bytes block = BlockOf(0x0123, 0, false, false);
    block[0] = 0xA0;
    return request[0] == 0x82 ? block : Bytes{};
  });
  const auto sensor = Sensor(camera.device(), kAnswered_s, 2);
  lens::ZoomReading reading;
  REQUIRE(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(reading.zoom_counts == 0x0123);
  camera.SendBytes({0xA0, 0x38, 0xFF});
  cameras = 1;
  CHECK(sensor->Read(reading) == ZoomResult::kRefused);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("only 1 cameras"));
  cameras = 2;
  CHECK(sensor->Read(reading) == ZoomResult::kOk);
  CHECK(camera.RequestCount(kAddressSet) == 3);
}

TEST_CASE("an adapter is unplugged and replugged under the same name") {
  const test::TemporaryFolder folder;
  const std::string link = folder.path() + "/tty";
  const auto sensor = Sensor(link);
  lens::ZoomReading reading;
  CHECK(sensor->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("is the adapter plugged in"));
  CHECK(sensor->Read(reading) == ZoomResult::kWaiting);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("is the adapter plugged in"));
  for (int round = 1; round <= 3; ++round) {
    const FakeViscaCamera camera(
        CameraAnswers([round] { return BlockOf(round, 0, false, false); }));
    std::filesystem::remove(link);
    std::filesystem::create_symlink(camera.device(), link);
    // The hang-up of the previous camera may be seen first.
    while (sensor->Read(reading) != ZoomResult::kOk) {
    }
    CHECK(reading.zoom_counts == round);
  }
  ZoomResult result = ZoomResult::kOk;
  while (result == ZoomResult::kOk) result = sensor->Read(reading);
  CHECK(result == ZoomResult::kLost);
}

TEST_CASE("a device that is not a serial line, and each invalid setting, have their message") {
  const auto sensor = Sensor("/dev/null");
  lens::ZoomReading reading;
  CHECK(sensor->Read(reading) == ZoomResult::kLost);
  CHECK_THAT(std::string(sensor->problem()), Catch::Contains("it is not a serial line"));

  struct Case {
    ViscaOptions options;
    const char* message;
  };
  ViscaOptions baud, address, patience;
  baud.baud = 1234;
  address.address = 8;
  patience.timeout_s = 0;
  for (const Case& c : {Case{baud, "baud 1234 is not one of"}, Case{address, "8 is outside 1..7"},
                        Case{patience, "is outside 0.01..10"}}) {
    const auto made = ViscaZoom::Create(c.options, MonotonicSeconds);
    REQUIRE_FALSE(made.ok());
    CHECK_THAT(made.error(), Catch::Contains(c.message));
  }
}

}  // namespace plumbline::visca_zoom_test
