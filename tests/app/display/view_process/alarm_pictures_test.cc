#include "app/display/view_process/alarm_pictures.h"

#include <png.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <filesystem>
#include <fstream>

#include "app/display/view_process/png_file.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::alarm_pictures_test {

using namespace plumbline::display;
using test::FileText;
using test::TemporaryFolder;

namespace {

display::RgbImage Picture(std::uint8_t grey) {
  return {std::vector<std::uint8_t>(std::size_t{3} * 64 * 48, grey), {64, 48}};
}

std::vector<std::string> Files(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator(folder, none)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

/// The first grey of a PNG, read by libpng's own reader; -1 where it is none.
int GreyOf(const std::string& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_file(&image, file.c_str()) == 0) return -1;
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(image));
  if (png_image_finish_read(&image, nullptr, pixels.data(), 0, nullptr) == 0) return -1;
  return pixels.empty() ? -1 : pixels[0];
}

}  // namespace

TEST_CASE("a PNG reads back as written; a failure to write is reported") {
  const TemporaryFolder folder;
  const std::string file = folder.path() + "/a.png";
  CHECK(WritePng(file, Picture(77)));
  CHECK(GreyOf(file) == 77);
  CHECK(WritePngBytes(file, PngOf(Picture(78), true).value()));
  CHECK(GreyOf(file) == 78);
  CHECK(Files(folder.path()).size() == 1);
  CHECK_FALSE(WritePng(folder.path() + "/none/a.png", Picture(1)));
  CHECK_FALSE(WritePng(file, {{}, {64, 48}}));
  CHECK_FALSE(WritePngBytes(folder.path() + "/none/a.png", "x"));
}

TEST_CASE("an alarm stores the last pictures before it and the first after it") {
  const TemporaryFolder folder;
  const std::string kept = folder.path() + "/alarms";
  std::vector<std::string> logged;
  {
    AlarmPictures alarms(kept, {},
                         [&](const log::LogEntry& entry) { logged.push_back(entry.text); });
    alarms.Observe(0, 1.8e9);
    for (int second = 0; second < 10; ++second) {
      CHECK(alarms.Due(second));
      alarms.Remember(Picture(static_cast<std::uint8_t>(second)), second);
      CHECK_FALSE(alarms.Due(second + 0.5));
    }
    alarms.Observe(2, 1.8e9);
    CHECK(alarms.Due(9.1));
    alarms.Remember(Picture(99), 9.1);
    alarms.Observe(2, 1.8e9);  // still set: no more files
    alarms.Observe(0, 1.8e9);
  }  // the destructor writes what is queued
  const auto files = Files(kept);
  REQUIRE(files.size() == 4);
  CHECK(logged ==
        std::vector{"pictures of an alarm stored, the first in " + kept + "/" + files[0]});
  CHECK(files[0] == "alarm-20270115T080000Z-0002-1.png");
  CHECK(GreyOf(kept + "/" + files[0]) == 7);
  CHECK(GreyOf(kept + "/" + files[2]) == 9);
  CHECK(GreyOf(kept + "/" + files[3]) == 99);
}

TEST_CASE("an alarm set before the first state stores nothing; a further bit does") {
  const TemporaryFolder folder;
  const std::string kept = folder.path() + "/alarms";
  {
    AlarmPictures alarms(kept, {}, [](const log::LogEntry&) {});
    alarms.Observe(1, 1.8e9);
    alarms.Remember(Picture(1), 0);
    alarms.Observe(1, 1.8e9);
    alarms.Observe(3, 1.8e9);
  }
  CHECK(Files(kept).size() == 1);
}

TEST_CASE(
    "alarm pictures are limited in number and bytes: the oldest are deleted, others' files "
    "never") {
  const TemporaryFolder folder;
  std::ofstream(folder.path() + "/notes.txt") << "mine";
  std::ofstream(folder.path() + "/alarm.txt") << "mine";
  const auto raise = [&](AlarmPictureLimits limits, int times) {
    for (int k = 0; k < times; ++k) {
      AlarmPictures alarms(folder.path(), limits, [](const log::LogEntry&) {});
      alarms.Observe(0, 1.8e9);
      alarms.Remember(Picture(static_cast<std::uint8_t>(k)), k);
      alarms.Observe(1, 1.8e9 + k);
    }
  };
  raise({5, 1 << 20}, 9);
  auto files = Files(folder.path());
  CHECK(files.size() == 5 + 2);
  CHECK(GreyOf(folder.path() + "/alarm-20270115T080008Z-0001-1.png") == 8);
  CHECK(GreyOf(folder.path() + "/alarm-20270115T080003Z-0001-1.png") == -1);
  raise({100, 200}, 3);  // byte limit: files are deleted before each write
  std::uint64_t bytes = 0;
  for (const std::string& name : Files(folder.path())) {
    if (name.find(".png") == std::string::npos) continue;
    bytes += std::filesystem::file_size(folder.path() + "/" + name);
  }
  CHECK(bytes < 200 + 400);
  CHECK(FileText(folder.path() + "/notes.txt") == "mine");
}

TEST_CASE("a folder that cannot be written is logged") {
  const TemporaryFolder folder;
  std::ofstream(folder.path() + "/alarms") << "a file in the way";
  std::vector<std::string> logged;
  {
    AlarmPictures alarms(folder.path() + "/alarms", {}, [&](const log::LogEntry& entry) {
      if (entry.event == log::Event::kViewFault) logged.push_back(entry.text);
    });
    alarms.Observe(0, 1.8e9);
    alarms.Remember(Picture(1), 0);
    alarms.Observe(1, 1.8e9);
  }
  REQUIRE(logged.size() == 1);
  CHECK_THAT(logged[0], Catch::Contains("picture of an alarm not stored"));
}

}  // namespace plumbline::alarm_pictures_test
