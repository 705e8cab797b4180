// DV pictures through the real plumbline-dv: quality, damage, and a process that ends or hangs.
#include "drivers/camera/dv_decoder.h"

#include <sys/stat.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <fstream>
#include <random>
#include <sstream>

#include "tests/app/temporary_folder.h"
#include "tests/drivers/camera/dv_frames.h"
#include "tests/file_text.h"

namespace plumbline::dv_decoder_test {

using namespace plumbline::camera;
using Bytes = std::vector<std::uint8_t>;
using test::DvEncoder;

namespace {

double now_s = 0;
double TestTime() {
  return now_s;
}

/// Grey level of a smooth test scene at a place in the picture with square pixels.
double Scene(double x, double y) {
  return 126 + 50 * std::sin(x / 9) * std::cos(y / 11) + 30 * std::sin((x + 2 * y) / 40);
}

/// Position of a column of the frame in the picture with square pixels.
double SquareX(int column, int width) {
  return (column + 0.5) * width / 720 - 0.5;
}

struct Decoded {
  image::LumaView luma;
  Bytes field_luma, buffer;
};

void Square(const DvField& field, Decoded& decoded) {
  decoded.luma = SquareLuma(field, decoded.field_luma, decoded.buffer);
}

/// Peak signal-to-noise ratio [dB]; the picture is half a line below the frame's lines.
double Psnr(const image::LumaView& luma) {
  double squares = 0;
  for (int v = 0; v < luma.height; ++v) {
    for (int u = 0; u < luma.width; ++u) {
      const double error = luma.row(v)[u] - Scene(u, v + 0.5);
      squares += error * error;
    }
  }
  return 10 * std::log10(255 * 255 / (squares / (luma.width * luma.height)));
}

/// Changes bits in the data of some video blocks; the block structure stays valid.
Bytes WithNoise(Bytes frame, int blocks, std::mt19937& random) {
  for (int n = 0; n < blocks; ++n) {
    const std::size_t block = 80 * (random() % (frame.size() / 80));
    if (frame[block] >> 5 != 4) continue;
    for (std::size_t k = 4; k < 80; ++k) frame[block + k] = static_cast<std::uint8_t>(random());
  }
  return frame;
}

struct Setup {
  explicit Setup(bool lines_625 = true) : encoder(lines_625) { now_s = 1000; }
  bool Skip() const {
    if (!encoder.usable()) WARN("SKIPPED: this libavcodec has no DV encoder");
    return !encoder.usable();
  }
  DvEncoder encoder;
  DvDecoder decoder{TestTime, PLUMBLINE_DV};
};

}  // namespace

TEST_CASE("dv decoder: the picture matches its source, whatever the other field shows") {
  for (const bool lines_625 : {true, false}) {
    Setup dv(lines_625);
    if (dv.Skip()) return;
    const int width = lines_625 ? 787 : 655;
    const Bytes frame = dv.encoder.Encode([&](int column, int line) {
      // The upper field shows the scene 20 ms earlier, when it was 25 px further to the left.
      return Scene(SquareX(column, width) + (line % 2 == 0 ? 25 : 0), line);
    });
    const auto field = dv.decoder.Decode(frame);
    REQUIRE(field);
    Decoded decoded;
    Square(*field, decoded);
    CHECK(decoded.luma.size() == image::ImageSize{width, lines_625 ? 576 : 480});
    const double psnr_dB = Psnr(decoded.luma);
    CAPTURE(psnr_dB);
    CHECK(psnr_dB > 45);  // 53.7
  }
}

TEST_CASE("dv decoder: a disc is found where it is") {
  Setup dv;
  if (dv.Skip()) return;
  constexpr double kX = 301.3, kY = 222.8, kRadius = 40;
  const auto field = dv.decoder.Decode(dv.encoder.Encode([&](int column, int line) {
    const double distance = std::hypot(SquareX(column, 787) - kX, line - kY);
    return 200 - 140 / (1 + std::exp(1.5 * (distance - kRadius)));
  }));
  REQUIRE(field);
  Decoded decoded;
  Square(*field, decoded);
  double sum = 0, x = 0, y = 0;
  for (int v = 0; v < 576; ++v) {
    for (int u = 0; u < 787; ++u) {
      const double dark = std::hypot(u - kX, v - kY) < 60 ? 200 - decoded.luma.row(v)[u] : 0;
      sum += dark;
      x += u * dark;
      y += v * dark;
    }
  }
  CHECK(x / sum == Approx(kX).margin(0.05));
  CHECK(y / sum == Approx(kY - 0.5).margin(0.05));
  // And round: with square pixels its area is that of the disc.
  CHECK(std::sqrt(sum / 140 / 3.14159265) == Approx(kRadius).epsilon(0.01));
}

TEST_CASE("dv decoder: colours are those of BT.601") {
  for (const bool lines_625 : {true, false}) {
    Setup dv(lines_625);
    if (dv.Skip()) return;
    const auto field = dv.decoder.Decode(dv.encoder.Encode([](int, int) { return 81; }, {90, 240}));
    REQUIRE(field);
    Bytes bgr;
    SquareBgr(*field, bgr);
    const std::size_t middle = 3 * (bgr.size() / 6);
    CHECK(bgr.size() == (lines_625 ? 3 * 787 * 576 : 3 * 655 * 480));
    CHECK(bgr[middle] <= 4);
    CHECK(bgr[middle + 1] <= 4);
    CHECK(bgr[middle + 2] >= 250);
  }
}

TEST_CASE("dv decoder: a damaged or truncated frame costs one picture, and not the process") {
  Setup dv;
  if (dv.Skip()) return;
  const Bytes good = dv.encoder.Encode([](int x, int y) { return Scene(x, y); });
  REQUIRE(dv.decoder.Decode(good));
  const pid_t process = dv.decoder.pid();
  std::mt19937 random(7);
  for (int k = 0; k < 30; ++k) {
    const auto damaged = dv.decoder.Decode(WithNoise(good, 1 + 20 * k, random));
    if (k > 0) {
      REQUIRE_FALSE(damaged);
      CHECK_THAT(damaged.error(), Catch::Contains("damaged DV frame. Check the cable"));
    }
    REQUIRE(dv.decoder.Decode(good));
  }
  const Bytes cut(good.begin(), good.end() - 80);
  CHECK_THAT(dv.decoder.Decode(cut).error(), Catch::Contains("143920 bytes instead of 144000"));
  REQUIRE(dv.decoder.Decode(good));
  CHECK(dv.decoder.pid() == process);
  CHECK(dv.decoder.lost() == 0);
}

TEST_CASE("dv decoder: a process that is killed or hangs costs one picture") {
  Setup dv;
  if (dv.Skip()) return;
  const Bytes good = dv.encoder.Uniform(100);
  const auto decode = [&](int times) {
    for (int k = 0; k < times; ++k) REQUIRE(dv.decoder.Decode(good));
  };
  decode(25);
  kill(dv.decoder.pid(), SIGTERM);
  CHECK_THAT(dv.decoder.Decode(good).error(),
             Catch::Contains("plumbline-dv was ended (Terminated)"));
  CHECK(dv.decoder.lost() == 1);
  CHECK_THAT(dv.decoder.TakeRemarks().at(0), Catch::Contains("so far: 1"));
  decode(25);  // at once: it had worked for a second
  kill(dv.decoder.pid(), SIGSTOP);
  CHECK_THAT(dv.decoder.Decode(good).error(), Catch::Contains("was ended (Killed)"));
  CHECK(dv.decoder.lost() == 2);
  decode(1);
  kill(dv.decoder.pid(), SIGKILL);  // before it has worked for a second: with back-off
  CHECK_FALSE(dv.decoder.Decode(good));
  CHECK_FALSE(dv.decoder.Decode(good));
  CHECK(dv.decoder.lost() == 3);
  CHECK(dv.decoder.pid() == -1);
  now_s += 0.11;
  decode(1);
}

TEST_CASE("dv decoder: a process that answers wrongly is ended") {
  const test::TemporaryFolder folder;
  const std::string program = folder.path() + "/plumbline-dv";
  const auto why = [&](const std::string& script) {
    std::ofstream(program) << script;
    chmod(program.c_str(), 0700);
    DvDecoder decoder(TestTime, program);
    const auto field = decoder.Decode(test::BareDvFrame(true));
    return field ? std::string() : field.error();
  };
  CHECK_THAT(why("#!/bin/sh\nexec yes\n"), Catch::Contains("was ended"));
  CHECK_THAT(why("#!/bin/sh\nexit 3\n"), Catch::Contains("sudo apt install libavcodec59"));
  CHECK_THAT(why("#!/bin/sh\nexit 4\n"), Catch::Contains("could not restrict its rights"));
  DvDecoder absent(TestTime, folder.path() + "/none");
  CHECK_THAT(absent.Decode(test::BareDvFrame(true)).error(),
             Catch::Contains("cannot be started; it belongs beside this program"));
  CHECK(absent.lost() == 0);
  CHECK(absent.TakeRemarks().empty());
}

#ifndef PLUMBLINE_SANITIZED
TEST_CASE("dv decoder: the process can open nothing and start nothing") {
  Setup dv;
  if (dv.Skip()) return;
  REQUIRE(dv.decoder.Decode(dv.encoder.Uniform(50)));
  const std::string proc = "/proc/" + std::to_string(dv.decoder.pid());
  const std::string status = test::FileText(proc + "/status");
  CHECK_THAT(status, Catch::Contains("Seccomp:\t2") && Catch::Contains("NoNewPrivs:\t1"));
  const std::string limits = test::FileText(proc + "/limits");
  for (const char* limit :
       {"Max open files", "Max processes", "Max file size", "Max core file size"}) {
    const std::string line = limits.substr(limits.find(limit), 60);
    CHECK_THAT(line, Catch::Matches(std::string(limit) + " +0 .*"));
  }
}
#endif

}  // namespace plumbline::dv_decoder_test
