// The robot program that docs/rtde.md tells people to copy, run step by step.
#include <catch2/catch.hpp>
#include <cmath>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>

#include "tests/virtual_ur/script.h"

namespace virtual_ur {
namespace {

constexpr double kRamp_s = 2, kTimeout_s = 0.25, kMaxSpeed = 0.005, kMax_m = 0.02;
const std::array<double, 6> kTaught{0.5, 0.1, 0.3, 0, 3.1, 0};

std::string ProgramText() {
  std::ifstream in("packaging/examples/ur/plumbline_rtde.script");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

struct Ended {};

/// A client that writes one point, and the robot program that reads it, step by step.
class Station {
 public:
  Station() : script_(ProgramText(), registers_) {}

  /// Runs the watchdog thread for that long from its start.
  void Run(double seconds, const std::function<void(double)>& before_step) {
    double time_s = 0;
    previous_ = Target();
    try {
      script_.RunThread("plumbline_watch", [&] {
        largest_step_m_ = std::max(largest_step_m_, Distance(Target(), previous_));
        previous_ = Target();
        time_s += RtdeServer::kCycle_s;
        if (time_s > seconds) throw Ended{};
        before_step(time_s);
        if (alive) ++registers_.input_int[24];
      });
    } catch (const Ended&) {
    }
  }

  void Write(double dx, int sequence = 1, int id = 10, int radius_um = 300) {
    registers_.input_int[25] = sequence;
    registers_.input_int[26] = id;
    registers_.input_int[27] = radius_um;
    for (std::size_t k = 0; k < 6; ++k) registers_.input_double[24 + k] = kTaught[k];
    registers_.input_double[24] += dx;
  }

  std::array<double, 6> Target(int id = 10) {
    return script_.Call("plumbline_target", {Value::Number(id), Value::Pose(kTaught)}).AsPose();
  }
  /// Correction of the target along x.
  double Correction(int id = 10) { return Target(id)[0] - kTaught[0]; }
  bool Ready() {
    return script_.Call("plumbline_ready", {Value::Number(10), Value::Pose(kTaught)}).number != 0;
  }
  /// The program is paused: its threads stop while the client goes on writing.
  void Pause(int heartbeats) { registers_.input_int[24] += heartbeats; }
  double largest_step_m() const { return largest_step_m_; }

  bool alive = true;

 private:
  static double Distance(const std::array<double, 6>& a, const std::array<double, 6>& b) {
    return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
  }

  UrState registers_;
  Script script_;
  std::array<double, 6> previous_{};
  double largest_step_m_ = 0;
};

/// Largest change of a target in one step: the ramp of the largest correction, and its own change.
constexpr double kStepLimit_m = (kMax_m / kRamp_s + kMaxSpeed) * RtdeServer::kCycle_s + 1e-12;

}  // namespace

TEST_CASE("a correction is faded in over the ramp, and the program knows when it is complete") {
  Station station;
  station.Write(0.004);
  CHECK(station.Correction() == 0);
  station.Run(kRamp_s / 2, [](double) {});
  CHECK(station.Correction() == Approx(0.002).margin(3e-5));
  CHECK_FALSE(station.Ready());
  station.Run(kRamp_s, [](double) {});
  CHECK(station.Correction() == Approx(0.004).margin(1e-12));
  CHECK(station.Ready());
  CHECK(station.Correction(11) == 0);
  CHECK(station.largest_step_m() < 0.004 / kRamp_s * RtdeServer::kCycle_s * 1.01);
}

TEST_CASE("when the client dies, the correction is faded out and never jumps") {
  Station station;
  station.Write(0.004);
  double kept = 0, half = 0;
  station.Run(kRamp_s + 0.5 + kTimeout_s + kRamp_s + 0.1, [&](double time_s) {
    station.alive = time_s < kRamp_s + 0.5;
    if (time_s < kRamp_s + 0.5 + kTimeout_s - 0.01) kept = station.Correction();
    if (time_s < kRamp_s + 0.5 + kTimeout_s + kRamp_s / 2) half = station.Correction();
  });
  CHECK(kept == Approx(0.004).margin(1e-12));
  CHECK(half == Approx(0.002).margin(3e-5));
  CHECK(station.Correction() == 0);
  CHECK_FALSE(station.Ready());
  CHECK(station.largest_step_m() < 0.004 / kRamp_s * RtdeServer::kCycle_s * 1.01);
}

TEST_CASE("registers that a dead client left behind are never used") {
  Station station;
  station.Write(0.004);
  station.alive = false;
  station.Run(2 * kRamp_s, [](double) {});
  CHECK(station.Correction() == 0);
}

TEST_CASE("a client that comes back is used again") {
  Station station;
  station.Write(0.004);
  station.Run(4 * kRamp_s + 1,
              [&](double time_s) { station.alive = time_s < kRamp_s || time_s > 2 * kRamp_s; });
  CHECK(station.Correction() == Approx(0.004).margin(1e-12));
  CHECK(station.largest_step_m() < 0.004 / kRamp_s * RtdeServer::kCycle_s * 1.01);
}

TEST_CASE("a point that is withdrawn, or whose radius is unknown or too wide, is faded out") {
  const auto write = GENERATE(0, 1, 2);
  CAPTURE(write);
  Station station;
  station.Run(2 * kRamp_s + 1, [&](double time_s) {
    if (time_s < kRamp_s + 0.5)
      station.Write(0.004);
    else if (write == 0)
      station.Write(0.004, 0);
    else
      station.Write(0.004, 1, 10, write == 1 ? 0 : 1001);
  });
  CHECK(station.Correction() == 0);
  CHECK(station.largest_step_m() < 0.004 / kRamp_s * RtdeServer::kCycle_s * 1.01);
}

TEST_CASE("a slot that gets another point fades the old one out before it uses the new one") {
  Station station;
  double highest_both = 0;
  station.Run(4 * kRamp_s, [&](double time_s) {
    station.Write(time_s < kRamp_s + 0.1 ? 0.004 : 0.008, 1, time_s < kRamp_s + 0.1 ? 10 : 11);
    highest_both = std::max(highest_both, std::min(station.Correction(10), station.Correction(11)));
  });
  CHECK(highest_both == 0);
  CHECK(station.Correction(10) == 0);
  CHECK(station.Correction(11) == Approx(0.008).margin(1e-12));
  CHECK(station.largest_step_m() < 0.004 / kRamp_s * RtdeServer::kCycle_s * 1.01);
}

TEST_CASE("a correction that changes is followed at the largest speed") {
  Station station;
  double after_half = 0;
  station.Run(kRamp_s + 2, [&](double time_s) {
    station.Write(time_s < kRamp_s + 0.1 ? 0.001 : 0.004);
    if (time_s < kRamp_s + 0.1 + 0.3) after_half = station.Correction();
  });
  CHECK(after_half == Approx(0.001 + 0.3 * kMaxSpeed).margin(3e-5));
  CHECK(station.Correction() == Approx(0.004).margin(1e-9));
  CHECK(station.largest_step_m() <= kMaxSpeed * RtdeServer::kCycle_s * 1.01);
}

TEST_CASE("a correction beyond the limit is refused, not cut") {
  Station station;
  station.Write(kMax_m + 0.001);
  station.Run(kRamp_s + 0.1, [](double) {});
  CHECK(station.Correction() == 0);
  CHECK_FALSE(station.Ready());
  station.Write(kMax_m - 0.001);
  station.Run(kRamp_s + 0.6, [](double) {});
  CHECK(station.Correction() == Approx(kMax_m - 0.001).margin(1e-9));
  CHECK(station.Ready());
}

TEST_CASE("after a pause, a client that died in it is not taken for alive") {
  Station station;
  station.Write(0.004);
  bool ready = true;
  station.Run(kRamp_s + 1, [&](double time_s) {
    if (time_s < kRamp_s + 0.5) return;
    if (station.alive)
      station.Pause(1000);
    else
      ready = ready && station.Ready();
    station.alive = false;
  });
  CHECK_FALSE(station.Ready());
  CHECK_FALSE(ready);
}

TEST_CASE("whatever a client does, no step of a target is larger than the limits allow") {
  std::mt19937 random(GENERATE(1U, 2U, 3U));
  std::uniform_real_distribution<double> any(0, 1);
  Station station;
  double next_s = 0;
  station.Run(12, [&](double time_s) {
    if (time_s < next_s) return;
    next_s = time_s + 0.8 * any(random);
    station.alive = any(random) < 0.7;
    station.Write(1.9 * kMax_m * (any(random) - 0.5),
                  any(random) < 0.2 ? 0 : static_cast<int>(1e3 * time_s),
                  any(random) < 0.8 ? 10 : 11, any(random) < 0.1 ? 0 : 300);
  });
  CHECK(station.largest_step_m() > 0);
  CHECK(station.largest_step_m() <= kStepLimit_m);
}

}  // namespace virtual_ur
