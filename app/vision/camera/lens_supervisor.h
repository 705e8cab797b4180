// Decision logic of a camera's supervision: zoom state, active lens, reference tags, tracked
// bodies.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/log/log_entry.h"
#include "app/vision/camera/measured_tip.h"
#include "app/vision/camera/supervision_settings.h"
#include "app/vision/camera/tag_check.h"
#include "app/vision/lens_store/lens_entry.h"
#include "app/vision/tracking/bodies.h"
#include "drivers/camera/camera.h"
#include "drivers/zoom/zoom.h"
#include "firmware-like/lens/board_guidance.h"
#include "firmware-like/lens/zoom_supervisor.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline::vision {

// Poses of the tracked bodies and the position of the tool tip, for the status of a camera.

class TrackedBodies {
 public:
  /// The bodies of one image.
  /// @param lens  covariance of the lens that they were located with
  void Take(const LensSupervisorSettings& settings, const std::vector<SeenBody>& seen,
            const lens::LensCovariance& lens, double image_s);
  /// No body is valid until the next image.
  void Invalidate();
  /// Restarts the measurement of the tip; the bodies stay valid.
  void ResetTip() { tip_.Reset(); }

  /// Sets the bodies of the status, and its tip if the lens is valid.
  void AddTo(status::CameraStatus& status, bool lens_valid) const;

 private:
  std::array<status::CameraStatus::Body, status::CameraStatus::kMaxBodies> bodies_;
  StationaryPointFilter tip_;
};

// Faults of a camera, its zoom sensor and the lens store; each change is logged once.

class DeviceFaults {
 public:
  explicit DeviceFaults(log::LogSink sink) : sink_(std::move(sink)) {}

  /// Results that say nothing about the device (waiting, no new frame) are ignored.
  void OnSensor(zoom::ZoomResult result, std::string_view problem);
  /// @return  whether this result is a fault that the one before was not
  bool OnCamera(camera::CameraResult result, std::string_view problem, double now_s);
  /// @param fault  empty if the store works
  void OnStore(const std::string& fault);

  bool camera_lost() const { return camera_ != camera::CameraResult::kFrame; }
  bool store_fault() const { return !store_.empty(); }

 private:
  log::LogSink sink_;
  std::optional<camera::CameraResult> camera_;  ///< last logged result
  std::optional<zoom::ZoomResult> sensor_;      ///< last logged result
  double camera_lost_s_ = 0;
  std::string store_;
};

/// Snapshot for the image thread: what to do with the next frame. Passed back with each result, so
/// that results for an earlier lens or zoom are recognized and dropped.
struct FrameContext {
  lens::ZoomState state = lens::ZoomState::kUnknown;
  bool needs_lens = false;        ///< look up the lens for this zoom in the store
  bool search_for_board = false;  ///< a board that comes into view starts a capture
  std::optional<std::int32_t> zoom_counts, focus_counts;  ///< at this standstill
  std::shared_ptr<const ActiveLens> lens;                 ///< null if there is none for this zoom
  std::shared_ptr<const TagBaseline> baseline;            ///< of that lens
  bool opencv_prints = false;                             ///< see Tracker::AssumeOpenCvPrints
  std::vector<int> set_aside;    ///< reference tags that contradict the others
  std::uint64_t standstill = 0;  ///< incremented when the zoom moves or becomes unknown
};

/// Pure logic: time is an input, no threads or devices. Not thread-safe; the CameraSupervisor calls
/// it under a mutex.
class LensSupervisor {
 public:
  LensSupervisor(LensSupervisorSettings settings, log::LogSink sink);

  void OnZoomReading(const lens::ZoomReading& reading, double now_s);
  void OnSensorFault(zoom::ZoomResult result, std::string_view problem, double now_s);
  void OnTime(double now_s);
  void OnCameraResult(camera::CameraResult result, std::string_view problem, double now_s);

  FrameContext frame_context() const;

  /// Result of a lookup that FrameContext::needs_lens requested.
  /// @param lens           null if the store has no lens for this zoom
  /// @param lookup_time_s  when the store was read
  void OnLensLookup(std::shared_ptr<const ActiveLens> lens,
                    std::shared_ptr<const TagBaseline> baseline, const FrameContext& context,
                    double lookup_time_s, double now_s);
  /// @return  true if the baseline of the lens changed and should be stored
  bool OnTagCheck(const TagCheck& check, const FrameContext& context, double image_s, double now_s);
  /// The bodies of one image, located with the lens of `context`.
  void OnBodies(const std::vector<SeenBody>& bodies, const FrameContext& context, double image_s);

  /// @return  whether the capture started: it does not while the zoom moves or is unknown
  bool StartBoard(double now_s);
  void OnBoardProgress(lens::BoardPrompt prompt, const lens::BoardGuidance& guidance, double now_s);
  /// @param oldest_s  time of the oldest view in the calibration
  /// @return          whether the lens is now active: false if the zoom has moved since `oldest_s`
  bool OnBoardAccepted(const ActiveLens& lens, double oldest_s, double now_s);
  void OnBoardRefused(const std::vector<std::string>& reasons, double now_s);
  void CancelBoard(double now_s);
  /// The active lens has been stored under this id.
  void SetStoredId(std::int64_t id);
  /// @param fault  empty if the store works
  void OnStoreFault(const std::string& fault) { faults_.OnStore(fault); }

  lens::ZoomState state() const { return supervision_.state(); }
  /// Whether the tags contradict the calibration in use since it was accepted.
  bool contradicted() const { return supervision_.reason() == lens::ZoomReason::kTagsContradict; }
  const LensSupervisorSettings& settings() const { return settings_; }  ///< constant: any thread
  status::CameraStatus Status() const;

 private:
  void Take(lens::ZoomEvent event);
  void ApplyTransition(const lens::ZoomTransition& transition);
  void DropLens();
  bool IsCurrent(const FrameContext& context) const;
  bool AdoptPrints(const TagCheck& check);

  const LensSupervisorSettings settings_;
  log::LogSink sink_;
  lens::ZoomSupervisor supervision_;
  std::optional<std::int32_t> zoom_counts_, focus_counts_;  ///< last reading
  double zoom_time_s_ = status::CameraStatus::kNever, frame_time_s_ = status::CameraStatus::kNever;
  std::uint64_t standstill_ = 0;
  std::optional<std::int32_t> standstill_zoom_, standstill_focus_;
  bool looked_up_ = false;  ///< during this standstill
  std::shared_ptr<const ActiveLens> lens_;
  std::shared_ptr<const TagBaseline> baseline_;
  int failed_checks_ = 0;  ///< consecutive tag checks that were not good
  std::string check_message_;
  bool opencv_prints_ = false;
  std::vector<int> contradicting_;  ///< reference tags that contradict the others, or each other
  lens::BoardPrompt prompt_ = lens::BoardPrompt::kNone;
  std::size_t board_views_ = 0;
  TrackedBodies bodies_;
  DeviceFaults faults_;
};

/// Consecutive tag checks that must fail before the tags count as moved, the zoom as drifted or the
/// lens as bad: a single failure may be caused by a hand in the image.
inline constexpr int kChecksToReject = 3;

}  // namespace plumbline::vision
