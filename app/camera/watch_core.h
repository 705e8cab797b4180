// What the camera's watch knows and decides: the zoom's state, the lens in use, the marks, the
// tracked bodies. Values in, values out; time is an input.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/camera/marks_look.h"
#include "app/camera/measured_tip.h"
#include "app/lens_store/lens_entry.h"
#include "app/log/log_entry.h"
#include "app/tracking/tracker.h"
#include "drivers/camera/camera.h"
#include "drivers/zoom/zoom.h"
#include "firmware-like/lens/zoom_supervisor.h"
#include "firmware-like/status/camera_status.h"

namespace plumbline {

/// What is fixed while it runs.
struct WatchSettings {
  CameraName name = CameraName::kNone;
  ZoomSupervisionSettings zoom;
  MarkSettings marks;
  double acceptable_px = 0.5;       ///< uncertainty of the projection that is worked with
  Body cell;                        ///< the fixed marks
  Pose X_WK;                        ///< the cell's body in the measurement frame
  std::string tool;                 ///< name of the body that carries the tip; empty: none
  Vec3 tip_T = Vec3::Zero();        ///< on that body [m]
  std::vector<std::string> bodies;  ///< those that are told, in order
};

/// What the image's side shall do with the next frame.
struct WatchOrders {
  ZoomState state = ZoomState::kUnknown;
  bool look_up = false;     ///< the lens of this zoom, in the store
  bool want_board = false;  ///< a board that comes into view shall start a capture
  std::optional<std::int32_t> zoom_counts, focus_counts;  ///< where the lens came to rest
  std::shared_ptr<const LensInUse> lens;                  ///< null: none of this zoom
  std::shared_ptr<const MarksMemory> memory;              ///< of that lens
  std::uint64_t rest = 0;  ///< counts motions: answers about another rest are not believed
};

/// Not for several threads: the watch holds a lock around it.
class WatchCore {
 public:
  WatchCore(WatchSettings settings, LogSink sink);

  void TakeReading(const ZoomReading& reading, double now_s);
  void TakeSensorFault(ZoomResult result, std::string_view problem, double now_s);
  void TakeTime(double now_s);
  void TakeCameraResult(CameraResult result, std::string_view problem, double now_s);

  WatchOrders orders() const;

  /// The store's answer to look_up; null: it knows no lens there. `asked_s`: when it was looked up.
  void TakeLens(std::shared_ptr<const LensInUse> lens, std::shared_ptr<const MarksMemory> memory,
                const WatchOrders& asked, double asked_s, double now_s);
  /// @return  true where the memory of the lens changed, so that it can be kept
  bool TakeLook(const MarksLook& look, const WatchOrders& asked, double image_s, double now_s);
  /// The bodies of one image, located with the lens of `asked`.
  void TakeBodies(const std::vector<SeenBody>& bodies, const WatchOrders& asked, double image_s);

  /// @return  whether it started: the lens stands
  bool StartBoard(double now_s);
  void TakeProgress(BoardPrompt prompt, std::size_t kept, double now_s);
  /// @return  whether the lens was taken: nothing moved since `oldest_s`
  bool TakeAccepted(const LensInUse& lens, double oldest_s, double now_s);
  void TakeRefused(const std::vector<std::string>& reasons, double now_s);
  void CancelBoard(double now_s);
  void NoteKept(std::int64_t id);
  void NoteStoreFault(const std::string& fault);  ///< empty: it works again

  ZoomState state() const { return supervision_.state(); }
  const WatchSettings& settings() const { return settings_; }  ///< fixed: any thread
  CameraStatus Status() const;

 private:
  void Take(ZoomEvent event);
  void Tell(const ZoomTransition& transition);
  void ForgetLens();
  void ForgetBodies();
  bool IsOf(const WatchOrders& asked) const;

  const WatchSettings settings_;
  LogSink sink_;
  ZoomSupervision supervision_;
  std::optional<std::int32_t> zoom_counts_, focus_counts_;  ///< of the last reading
  double zoom_time_s_ = CameraStatus::kNever, frame_time_s_ = CameraStatus::kNever;
  std::uint64_t rest_ = 0;
  std::optional<std::int32_t> rest_zoom_, rest_focus_;
  bool looked_up_ = false;  ///< since the lens came to rest
  std::shared_ptr<const LensInUse> lens_;
  std::shared_ptr<const MarksMemory> memory_;
  int doubts_ = 0;  ///< looks in a row that were not good
  std::string look_words_;
  bool mark_moved_ = false;
  BoardPrompt prompt_ = BoardPrompt::kNone;
  std::size_t board_views_ = 0;
  std::array<CameraStatus::Body, CameraStatus::kMostBodies> bodies_;
  Standing tip_;
  std::optional<CameraResult> camera_;  ///< the last one told
  std::optional<ZoomResult> sensor_;
  double camera_lost_s_ = 0;
  std::string store_fault_;
};

/// Looks in a row that must agree before marks count as moved, drifted or bad: one may be a hand in
/// the picture.
inline constexpr int kLooksToDoubt = 3;

}  // namespace plumbline
