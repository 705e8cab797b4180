#include "firmware-like/monitor/drift_monitor.h"

#include <catch2/catch.hpp>
#include <random>

#include "firmware-like/monitor/run_length.h"

namespace plumbline::drift_monitor_test {

using namespace plumbline::monitor;

namespace {

constexpr double kSigma = 5e-5;

class Noise {
 public:
  explicit Noise(unsigned seed) : random_(seed) {}
  Vec3 Next(double sigma = kSigma) {
    return sigma * Vec3(normal_(random_), normal_(random_), normal_(random_));
  }
  Vec3 Direction() { return Next().normalized(); }
  bool Chance(double share) { return std::uniform_real_distribution(0.0, 1.0)(random_) < share; }

 private:
  std::mt19937 random_;
  std::normal_distribution<double> normal_;
};

MonitorDesign Design(int reference_probes) {
  MonitorRequirements wish;
  wish.reference_probes = reference_probes;
  return MonitorDesignFor(wish);
}

}  // namespace

TEST_CASE("every direction is within 28 degrees of a monitored axis") {
  Noise noise(1);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 direction = noise.Direction();
    double nearest = 0;
    for (const Vec3& axis : DriftMonitor::Axes()) {
      nearest = std::max(nearest, std::abs(axis.dot(direction)));
    }
    REQUIRE(nearest > std::cos(28 * 3.14159265358979 / 180));
  }
}

TEST_CASE("a step raises an alarm with its direction, size and first probe") {
  for (const int reference : {0, 20}) {
    CAPTURE(reference);
    const MonitorDesign design = Design(reference);
    int start_off = 0, shift_off = 0, runs = 0;
    for (unsigned seed = 0; seed < 300; ++seed) {
      Noise noise(seed);
      DriftMonitor monitor(design);
      const Vec3 shift_m = 3e-4 * noise.Direction();
      int delay = 0;
      for (int i = 0; i < 60; ++i) monitor.Update(noise.Next());
      if (monitor.alarm()) continue;  // a false alarm: counted by the run-length test
      while (!monitor.alarm() && delay < 100) {
        monitor.Update(noise.Next() + shift_m);
        ++delay;
      }
      ++runs;
      REQUIRE(monitor.alarm());
      CHECK(delay <= 12);
      const DriftAlarm& alarm = *monitor.alarm();
      CHECK(alarm.probe == static_cast<std::uint64_t>(60 + delay));
      const bool close = (alarm.shift_m - shift_m).norm() < 1.5e-4 &&
                         alarm.shift_m.normalized().dot(shift_m.normalized()) > 0.85;
      shift_off += close ? 0 : 1;
      start_off += alarm.first_probe == 61 ? 0 : 1;
    }
    CHECK(runs > 290);
    // Noise just before the step may be mistaken for its start.
    CHECK(shift_off < runs / 20);
    CHECK(start_off < runs / 2);
  }
}

TEST_CASE("single and double outliers raise no alarm and are reported") {
  for (const int outliers : {1, 2}) {
    DriftMonitor monitor(Design(10));
    Noise noise(7);
    for (int i = 0; i < 400; ++i) {
      const bool is_outlier = i > 20 && i % 50 < outliers;
      const ProbeVerdict verdict =
          monitor.Update(noise.Next() + (is_outlier ? Vec3(0, 0.02, 0) : Vec3::Zero()));
      CHECK(verdict.outlier == is_outlier);
      CHECK_FALSE(verdict.raised);
    }
    CHECK_FALSE(monitor.alarm());
  }
}

TEST_CASE("an outlier among the reference probes does not shift the reference") {
  DriftMonitor monitor(Design(10));
  Noise noise(3);
  for (int i = 0; i < 10; ++i) {
    CHECK(monitor.learning());
    CHECK(monitor.Update(noise.Next() + (i == 4 ? Vec3(0.05, 0, 0) : Vec3::Zero())).learning);
  }
  CHECK_FALSE(monitor.learning());
  CHECK(monitor.reference_m().norm() < 4 * kSigma / std::sqrt(10.0) + 3 * kSigma / 10);
  // Nor does it inflate the scatter: its own square would make it 300 sigma.
  CHECK(monitor.sigma_m() >= kSigma);
  CHECK(monitor.sigma_m() < 1.5 * kSigma);
}

TEST_CASE(
    "a constant offset is absorbed by the reference; without reference probes it raises an alarm") {
  const Vec3 offset_m(0, 0, 1e-3);
  Noise noise(5);
  DriftMonitor against_itself(Design(20)), against_model(Design(0));
  for (int i = 0; i < 200; ++i) {
    const Vec3 residual_m = offset_m + noise.Next();
    against_itself.Update(residual_m);
    against_model.Update(residual_m);
  }
  CHECK_FALSE(against_itself.alarm());
  REQUIRE(against_model.alarm());
  CHECK(against_model.alarm()->probe < 12);
  CHECK(against_model.alarm()->first_probe == 1);
}

TEST_CASE("a slow drift is detected") {
  DriftMonitor monitor(Design(20));
  Noise noise(11);
  double drift_m = 0;
  for (int i = 0; i < 2000 && !monitor.alarm(); ++i) {
    if (i > 20) drift_m += 5e-7;  // a hundredth of sigma a probe
    monitor.Update(noise.Next() + Vec3(drift_m, 0, 0));
  }
  REQUIRE(monitor.alarm());
  CHECK(drift_m < 1.5e-4);
}

