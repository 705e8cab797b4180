// The thread beside the drawing one: it reads object tables and meshes, and measures.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

#include "app/log/log_entry.h"
#include "app/view_process/measuring.h"
#include "app/view_process/scene_stock.h"

namespace plumbline {

/// At lower priority than drawing. Measures the newest state that it was given; states that come
/// while it works are passed over.
class SceneWorker {
 public:
  SceneWorker(std::string objects_file, std::optional<TagDatabase> tags, double near_m,
              const LogSink& sink);
  ~SceneWorker();
  SceneWorker(const SceneWorker&) = delete;
  SceneWorker& operator=(const SceneWorker&) = delete;

  void Give(MeasureInput input);
  std::shared_ptr<const SceneNow> Scene() const;
  std::shared_ptr<const Measured> Newest() const;  ///< null: nothing was measured yet

 private:
  void Run();

  SceneStock stock_;
  std::shared_ptr<const SceneNow> taken_;  ///< by measuring_; of the thread
  Measuring measuring_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool end_ = false;
  std::optional<MeasureInput> input_;
  std::shared_ptr<const SceneNow> scene_ = std::make_shared<SceneNow>();
  std::shared_ptr<const Measured> measured_;
  std::thread thread_;
};

}  // namespace plumbline
