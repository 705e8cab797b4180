// Supervision of one camera: a thread that reads the zoom sensor and a thread that processes the
// images, both outside the control cycle.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "app/base/config/camera_config.h"
#include "app/vision/camera/board_session.h"
#include "app/vision/camera/board_worker.h"
#include "app/vision/camera/camera_link.h"
#include "app/vision/camera/lens_supervisor.h"
#include "app/vision/camera/supervision_settings.h"
#include "app/vision/camera/tag_baseline_store.h"
#include "app/vision/lens_store/lens_store.h"
#include "app/vision/tracking/tracker.h"
#include "drivers/thread_heartbeat.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

// Lenses and tag baselines of one camera, in the stores that all cameras share.

// Stores shared by the supervisors of all cameras: lenses and reference-tag baselines.

/// Thread-safe lens store that is opened on first use and, after a failure, reopened at most every
/// kRetryInterval_s. All cameras share one connection, so that no camera keeps a damaged file open
/// after it has been replaced by its backup. Callers block on disk access.
class SharedLensStore {
 public:
  static constexpr double kRetryInterval_s = 5;

  /// @param sink  receives a message if opening had to repair or replace the file
  SharedLensStore(std::string path, log::LogSink sink)
      : path_(std::move(path)), sink_(std::move(sink)) {}

  Result<std::optional<LensFound>> Find(const LensKey& key, const LensTolerance& tolerance,
                                        const target::DeclaredFacts& declared);
  /// See LensStore::Withheld(). For the log only: nullopt if the store cannot be read.
  std::optional<LensEntry> Withheld(const LensKey& key, const LensTolerance& tolerance,
                                    const target::DeclaredFacts& declared);
  Result<std::int64_t> Append(const LensEntry& entry);

 private:
  bool Open();

  const std::string path_;
  const log::LogSink sink_;
  std::mutex mutex_;
  std::optional<LensStore> store_;
  double last_attempt_s_ = -1e300;
  std::string problem_;  ///< of the last failed attempt
};

struct CameraStores {
  /// Logs if the baseline file cannot be read.
  /// @param cell  the reference tags
  CameraStores(const std::string& state_directory, const target::Body& cell,
               const log::LogSink& sink);

  SharedLensStore lenses;
  std::string baselines_problem;  ///< why the baseline file could not be read; empty if it could
  TagBaselineStore baselines;
};

/// Calls block on disk access. Not thread-safe; the stores are.
class CameraLenses {
 public:
  /// A lens for a zoom; both null if the store has none.
  struct Found {
    std::shared_ptr<const ActiveLens> lens;
    std::shared_ptr<const TagBaseline> baseline;  ///< null for an interpolated lens
  };

  /// @param stores    must outlive this object
  /// @param declared  a lens that was calibrated under further declarations is not used
  CameraLenses(CameraStores& stores, const lens::ZoomSupervisorSettings& zoom,
               const target::DeclaredFacts& declared, log::LogSink sink);

  /// The lens of a camera for the zoom and focus of `context`. Logs if the store has one that is
  /// not used because a declaration was withdrawn.
  Result<Found> Find(const camera::CameraIdentity& camera, const FrameContext& context);

  /// Logs an accepted calibration and appends it to the store.
  /// @param temp_C  of the robot; NaN if unknown
  /// @return        the id of the lens
  Result<std::int64_t> Store(const camera::CameraIdentity& camera, const FrameContext& context,
                             const BoardSession& session, double temp_C);

  /// Stores the residuals of the reference tags when the lens was last verified. A lens that is
  /// interpolated or not stored has no baseline.
  void StoreBaseline(const ActiveLens& lens, const TagBaseline& baseline);

  /// Stores that the reference tags contradict the lens, so that a restart does not request the
  /// same calibration again.
  void StoreContradiction(const ActiveLens& lens);

 private:
  CameraStores& stores_;
  const lens::ZoomSupervisorSettings zoom_;
  const target::DeclaredFacts declared_;
  const log::LogSink sink_;
};

// The configured devices of one camera: the camera itself, its zoom sensor and its tag tracker.

struct CameraDevices {
  std::unique_ptr<camera::Camera> camera;
  std::unique_ptr<zoom::ZoomSensor> zoom;
  std::unique_ptr<Tracker> tracker;
};

/// Creates the devices without connecting to them.
/// @return  an error that names the configuration key if one cannot be created
Result<CameraDevices> MakeCameraDevices(const config::CameraConfig& config,
                                        const config::TagsConfig& tags);

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
  /// @param lens      the lens used for `seen`; null if there is none
  /// @param guidance  null unless the board is captured
  using Show = std::function<void(camera::Camera& camera, const camera::CameraFrame& frame,
                                  const TrackedFrame& seen, const lens::KnownLens* lens,
                                  const lens::BoardGuidance* guidance)>;

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
