// A DV camcorder through a FIFO, with the real plumbline-dv.
#include "drivers/camera/dv_stream_camera.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>

#include "drivers/camera/registry.h"
#include "drivers/os/descriptor.h"
#include "tests/app/temporary_folder.h"
#include "tests/drivers/camera/dv_frames.h"

namespace plumbline::dv_stream_camera_test {

using namespace plumbline::camera;
using Bytes = std::vector<std::uint8_t>;

namespace {

/// A camera on a FIFO, and the end that dvgrab would write to.
struct Camcorder {
  Camcorder() : encoder(true) {
    REQUIRE(mkfifo(fifo.c_str(), 0600) == 0);
    Make({.fifo = fifo, .dv_decoder = PLUMBLINE_DV});
  }
  void Make(const DvStreamOptions& options) {
    auto made = DvStreamCamera::Create(options, MonotonicSeconds);
    if (!made) FAIL(made.error());
    camera = std::move(made).value();
  }
  bool Skip() const {
    if (!encoder.usable()) WARN("SKIPPED: this libavcodec has no DV encoder");
    return !encoder.usable();
  }
  /// Opens the FIFO on both sides.
  void Start() {
    REQUIRE(camera->Read(0, frame) == CameraResult::kNoFrame);
    writer.Reset(open(fifo.c_str(), O_WRONLY | O_CLOEXEC));
  }
  void Write(std::span<const std::uint8_t> bytes) const {
    while (!bytes.empty()) {
      const ssize_t wrote = write(writer.get(), bytes.data(), bytes.size());
      REQUIRE(wrote > 0);
      bytes = bytes.subspan(static_cast<std::size_t>(wrote));
    }
  }
  CameraResult Read() { return camera->Read(5, frame); }
  int Level() const { return frame.luma.row(300)[400]; }

  test::TemporaryFolder folder;
  std::string fifo = folder.path() + "/camera";
  test::DvEncoder encoder;
  std::unique_ptr<Camera> camera;
  os::Descriptor writer;
  CameraFrame frame;
};

}  // namespace

TEST_CASE("dv stream camera: pictures with time, identity and colour; a lost piece costs one") {
  Camcorder dv;
  if (dv.Skip()) return;
  dv.Start();
  CHECK(dv.camera->identity().serial.empty());
  CHECK(dv.camera->Bgr() == nullptr);
  dv.Write(Bytes(5000, 0x55));  // the stream starts within a frame
  const double before_s = MonotonicSeconds();
  dv.Write(dv.encoder.Uniform(60));
  REQUIRE(dv.Read() == CameraResult::kFrame);
  CHECK(dv.Level() == Approx(60).margin(1));
  CHECK(dv.frame.luma.size() == image::ImageSize{787, 576});
  CHECK(dv.frame.time_s >= before_s);
  CHECK(dv.frame.time_s <= MonotonicSeconds());
  CHECK(dv.camera->identity().serial == "dv@" + dv.fifo);
  CHECK(dv.camera->identity().mode == "dvsd 787x576@25");
  REQUIRE(dv.camera->Bgr() != nullptr);
  CHECK(dv.camera->Bgr()->size() == 3 * 787 * 576);
  const std::uint64_t sequence = dv.frame.sequence;
  const Bytes lost = dv.encoder.Uniform(90);
  dv.Write(std::span(lost).first(100000));
  dv.Write(dv.encoder.Uniform(120));
  REQUIRE(dv.Read() == CameraResult::kFrame);
  CHECK(dv.Level() == Approx(120).margin(1));
  CHECK(dv.frame.sequence == sequence + 2);
}

TEST_CASE("dv stream camera: the newest picture, however late it is read") {
  Camcorder dv;
  if (dv.Skip()) return;
  dv.Start();
  for (const int level : {40, 70, 100, 130, 160}) dv.Write(dv.encoder.Uniform(level));
  // All but what the FIFO still holds has been drained, although nothing has been read.
  REQUIRE(dv.Read() == CameraResult::kFrame);
  CHECK(dv.Level() >= 129);
  if (dv.frame.sequence < 5) REQUIRE(dv.Read() == CameraResult::kFrame);
  CHECK(dv.Level() == Approx(160).margin(1));
  CHECK(dv.frame.sequence == 5);
}

TEST_CASE("dv stream camera: a writer that ends is followed by the next") {
  Camcorder dv;
  if (dv.Skip()) return;
  dv.Start();
  dv.Write(dv.encoder.Uniform(60));
  REQUIRE(dv.Read() == CameraResult::kFrame);
  dv.writer.Reset();
  CHECK(dv.camera->Read(0.02, dv.frame) == CameraResult::kNoFrame);
  CHECK_THAT(std::string(dv.camera->problem()), Catch::Contains("no frame within 0.02 s"));
  dv.writer.Reset(open(dv.fifo.c_str(), O_WRONLY | O_CLOEXEC));
  dv.Write(dv.encoder.Uniform(80));
  REQUIRE(dv.Read() == CameraResult::kFrame);
  CHECK(dv.Level() == Approx(80).margin(1));
}

TEST_CASE("dv stream camera: no FIFO, no path, no DV: the remedy is reported") {
  Camcorder dv;
  const auto problem = [&](const std::string& path) {
    dv.Make({.fifo = path});
    CHECK(dv.camera->Read(0, dv.frame) == CameraResult::kLost);
    return std::string(dv.camera->problem());
  };
  CHECK_THAT(problem(dv.folder.path() + "/none"), Catch::Contains("No such file"));
  std::ofstream(dv.folder.path() + "/file") << "x";
  CHECK_THAT(problem(dv.folder.path() + "/file"), Catch::Contains("is not a FIFO"));
  CHECK(dv.camera->Read(0, dv.frame) == CameraResult::kWaiting);
  CHECK_FALSE(MakeCamera("dv", {}));
  dv.Make({.fifo = dv.fifo});
  dv.Start();
  Bytes frame = test::BareDvFrame(true);
  frame[80 * 20] = 0;
  for (int k = 0; k < 3; ++k) dv.Write(frame);
  CameraResult result = CameraResult::kNoFrame;
  for (int k = 0; k < 100 && result == CameraResult::kNoFrame; ++k) {
    result = dv.camera->Read(0.02, dv.frame);
  }
  CHECK(result == CameraResult::kUnusable);
  CHECK_THAT(std::string(dv.camera->problem()), Catch::Contains("block 20 of sequence 0"));
}

TEST_CASE("dv stream camera: data without frames are reported as unreadable, not as silence") {
  Camcorder dv;
  dv.Make({.fifo = dv.fifo});
  dv.Start();
  dv.Write(Bytes(300'000, 0x55));
  CameraResult result = CameraResult::kNoFrame;
  for (int k = 0; k < 100 && result == CameraResult::kNoFrame; ++k) {
    result = dv.camera->Read(0.02, dv.frame);
  }
  CHECK(result == CameraResult::kUnusable);
  CHECK_THAT(std::string(dv.camera->problem()), Catch::Contains("unreadable data: no DV frame in"));
  CHECK(dv.camera->Read(0.02, dv.frame) == CameraResult::kNoFrame);  // reported once
}

}  // namespace plumbline::dv_stream_camera_test
