// Benchmark of the latency from a zoom change to "stale" in the PLC mailbox while frames are
// tracked.
#include <fmt/core.h>

#include <algorithm>
#include <random>

#include "app/vision/camera/camera_supervisor.h"
#include "tests/app/vision/camera/camera_scene.h"
#include "tests/bench/rows.h"
#include "tests/bench/started_program.h"
#include "tests/drivers/zoom/fake_visca_camera.h"

namespace {

using namespace plumbline;

constexpr int kHere = 4000, kThere = 6000;
constexpr double kAnswer_s = 0.004;  ///< answer time of a HID bridge: two reports each way

/// In-process substitute for a HID lens or V4L2 control that only models the answer time.
class FastSensor : public zoom::ZoomSensor {
 public:
  explicit FastSensor(const std::atomic<int>& zoom) : zoom_(zoom) {}
  zoom::ZoomResult Read(lens::ZoomReading& reading) override {
    std::this_thread::sleep_for(std::chrono::duration<double>(kAnswer_s));
    reading = {};
    reading.zoom_counts = zoom_;
    reading.time_s = MonotonicSeconds();
    return zoom::ZoomResult::kOk;
  }
  std::string_view problem() const override { return {}; }

 private:
  const std::atomic<int>& zoom_;
};

/// Fills the state directory with a lens for both zooms and a matching image.
void MakeState(const std::string& folder) {
  auto store = vision::LensStore::Open(folder + "/lenses.sqlite");
  for (const int zoom : {kHere, kThere}) {
    vision::LensEntry entry;
    entry.key = {"bench", "mode", zoom, std::nullopt};
    entry.lens = test::LensOfCamera(renderer::ZoomLens(2600));
    entry.covariance.diagonal().head<9>() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
    entry.size = {1920, 1080};
    entry.utc = "2026-01-01T00:00:00Z";
    if (!store || !store.value().Append(entry)) std::abort();
  }
  const test::ShownImage image(folder);
  image.Show(
      test::DrawCell(renderer::ZoomLens(2600), test::CellInCamera(), test::GripperInCamera()));
}

bool Await(vision::CameraLink& link, bool stale, double timeout_s) {
  const double give_up_s = MonotonicSeconds() + timeout_s;
  while (MonotonicSeconds() < give_up_s) {
    if (link.status.Read()->lens_stale == stale) return true;
    std::this_thread::sleep_for(std::chrono::microseconds(200));
  }
  return false;
}

void Measure(const char* name, std::unique_ptr<zoom::ZoomSensor> sensor, double period_s,
             std::atomic<int>& zoom, int changes, double answer_s, double limit_ms) {
  std::vector<double> waits_ms;
  {
    const bench::WorkFolder state;
    MakeState(state.path());
    config::VisionConfig vision;
    config::CameraConfig& config = vision.cameras.emplace_back();
    config.kind = "recorded";
    config.connection.recorded = {state.path() + "/frames", 20, true, true, "bench", "mode"};
    config.zoom.period_s = period_s;
    config.zoom.supervision.settle_s = 0.05;
    vision.tags.database.bodies = {test::CellTags(), test::GripperBody()};
    auto devices = vision::MakeCameraDevices(config, vision.tags);
    if (!devices) std::abort();
    devices.value().zoom = std::move(sensor);
    vision::CameraLink link;
    const auto sink = [](const log::LogEntry&) {};
    vision::CameraStores stores(state.path(), test::CellTags(), sink);
    vision::CameraSupervisor watch(config, vision, std::move(devices).value(), stores, "/bin/false",
                                   link, sink);
    watch.Start();
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> phase_s(0, 0.12);
    for (int k = 0; k < changes && Await(link, false, 20); ++k) {
      std::this_thread::sleep_for(std::chrono::duration<double>(phase_s(random)));
      const double turned_s = MonotonicSeconds();
      zoom = zoom == kHere ? kThere : kHere;
      if (Await(link, true, 5)) waits_ms.push_back(1e3 * (MonotonicSeconds() - turned_s));
    }
  }
  std::sort(waits_ms.begin(), waits_ms.end());
  if (static_cast<int>(waits_ms.size()) < changes) {
    fmt::print(stderr, "{}: only {} of {} changes were noticed\n", name, waits_ms.size(), changes);
    std::exit(1);
  }
  bench::Report({.what = fmt::format("zoom change to \"stale\", {}, longest of {}", name, changes),
                 .ours = waits_ms.back(),
                 .unit = "ms",
                 .goal = bench::AtMost(limit_ms),
                 .peer = "limit: a sensor period and its answer",
                 .peers = 1e3 * (period_s + answer_s)});
}

}  // namespace

int main(int argc, char** argv) {
  const int changes = bench::Choose(bench::EffortFrom(argc, argv), 2, 50, 200);
  std::atomic<int> zoom{kHere};
  Measure("in-process substitute for HID at 20 Hz", std::make_unique<FastSensor>(zoom), 0.05, zoom,
          changes, kAnswer_s, 150);
  test::FakeViscaCamera camera(test::CameraAnswers([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(22));  // 5 + 16 bytes at 9600 baud
    return test::BlockOf(zoom, 0, false, false);
  }));
  zoom::ViscaOptions options;
  options.device = camera.device();
  auto visca = zoom::ViscaZoom::Create(options, MonotonicSeconds);
  if (!visca) std::abort();
  Measure("VISCA at 10 Hz over a pty", std::move(visca).value(), zoom::kZoomPeriod_s, zoom, changes,
          0.022, 250);
}
