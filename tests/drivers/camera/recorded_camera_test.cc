#include "drivers/camera/recorded_camera.h"

#include <catch2/catch.hpp>
#include <fstream>

#include "drivers/camera/registry.h"
#include "firmware-like/image/image_size.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::recorded_camera_test {

using namespace plumbline::camera;

namespace {

double now_s = 0;
double TestClock() {
  return now_s;
}
void TestSleep(double seconds) {
  now_s += seconds;
}

/// A grey image of one level.
void WriteImage(const std::string& path, int width, int height, int level) {
  std::ofstream file(path, std::ios::binary);
  file << "P5\n" << width << ' ' << height << "\n255\n";
  for (int i = 0; i < width * height; ++i) file.put(static_cast<char>(level));
}

/// Five images f1..f5 of 8 x 6 pixels and the levels 10..50.
struct Recording {
  Recording() {
    for (int k = 1; k <= 5; ++k) {
      WriteImage(folder.path() + "/f" + std::to_string(k) + ".pgm", 8, 6, 10 * k);
    }
  }
  std::unique_ptr<Camera> Play(RecordedCameraOptions options) {
    if (options.path.empty()) options.path = folder.path();
    auto made = RecordedCamera::Create(options, TestClock, TestSleep);
    if (!made) FAIL(made.error());
    return std::move(made).value();
  }
  std::string Sequence(const std::string& rows) {
    std::string path = folder.path() + "/sequence.csv";
    std::ofstream(path) << "t_s,file\n" << rows;
    return path;
  }
  test::TemporaryFolder folder;
  CameraFrame frame;
};

}  // namespace

TEST_CASE("recorded camera: unpaced, every frame is returned with its recorded time") {
  Recording recording;
  now_s = 100;
  const auto camera = recording.Play({.path = {}, .rate_hz = 10, .paced = false});
  CHECK(camera->identity().serial == "recorded");
  for (unsigned k = 0; k < 5; ++k) {
    now_s += 1;
    REQUIRE(camera->Read(0.1, recording.frame) == CameraResult::kFrame);
    CHECK(recording.frame.luma.size() == image::ImageSize{8, 6});
    CHECK(recording.frame.luma.row(5)[7] == 10 * (k + 1));
    CHECK(recording.frame.time_s == Approx(101 + 0.1 * k));
    CHECK(recording.frame.sequence == k);
  }
  CHECK(camera->identity().mode == "recorded 8x6@10");
  CHECK(camera->Read(0.1, recording.frame) == CameraResult::kEnded);
  CHECK(camera->Read(0.1, recording.frame) == CameraResult::kEnded);
  CHECK(recording.frame.sequence == 4);
}

TEST_CASE("recorded camera: paced, a call waits and missed frames are skipped") {
  Recording recording;
  now_s = 0;
  const auto camera = recording.Play({.path = {}, .rate_hz = 10});
  REQUIRE(camera->Read(0, recording.frame) == CameraResult::kFrame);
  CHECK(camera->Read(0.04, recording.frame) == CameraResult::kNoFrame);
  CHECK(now_s == Approx(0.04));
  REQUIRE(camera->Read(0.2, recording.frame) == CameraResult::kFrame);
  CHECK(now_s == Approx(0.1));
  CHECK(recording.frame.sequence == 1);
  now_s = 0.35;
  REQUIRE(camera->Read(0.2, recording.frame) == CameraResult::kFrame);
  CHECK(recording.frame.sequence == 3);
  CHECK(recording.frame.time_s == Approx(0.3));
  now_s = 50;
  REQUIRE(camera->Read(0.2, recording.frame) == CameraResult::kFrame);
  CHECK(recording.frame.sequence == 4);
  CHECK(camera->Read(0.2, recording.frame) == CameraResult::kEnded);
}

