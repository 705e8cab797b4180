// Lock-free mailboxes between the control cycle and the other threads: probes out, status in.
#pragma once

#include <semaphore.h>

#include <array>
#include <atomic>
#include <chrono>
#include <ctime>

#include "app/vision/camera/camera_link.h"
#include "drivers/latest.h"
#include "firmware-like/machine.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/gauge_status.h"
#include "firmware-like/status/monitoring_status.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline::cell {

/// Message from the control cycle to the monitoring worker: a probe, or a request to restart the
/// drift monitor.
struct CycleEvent {
  bool monitor_restart = false;
  Probe probe;
  int model_version = 0;          ///< of the model that predicted the probe
  std::uint32_t gauge_press = 0;  ///< GaugePress::number, if a gauge's button made the probe
};

/// Bounded single-producer single-consumer queue: the control cycle writes, the monitoring worker
/// reads. The writer never waits, and nothing allocates.
class CycleEventQueue {
 public:
  CycleEventQueue() { sem_init(&pushed_, 0, 0); }
  ~CycleEventQueue() { sem_destroy(&pushed_); }
  CycleEventQueue(const CycleEventQueue&) = delete;
  CycleEventQueue& operator=(const CycleEventQueue&) = delete;

  bool HasRoom() const { return written_.load() - read_.load() < kSize; }
  /// Requires HasRoom().
  void Push(const CycleEvent& event) {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    events_[at % kSize] = event;
    written_.store(at + 1, std::memory_order_release);
    Wake();
  }
  /// Ends the reader's current wait, or its next one if it is not waiting. Any thread.
  void Wake() { sem_post(&pushed_); }
  /// Waits at most `timeout` for a Push() or Wake() that came after the previous wait.
  void Wait(std::chrono::milliseconds timeout) {
    timespec until{};
    clock_gettime(CLOCK_MONOTONIC, &until);
    const auto whole_s = std::chrono::duration_cast<std::chrono::seconds>(timeout);
    until.tv_sec += whole_s.count();
    until.tv_nsec += std::chrono::nanoseconds(timeout - whole_s).count();
    if (until.tv_nsec >= 1'000'000'000) {
      until.tv_nsec -= 1'000'000'000;
      ++until.tv_sec;
    }
    if (sem_clockwait(&pushed_, CLOCK_MONOTONIC, &until) != 0) return;
    while (sem_trywait(&pushed_) == 0) {
    }
  }
  /// The oldest event, which remains in the queue until Pop(); nullptr if the queue is empty.
  const CycleEvent* Front() const {
    const std::size_t at = read_.load(std::memory_order_relaxed);
    return at == written_.load(std::memory_order_acquire) ? nullptr : &events_[at % kSize];
  }
  void Pop() { read_.fetch_add(1, std::memory_order_release); }

 private:
  static constexpr std::size_t kSize = 64;
  std::array<CycleEvent, kSize> events_;
  std::atomic<std::size_t> written_{0}, read_{0};
  sem_t pushed_;
};

/// The robot may have moved after a longer time; a later cycle does not record the press.
inline constexpr double kGaugePressValid_s = 0.5;

/// Presses of gauge buttons on their way to the control cycle, one at a time.
struct GaugeMailbox {
  Latest<GaugePress> press{1, GaugePress()};  ///< written by the gauge worker
  /// GaugePress::number of the latest press that the cycle handled, times 256, plus its code.
  std::atomic<std::uint64_t> handled{0};
  /// GaugePress::number of the latest press that the monitoring worker took from the queue, and of
  /// the latest of which the journal has no row. Set in the opposite order.
  std::atomic<std::uint32_t> taken{0}, dropped{0};
  /// Written by the gauge worker, read by the control cycle.
  Latest<status::GaugeStatuses> status{1, status::GaugeStatuses()};
};

struct CycleMailboxes {
  CycleEventQueue queue;
  /// Written by the monitoring worker, read by the control cycle and the display feed.
  Latest<status::MonitoringStatus> monitoring{2, status::MonitoringStatus()};
  std::array<vision::CameraLink, model::kMaxCameras> cameras;
  Latest<status::SceneStatus> scene{
      1, status::SceneStatus()};  ///< written by the display feed, read by the cycle
  GaugeMailbox gauges;
  /// ControllerWatch::compensated_twice(); written by the main thread, read by the cycle.
  std::atomic<bool> compensated_twice{false};
};

}  // namespace plumbline::cell
