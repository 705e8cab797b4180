#include "app/cell/scene/scene_worker.h"

#include <fmt/format.h>
#include <malloc.h>
#include <pthread.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <exception>

#include "drivers/clock.h"

namespace plumbline::cell {
namespace {

constexpr std::chrono::milliseconds kLongestWait{50};
constexpr int kMeasuringNice = 10;

}  // namespace

SceneWorker::SceneWorker(std::string objects_file, std::optional<target::TagDatabase> tags,
                         double near_m, const log::LogSink& sink)
    : sink_(sink),
      loader_(std::move(objects_file), std::move(tags), sink),
      measurer_(near_m, sink),
      thread_([this] { Run(); }) {
  pthread_setname_np(thread_.native_handle(), "objects");
}

SceneWorker::~SceneWorker() {
  End();
  thread_.join();
}

void SceneWorker::End() {
  end_ = true;
  wake_.notify_one();  // the thread looks at end_ at least every kLongestWait
}

void SceneWorker::Submit(MeasureInput input) {
  {
    const std::lock_guard lock(mutex_);
    input_ = std::move(input);
  }
  wake_.notify_one();
}

std::shared_ptr<const SceneSnapshot> SceneWorker::Scene() const {
  const std::lock_guard lock(mutex_);
  return scene_;
}

std::shared_ptr<const SceneMeasurements> SceneWorker::Newest() const {
  const std::lock_guard lock(mutex_);
  return measured_;
}

void SceneWorker::Run() {
  try {
    RunUntilEnd();
  } catch (const std::exception& why) {  // of memory, or of the library that measures
    sink_(
        {log::Event::kViewFault,
         fmt::format("interference is not measured any more: {}. Check the machine's free memory, "
                     "simplify the meshes of the object table, then restart the daemon",
                     why.what()),
         {{"ABOUT", "objects"}}});
  }
  ended_ = true;
}

void SceneWorker::RunUntilEnd() {
  // On Linux this affects the calling thread only.
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kMeasuringNice);
  for (;;) {
    std::optional<MeasureInput> input;
    {
      std::unique_lock lock(mutex_);
      wake_.wait_for(lock, kLongestWait, [this] { return end_ || input_.has_value(); });
      if (end_) return;
      input.swap(input_);
    }
    const auto scene = loader_.Poll(MonotonicSeconds());
    {
      const std::lock_guard lock(mutex_);
      scene_ = scene;
    }
    const bool other = scene != taken_;
    if (input) measurer_.SetScene(scene, &end_);
    if (other) malloc_trim(0);  // loading needs many times the memory that remains in use
    taken_ = scene;
    if (!input) continue;
    auto measured =
        std::make_shared<SceneMeasurements>(measurer_.Measure(*input, MonotonicSeconds()));
    const std::lock_guard lock(mutex_);
    measured_ = std::move(measured);
  }
}

}  // namespace plumbline::cell