TEST_CASE("recorded camera: repeated, time and sequence continue; missed repeats are skipped") {
  Recording recording;
  now_s = 0;
  const auto camera = recording.Play({.path = {}, .rate_hz = 10, .repeat = true});
  for (unsigned k = 0; k < 12; ++k) {
    REQUIRE(camera->Read(0.2, recording.frame) == CameraResult::kFrame);
    CHECK(recording.frame.sequence == k);
    CHECK(recording.frame.time_s == Approx(0.1 * k));
    CHECK(recording.frame.luma.row(0)[0] == 10 * (k % 5 + 1));
  }
  now_s = 1e6 + 0.05;
  REQUIRE(camera->Read(0.2, recording.frame) == CameraResult::kFrame);
  CHECK(recording.frame.sequence == 10000000);
}

TEST_CASE("recorded camera: a sequence file has its own times and records camera losses") {
  Recording recording;
  now_s = 7;
  const auto camera = recording.Play({.path = recording.Sequence("3,f1.pgm\n3.2,\n3.5,f2.pgm\n"),
                                      .paced = false,
                                      .serial = "A1",
                                      .mode = "YUYV 8x6@5"});
  REQUIRE(camera->Read(0.1, recording.frame) == CameraResult::kFrame);
  CHECK(camera->Read(0.1, recording.frame) == CameraResult::kLost);
  REQUIRE(camera->Read(0.1, recording.frame) == CameraResult::kFrame);
  CHECK(recording.frame.time_s == Approx(7.5));
  CHECK(recording.frame.sequence == 2);
  CHECK(camera->identity().serial == "A1");
  CHECK(camera->identity().mode == "YUYV 8x6@5");
}

TEST_CASE("recorded camera: unreadable images are reported and skipped, the frame is unchanged") {
  Recording recording;
  WriteImage(recording.folder.path() + "/f3.pgm", 6, 8, 1);
  std::ofstream(recording.folder.path() + "/f4.pgm") << "garbage";
  const auto camera = recording.Play({.path = {}, .paced = false});
  REQUIRE(camera->Read(0.1, recording.frame) == CameraResult::kFrame);
  REQUIRE(camera->Read(0.1, recording.frame) == CameraResult::kFrame);
  CHECK(camera->Read(0.1, recording.frame) == CameraResult::kUnusable);
  CHECK_THAT(std::string(camera->problem()),
             Catch::Contains("f3.pgm: 6 x 8 px, but the first image has 8 x 6"));
  CHECK(camera->Read(0.1, recording.frame) == CameraResult::kUnusable);
  CHECK_THAT(std::string(camera->problem()), Catch::Contains("f4.pgm"));
  CHECK(recording.frame.luma.row(5)[7] == 20);
  REQUIRE(camera->Read(0.1, recording.frame) == CameraResult::kFrame);
  CHECK(recording.frame.sequence == 4);
}

TEST_CASE("recorded camera: no images, no file or a bad rate fail with the reason") {
  const test::TemporaryFolder empty;
  const auto why = [](const RecordedCameraOptions& options) {
    return RecordedCamera::Create(options, TestClock).error();
  };
  CHECK_THAT(why({.path = empty.path()}), Catch::Contains("contains no images"));
  CHECK_THAT(why({.path = empty.path() + "/none.csv"}), Catch::Contains("No such file"));
  CHECK_THAT(why({.path = empty.path(), .rate_hz = 0}), Catch::Contains("outside 0.01..1000"));
  std::ofstream(empty.path() + "/bad.csv") << "t_s,file\n0;a\n";
  CHECK_THAT(why({.path = empty.path() + "/bad.csv"}), Catch::Contains("bad.csv: line 2:"));
}

TEST_CASE("camera registry: a kind by its name") {
  const Recording recording;
  CameraConnection connection;
  connection.recorded.path = recording.folder.path();
  CHECK(MakeCamera("recorded", connection));
  CHECK_THAT(MakeCamera("film", connection).error(), Catch::Contains("is not one of"));
}

}  // namespace plumbline::recorded_camera_test
