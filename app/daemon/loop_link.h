// Lock-free mailboxes between the control cycle and the threads beside it: probes out, status in.
#pragma once

#include <semaphore.h>

#include <array>
#include <atomic>
#include <chrono>
#include <ctime>

#include "app/camera/camera_link.h"
#include "drivers/latest.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/monitoring_status.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline {

/// What the cycle hands over: a probe, or the wish to restart the monitor.
struct LoopEvent {
  bool monitor_restart = false;
  Probe probe;
  int model_version = 0;  ///< that predicted
};

/// One writer (the cycle), one reader (the worker); the writer never waits, nothing allocates.
class LoopQueue {
 public:
  LoopQueue() { sem_init(&pushed_, 0, 0); }
  ~LoopQueue() { sem_destroy(&pushed_); }
  LoopQueue(const LoopQueue&) = delete;
  LoopQueue& operator=(const LoopQueue&) = delete;

  bool HasRoom() const { return written_.load() - read_.load() < kSize; }
  /// Only where HasRoom().
  void Push(const LoopEvent& event) {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    events_[at % kSize] = event;
    written_.store(at + 1, std::memory_order_release);
    Wake();
  }
  /// The reader's wait ends now, or its next one at once. Any thread.
  void Wake() { sem_post(&pushed_); }
  /// Waits for a Push() or Wake() since the last wait, for `longest` at most.
  void Wait(std::chrono::milliseconds longest) {
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    const auto whole_s = std::chrono::duration_cast<std::chrono::seconds>(longest);
    until.tv_sec += whole_s.count();
    until.tv_nsec += std::chrono::nanoseconds(longest - whole_s).count();
    if (until.tv_nsec >= 1'000'000'000) {
      until.tv_nsec -= 1'000'000'000;
      ++until.tv_sec;
    }
    if (sem_clockwait(&pushed_, CLOCK_MONOTONIC, &until) != 0) return;
    while (sem_trywait(&pushed_) == 0) {
    }
  }
  /// The oldest event, nullptr where there is none; it stays until Pop().
  const LoopEvent* Front() const {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    return at == written_.load(std::memory_order_acquire) ? nullptr : &events_[at % kSize];
  }
  void Pop() { read_.fetch_add(1, std::memory_order_release); }

 private:
  static constexpr std::size_t kSize = 64;
  std::array<LoopEvent, kSize> events_;
  std::atomic<std::size_t> written_{0}, read_{0};
  sem_t pushed_;
};

struct LoopLink {
  LoopQueue queue;
  /// Written by the worker, read by the cycle and the view.
  Latest<MonitoringStatus> monitoring{2, MonitoringStatus()};
  std::array<CameraLink, kMostCameras> cameras;
  Latest<SceneStatus> scene{1, SceneStatus()};  ///< written by the view, read by the cycle
};

}  // namespace plumbline
