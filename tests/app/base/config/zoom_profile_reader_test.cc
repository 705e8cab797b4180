#include "app/base/config/zoom_profile_reader.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/app/base/config/wrong_line.h"
#include "tests/file_text.h"

namespace plumbline::zoom_profile_reader_test {

using namespace plumbline::config;

TEST_CASE("every profile of config/profiles/zoom reads without faults") {
  int profiles = 0;
  for (const auto& entry : std::filesystem::directory_iterator("config/profiles/zoom")) {
    if (entry.path().extension() != ".toml") continue;
    FaultList faults;
    const std::string path = entry.path().string();
    const auto profile = HidProfileFromText(test::FileText(path), path, faults);
    CAPTURE(FaultsText(faults));
    CHECK(profile);
    CHECK(faults.All().empty());
    ++profiles;
  }
  CHECK(profiles >= 2);
}

TEST_CASE("Computar LensConnect, as its source has it, byte by byte") {
  FaultList faults;
  const std::string path = "config/profiles/zoom/computar-lensconnect.toml";
  const auto profile = HidProfileFromText(test::FileText(path), path, faults);
  REQUIRE(profile);
  CHECK(profile->vendor_id == 0x10C4);
  CHECK(profile->product_id == 0x8D08);
  CHECK_THAT(profile->unconfirmed, Catch::Contains("byte order"));
  REQUIRE(profile->exchanges.size() == 2);
  using Reports = std::vector<std::vector<std::uint8_t>>;
  CHECK(profile->exchanges[0].send ==
        Reports{{0x11, 0x40, 0x00, 0x02, 0x02, 0x10, 0x00}, {0x12, 0x00, 0x02}});
  lens::ZoomReading reading;
  const std::vector<std::uint8_t> position = {0x13, 0x02, 0x02, 0x12, 0x34, 0x00};
  const std::vector<std::uint8_t> moves = {0x13, 0x02, 0x02, 0x00, 0x02};
  CHECK(zoom::ReadingFromReport(profile->exchanges[0], position, reading) ==
        zoom::HidAnswer::kRead);
  CHECK(zoom::ReadingFromReport(profile->exchanges[1], moves, reading) == zoom::HidAnswer::kRead);
  CHECK(reading.zoom_counts == 0x1234);
  CHECK(reading.motion == lens::LensMotion::kMoving);
}

TEST_CASE("wrong lines of a profile, each with its fault") {
  const std::string good = test::FileText("config/profiles/zoom/computar-lensconnect.toml");
  const std::vector<WrongLine> cases = {
      {"schema = 1", "schema = 2", "schema: 2 is outside 1..1"},
      {"vendor_id = 0x10C4", "vendor_id = 0x110C4", "vendor_id: 0x110C4 is outside 0..65535"},
      {"mask = 0x0002", "mask = 0", "exchange[2].field[1].mask: 0 is outside 1..2147483647"},
      {"mask = 0x0002", "masks = 2",
       "exchange[2].field[1].masks: unknown key; did you mean \"mask\"?"},
      {"value = \"moving\"", "value = \"zoom_counts\"", "@1: a value is reported twice"},
      {"bytes = [0x11, 0x40, 0x00, 0x02, 0x02, 0x10, 0x00]", "bytes = [256]",
       "exchange[1].send[1].bytes[1]: 256 is outside 0..255"},
  };
  ExpectOneFaultEach(good, "lens.toml", cases, [](const std::string& text, FaultList& faults) {
    return HidProfileFromText(text, "lens.toml", faults).has_value();
  });
  FaultList faults;
  CHECK_FALSE(HidProfileFromText("a = [", "a.toml", faults));
  CHECK_FALSE(HidProfileFromText("", "a.toml", faults));
}

}  // namespace plumbline::zoom_profile_reader_test
