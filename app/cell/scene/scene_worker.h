// Background thread that loads the scene and measures in it.
#pragma once

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "app/base/log/log_entry.h"
#include "app/cell/scene/scene_loader.h"
#include "app/cell/scene/scene_measurer.h"

namespace plumbline::cell {

/// Runs at low priority. Measures in the newest submitted state; states submitted while it is busy
/// replace each other. If none is submitted, it only loads.
class SceneWorker {
 public:
  SceneWorker(std::string objects_file, std::optional<target::TagDatabase> tags, double near_m,
              const log::LogSink& sink);
  ~SceneWorker();
  SceneWorker(const SceneWorker&) = delete;
  SceneWorker& operator=(const SceneWorker&) = delete;

  /// Ends the thread without waiting for it: building trees may take seconds.
  void End();
  bool ended() const { return ended_; }

  void Submit(MeasureInput input);
  std::shared_ptr<const SceneSnapshot> Scene() const;
  /// @return  null before the first measurement
  std::shared_ptr<const SceneMeasurements> Newest() const;

 private:
  void Run();
  void RunUntilEnd();

  const log::LogSink sink_;
  SceneLoader loader_;
  std::shared_ptr<const SceneSnapshot> taken_;  ///< in use by measurer_; accessed by thread_ only
  SceneMeasurer measurer_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::atomic<bool> end_ = false, ended_ = false;
  std::optional<MeasureInput> input_;
  std::shared_ptr<const SceneSnapshot> scene_ = std::make_shared<SceneSnapshot>();
  std::shared_ptr<const SceneMeasurements> measured_;
  std::thread thread_;
};

}  // namespace plumbline::cell