TEST_CASE("a larger scatter is estimated from the reference and raises no alarm") {
  DriftMonitor monitor(Design(20));
  Noise noise(13);
  for (int i = 0; i < 3000; ++i) monitor.Update(noise.Next(4 * kSigma));
  CHECK(monitor.sigma_m() > 2.5 * kSigma);
  CHECK(monitor.sigma_m() < 6 * kSigma);
  CHECK_FALSE(monitor.alarm());
}

TEST_CASE(
    "a scatter above the declared one is detected with any reference, one below is not used") {
  for (const int reference : {0, 20}) {
    for (const double scale : {0.5, 1.4, 3.0}) {
      CAPTURE(reference, scale);
      double sum = 0;
      const int runs = 200;
      DriftMonitor monitor(Design(reference));
      for (unsigned seed = 0; seed < runs; ++seed) {
        Noise noise(seed);
        monitor.Restart();
        // With the model as reference there may be an offset, which is not scatter.
        const Vec3 offset_m = reference == 0 ? Vec3(0, 0, 0.5 * kSigma) : Vec3(0, 0, 1);
        for (int i = 0; i < 20; ++i) monitor.Update(offset_m + noise.Next(scale * kSigma));
        CHECK(monitor.sigma_m() >= kSigma);
        sum += monitor.sigma_m() / kSigma;
      }
      CHECK(sum / runs == Approx(std::max(1.0, 1.06 * scale)).epsilon(0.06));
    }
  }
}

TEST_CASE("a restart discards everything") {
  DriftMonitor monitor(Design(0)), fresh(Design(0));
  for (int i = 0; i < 20; ++i) monitor.Update(Vec3(1e-3, 0, 0));
  REQUIRE(monitor.alarm());
  monitor.Restart();
  CHECK_FALSE(monitor.alarm());
  Noise noise(17);
  for (int i = 0; i < 100; ++i) {
    const Vec3 residual_m = noise.Next();
    CHECK(monitor.Update(residual_m).statistic == fresh.Update(residual_m).statistic);
  }
}

namespace {

/// A monitor with a reference of 20 probes, probe k shifted by `offset(k)`.
template <typename Offset>
DriftMonitor WithReference(unsigned seed, const Offset& offset, double scale = 1) {
  static const MonitorDesign design = Design(20);
  DriftMonitor monitor(design);
  Noise noise(seed);
  for (int k = 0; k < 20; ++k) monitor.Update(noise.Next(scale * kSigma) + offset(k));
  return monitor;
}

}  // namespace

TEST_CASE("a reference whose probes disagree is refused, and nothing is monitored") {
  struct Case {
    const char* name;
    Vec3 (*offset)(int);
    ReferenceFault fault;
  };
  const Case cases[] = {
      {"a third at another place",
       [](int k) { return k % 3 == 0 ? Vec3(0, 1e-3, 0) : Vec3(0, 0, 0); },
       ReferenceFault::kOutliers},
      {"half at another place, metres away",
       [](int k) { return k % 2 == 0 ? Vec3(2, 0, 0) : Vec3(0, 0, 0); }, ReferenceFault::kScatter},
      {"a step of 0.6 mm in the middle",
       [](int k) { return k < 10 ? Vec3(0, 0, 0) : Vec3(0, 0, 6e-4); }, ReferenceFault::kTrend},
      {"a drift of 1.5 mm", [](int k) { return Vec3(8e-5 * k, 0, 0); }, ReferenceFault::kTrend},
  };
  for (const Case& c : cases) {
    CAPTURE(c.name);
    for (unsigned seed = 0; seed < 50; ++seed) {
      DriftMonitor monitor = WithReference(seed, c.offset);
      REQUIRE(monitor.reference_fault() == c.fault);
      CHECK(monitor.reference_refused());
      CHECK_FALSE(monitor.learning());
      for (int k = 0; k < 50; ++k) {
        const ProbeVerdict verdict = monitor.Update(Vec3(1, 0, 0));
        REQUIRE(verdict.unmonitored);
        REQUIRE_FALSE(verdict.raised);
      }
      CHECK(monitor.statistic() == 0);
      CHECK_FALSE(monitor.alarm());
      monitor.Restart();
      CHECK(monitor.learning());
    }
  }
}

TEST_CASE("the probes that disagree are identified") {
  const DriftMonitor monitor =
      WithReference(1, [](int k) { return k % 3 == 0 ? Vec3(0, 1e-3, 0) : Vec3(0, 0, 0); });
  for (int k = 0; k < 20; ++k) CHECK(monitor.Disagrees(k) == (k % 3 == 0));
}

TEST_CASE(
    "a sound reference is hardly ever refused, nor is one with a realistic share of outliers") {
  const auto none = [](int) { return Vec3(0, 0, 0); };
  const auto poses = [](int k) { return Vec3(2e-4 * (k % 4), -2e-4 * (k % 3), 0); };
  const auto outliers = [](int k) { return k % 7 == 3 ? Vec3(0.01, 0, 0) : Vec3(0, 0, 0); };
  int refused = 0;
  for (unsigned seed = 0; seed < 2000; ++seed) {
    refused += WithReference(seed, none).reference_refused() ? 1 : 0;
    refused += WithReference(seed, none, 3).reference_refused() ? 1 : 0;
    refused += WithReference(seed, poses).reference_refused() ? 1 : 0;
    refused += WithReference(seed, outliers).reference_refused() ? 1 : 0;
  }
  CHECK(refused <= 3);
}

}  // namespace plumbline::drift_monitor_test
