#include "app/view_process/scene_worker.h"

#include <malloc.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>

#include "drivers/clock.h"

namespace plumbline {
namespace {

constexpr std::chrono::milliseconds kLongestWait{50};
constexpr int kMeasuringNice = 10;

}  // namespace

SceneWorker::SceneWorker(std::string objects_file, std::optional<TagDatabase> tags, double near_m,
                         const LogSink& sink)
    : stock_(std::move(objects_file), std::move(tags), sink),
      measuring_(near_m, sink),
      thread_([this] { Run(); }) {}

SceneWorker::~SceneWorker() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void SceneWorker::Give(MeasureInput input) {
  {
    const std::lock_guard lock(mutex_);
    input_ = std::move(input);
  }
  wake_.notify_one();
}

std::shared_ptr<const SceneNow> SceneWorker::Scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

std::shared_ptr<const Measured> SceneWorker::Newest() const {
  const std::lock_guard lock(mutex_);
  return measured_;
}

void SceneWorker::Run() {
  // Linux: of this thread alone.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kMeasuringNice);
  for (;;) {
    std::optional<MeasureInput> input;
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, kLongestWait, [this] { return end_ || input_.has_value(); });
      if (end_) return;
      input.swap(input_);
    }
    const auto scene = stock_.Look(MonotonicSeconds());
    {
      const std::lock_guard lock(mutex_);
      scene_ = scene;
    }
    const bool other = scene != taken_;
    measuring_.Take(scene);
    if (other) malloc_trim(0);  // reading and building took many times what is kept
    taken_ = scene;
    if (!input) continue;
    auto measured = std::make_shared<Measured>(measuring_.Measure(*input, MonotonicSeconds()));
    const std::lock_guard lock(mutex_);
    measured_ = std::move(measured);
  }
}

}  // namespace plumbline
