// Between the cycle and what works beside it: probes one way, what the PLC is told the other.
#pragma once

#include <array>
#include <atomic>

#include "app/camera/camera_link.h"
#include "drivers/latest.h"
#include "drivers/plc/register_map.h"

namespace plumbline {

/// What the cycle hands over: a probe, or the wish to restart the monitor.
struct LoopEvent {
  bool monitor_restart = false;
  Probe probe;
  int model_version = 0;  ///< that predicted
};

/// One writer (the cycle), one reader (the worker); neither waits, nothing allocates.
class LoopQueue {
 public:
  bool HasRoom() const { return written_.load() - read_.load() < kSize; }
  /// Only where HasRoom().
  void Push(const LoopEvent& event) {
    const std::size_t at = written_.load(std::memory_order_relaxed);
    events_[at % kSize] = event;
    written_.store(at + 1, std::memory_order_release);
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
};

struct LoopLink {
  LoopQueue queue;
  Latest<PlcLoop> told{2, PlcLoop()};  ///< written by the worker, read by the cycle and the view
  std::array<CameraLink, kMostCameras> cameras;
  Latest<PlcScene> scene{1, PlcScene()};  ///< written by the view, read by the cycle
};

}  // namespace plumbline
