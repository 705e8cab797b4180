// Supervision of one camera: a thread that reads the zoom sensor and a thread that processes the
// images, both outside the control cycle.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/vision/camera/board_session.h"
#include "app/vision/camera/board_worker.h"
#include "app/vision/camera/camera_devices.h"
#include "app/vision/camera/camera_lenses.h"
#include "app/vision/camera/camera_link.h"
#include "app/vision/camera/lens_supervisor.h"
#include "app/vision/camera/supervision_settings.h"
#include "drivers/thread_heartbeat.h"

namespace plumbline::vision {

/// The zoom thread only reads the sensor, so a zoom change is reported within one sensor period
/// (plus the sensor's response time) however long the images take. The image thread captures
/// frames, tracks the bodies, checks the reference tags, looks up lenses and captures the
/// calibration board. State shared by both threads is in the LensSupervisor, behind one mutex that
/// is held for microseconds. The control cycle reads the published status and never blocks on
/// either thread. The supervisors of several cameras share only the CameraStores.
class CameraSupervisor {
 public:
  /// Display hook, called by the image thread for each frame.
  /// @param seen  tracked tags and bodies; empty while the board is captured
  /// @param lens  the lens used for `seen`; null if there is none
  using Show = std::function<void(camera::Camera& camera, const camera::CameraFrame& frame,
                                  const TrackedFrame& seen, const lens::KnownLens* lens)>;

  /// @param camera     one of `vision.cameras`
  /// @param stores     shared by all cameras; must outlive this object
  /// @param plumbline  path of the program that is run as the board worker
  /// @param link       mailboxes to the control cycle; must outlive this object
  CameraSupervisor(const config::CameraConfig& camera, const config::VisionConfig& vision,
                   CameraDevices devices, CameraStores& stores, std::string plumbline,
                   CameraLink& link, log::LogSink sink, Show show = nullptr);
  ~CameraSupervisor();
  CameraSupervisor(const CameraSupervisor&) = delete;
  CameraSupervisor& operator=(const CameraSupervisor&) = delete;

  void Start();
  void Stop();
  const ThreadHeartbeat& sensor_heartbeat() const { return sensor_heartbeat_; }
  const ThreadHeartbeat& image_heartbeat() const { return image_heartbeat_; }

 private:
  void RunZoomThread();
  void RunImageThread();
  void HandleRequests();
  void TakeFrame(const camera::CameraFrame& frame);
  void Track(const FrameContext& context, const camera::CameraFrame& frame);
  void LookUpLens(const FrameContext& context);
  void LookForBoard(const camera::CameraFrame& frame);
  void CaptureBoard(const camera::CameraFrame& frame);
  void OnMissingFrame(double now_s);
  void FinishBoard();
  void StoreLens(const BoardSession& session, const FrameContext& context);
  void Pause(double seconds);
  FrameContext CurrentContext();
  /// Calls `function` with the LensSupervisor under the mutex, then publishes its status.
  template <typename Function>
  auto WithSupervisor(Function function) {
    const std::lock_guard lock(mutex_);
    struct PublishAtExit {
      CameraSupervisor& owner;
      ~PublishAtExit() {
        owner.link_.status.Begin() = owner.supervisor_.Status();
        owner.link_.status.Publish();
      }
    } const publish{*this};
    return function(supervisor_);
  }

  const config::ZoomConfig zoom_;
  const config::BoardConfig board_;
  const target::DeclaredFacts declared_;
  const CameraDevices devices_;
  CameraLenses lenses_;  ///< used by the image thread only
  const std::string plumbline_;
  CameraLink& link_;
  const log::LogSink sink_;
  const Show show_;

  std::mutex mutex_;  ///< guards supervisor_, stop_ and writing of link_.status
  std::condition_variable wake_;
  LensSupervisor supervisor_;
  bool stop_ = false;
  std::thread zoom_thread_, image_thread_;
  ThreadHeartbeat sensor_heartbeat_, image_heartbeat_;

  // Used by the image thread only.
  std::optional<BoardWorker> worker_;
  std::optional<BoardSession> session_;
  std::optional<double> waiting_since_s_;  ///< start of a capture that has not had a frame yet
  bool size_mismatch_ = false;             ///< that image and lens differ in size has been logged
  double worker_image_s_ = 0;  ///< time of the capture frame the worker is processing; 0: none
  /// A calibration was refused, and its board has not left the view since: it starts no other one.
  bool refused_board_in_view_ = false;
  int searches_without_board_ = 0;
  double searched_s_ = -1e9;  ///< last time the worker was given a frame to search for a board
  /// The standstill during which that search frame was taken; nullopt while a capture uses the
  /// worker.
  std::optional<std::uint64_t> search_standstill_;
  std::uint64_t standstill_ = 0;  ///< the standstill that the tracker's predictions belong to
  std::uint32_t handled_starts_ = 0, handled_cancels_ = 0;
};

}  // namespace plumbline::vision
