// A CameraSupervisor with a recorded camera, a zoom sensor set by the test and a status reader like
// the control cycle.
#pragma once

#include <algorithm>
#include <atomic>
#include <catch2/catch.hpp>
#include <chrono>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "app/vision/camera/camera_supervisor.h"
#include "tests/app/temporary_folder.h"
#include "tests/app/vision/camera/camera_scene.h"

namespace plumbline::test {

using namespace plumbline::vision;

inline constexpr int kWaits = 6000;  // of 10 ms: a minute, for a busy machine

class SettableZoom : public zoom::ZoomSensor {
 public:
  explicit SettableZoom(const std::atomic<int>& zoom) : zoom_(zoom) {}
  zoom::ZoomResult Read(lens::ZoomReading& reading) override {
    if (zoom_ < 0) return zoom::ZoomResult::kTimeout;
    reading = {};
    reading.zoom_counts = zoom_;
    reading.time_s = MonotonicSeconds();
    return zoom::ZoomResult::kOk;
  }
  std::string_view problem() const override { return "no reading"; }

 private:
  const std::atomic<int>& zoom_;
};

/// Stores the lens of the test camera for zoom 100.
inline void StoreLens(const std::string& folder, image::ImageSize size) {
  auto store = vision::LensStore::Open(folder + "/lenses.sqlite");
  vision::LensEntry entry;
  entry.key = {"test camera", "mode", 100, std::nullopt};
  entry.lens = test::LensOfCamera(renderer::ZoomLens(2600));
  entry.covariance.diagonal().head<9>() << 0.04, 0.04, 0.04, 0.04, 1e-9, 1e-9, 1e-12, 1e-12, 0;
  entry.size = size;
  entry.utc = "2026-01-01T00:00:00Z";
  REQUIRE(store.value().Append(entry));
}

/// A supervisor whose camera shows an image file and whose store has a lens for zoom 100.
struct SupervisedCamera {
  TemporaryFolder folder;
  ShownImage image{folder.path()};
  std::atomic<int> zoom{100};
  double turned_rad = 0;
  CameraLink link;
  std::mutex mutex;
  std::vector<std::string> log;
  std::vector<lens::Vec2> wanted_px;
  std::optional<CameraStores> stores;
  std::optional<CameraSupervisor> supervisor;

  using Change = std::function<void(config::VisionConfig&)>;
  explicit SupervisedCamera(double patience_s, image::ImageSize lens_size = {1920, 1080},
                            double turned = 0, const Change& change = {},
                            const char* worker = "/bin/false")
      : turned_rad(turned) {
    ShowCell();
    StoreLens(folder.path(), lens_size);
    config::VisionConfig vision;
    config::CameraConfig& config = vision.cameras.emplace_back();
    config.kind = "recorded";
    config.connection.recorded = {folder.path() + "/frames", 20, true, true, "test camera", "mode"};
    config.zoom.period_s = 0.02;
    config.zoom.supervision.lost_after_s = 30;
    vision.tags.database.bodies = {CellTags(), GripperBody()};
    vision.board.by_itself = false;
    vision.board.patience_s = patience_s;
    if (change) change(vision);
    auto devices = MakeCameraDevices(config, vision.tags);
    REQUIRE(devices);
    devices.value().zoom = std::make_unique<SettableZoom>(zoom);
    const auto sink = [this](const log::LogEntry& entry) {
      const std::lock_guard lock(mutex);
      log.push_back(entry.text);
    };
    stores.emplace(folder.path(), config::CellReferenceTags(vision.tags), sink);
    const auto show = [this](camera::Camera&, const camera::CameraFrame&, const TrackedFrame&,
                             const lens::KnownLens*, const lens::BoardGuidance* guidance) {
      const std::lock_guard lock(mutex);
      wanted_px = guidance != nullptr ? guidance->wanted_px : std::vector<lens::Vec2>{};
    };
    supervisor.emplace(config, vision, std::move(devices).value(), *stores, worker, link, sink,
                       show);
    supervisor->Start();
  }
  void ShowCell() const {
    image.Show(DrawCell(renderer::ZoomLens(2600), CellInCamera(), GripperInCamera(), turned_rad));
  }
  /// Outline in which the board is wanted; empty if none is shown.
  std::vector<lens::Vec2> Outline() {
    const std::lock_guard lock(mutex);
    return wanted_px;
  }
  int Count(const std::string& text) {
    const std::lock_guard lock(mutex);
    return static_cast<int>(std::count_if(log.begin(), log.end(), [&](const std::string& line) {
      return line.find(text) != std::string::npos;
    }));
  }
  bool Becomes(lens::ZoomState state) {
    for (int wait = 0; wait < kWaits; ++wait) {
      if (link.status.Read()->state == state) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
  bool Says(const std::string& text) {
    for (int wait = 0; wait < kWaits; ++wait) {
      {
        const std::lock_guard lock(mutex);
        for (const std::string& line : log) {
          if (line.find(text) != std::string::npos) return true;
        }
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    return false;
  }
};

}  // namespace plumbline::test
