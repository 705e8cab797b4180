// A camera's watch: two threads beside the cycle, one for the zoom sensor, one for the images.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/camera/board_session.h"
#include "app/camera/board_worker.h"
#include "app/camera/camera_devices.h"
#include "app/camera/camera_link.h"
#include "app/camera/watch_core.h"
#include "app/camera/watch_stores.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline {

/// The sensor's thread reads the zoom at its period and does nothing else, so that a change is told
/// within a period and an answer, whatever the images cost. The images' thread captures, tracks,
/// looks at the marks, looks lenses up and captures the board. What both know is in the core,
/// behind one lock that is held for microseconds; the cycle reads the published values and waits
/// for nobody. Several watches share the stores and nothing else.
class CameraWatch {
 public:
  /// What is done with each image beside measuring: it is shown. Called by the images' thread, with
  /// what was seen in it (nothing while the board is captured) and the lens in use, or null.
  using Show = std::function<void(Camera& camera, const CameraFrame& frame,
                                  const TrackedFrame& seen, const Lens* lens)>;

  /// @param camera     one of `vision`
  /// @param plumbline  the program that looks for the board
  CameraWatch(const CameraConfig& camera, const VisionConfig& vision, CameraDevices devices,
              WatchStores& stores, std::string plumbline, CameraLink& link, LogSink sink,
              Show show = nullptr);
  ~CameraWatch();
  CameraWatch(const CameraWatch&) = delete;
  CameraWatch& operator=(const CameraWatch&) = delete;

  void Start();
  void Stop();
  const Pulse& sensor_pulse() const { return sensor_pulse_; }
  const Pulse& image_pulse() const { return image_pulse_; }

 private:
  void ReadSensor();
  void ReadImages();
  void Obey();
  void TakeFrame(const CameraFrame& frame);
  void Track(const WatchOrders& asked, const CameraFrame& frame);
  void LookUp(const WatchOrders& asked);
  LensKey KeyOf(const WatchOrders& asked) const;
  void WatchForBoard(const CameraFrame& frame);
  void CaptureBoard(const CameraFrame& frame);
  void WaitForFrames(double now_s);
  void FinishBoard();
  void KeepLens(const BoardSession& session, const WatchOrders& asked);
  void KeepMarks(const WatchOrders& asked, const MarksMemory& memory);
  void Pause(double seconds);
  WatchOrders Orders();
  /// Under the lock: `does` with the core, then what came of it is published.
  template <typename Does>
  auto WithCore(Does does) {
    const std::lock_guard lock(mutex_);
    struct Published {
      CameraWatch& watch;
      ~Published() {
        watch.link_.status.Begin() = watch.core_.Status();
        watch.link_.status.Publish();
      }
    } const published{*this};
    return does(core_);
  }

  const ZoomConfig zoom_;
  const BoardConfig board_;
  const CameraDevices devices_;
  WatchStores& stores_;
  const std::string plumbline_;
  CameraLink& link_;
  const LogSink sink_;
  const Show show_;

  std::mutex mutex_;  ///< of core_, stop_ and the writer's side of link_.status
  std::condition_variable wake_;
  WatchCore core_;
  bool stop_ = false;
  std::thread sensor_thread_, image_thread_;
  Pulse sensor_pulse_, image_pulse_;

  // The images' thread's own.
  std::optional<BoardWorker> worker_;
  std::optional<BoardSession> session_;
  std::optional<double> blind_s_;  ///< since when a capture waits for its first frame
  bool odd_size_ = false;          ///< told: the images have another size than the lens
  double asked_image_s_ = 0;       ///< when the frame was taken that the worker has
  double looked_s_ = -1e9;         ///< for a board that comes into view
  /// The rest of the lens in which the worker was given a frame of such a look; nothing: what it
  /// has is of a capture.
  std::optional<std::uint64_t> look_rest_;
  std::uint64_t rest_ = 0;  ///< that the tracker's predictions are of
  std::uint32_t started_ = 0, cancelled_ = 0;
};

}  // namespace plumbline
