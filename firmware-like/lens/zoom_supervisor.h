// Zoom supervisor: decides whether the loaded lens is valid for the camera's present zoom.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "firmware-like/lens/zoom_reading.h"

namespace plumbline::lens {

/// Validity of the lens. Measurements are allowed in kValid only; in every other state the overlay
/// and measured points are stale.
enum class ZoomState : std::uint8_t {
  kUnknown,      ///< no sensor, no recent reading, or no standstill since the first reading
  kMoving,       ///< zoom or focus is moving, or has not been stationary long enough
  kVerifying,    ///< stationary; the lens is being looked up or checked against the reference tags
  kValid,        ///< verified at this zoom since the last motion
  kStale,        ///< stationary, but there is no trustworthy lens for this zoom
  kCalibrating,  ///< the calibration board is being captured
  kRefused,      ///< the calibration was refused, or is impossible (digital zoom)
};

/// Reason for the present state.
enum class ZoomReason : std::uint8_t {
  kNoReading,         ///< since start-up
  kSensorLost,        ///< no position for lost_after_s
  kPositionReceived,  ///< the lens must become stationary first
  kZoomChanged,       ///< zoom counts left the dead band
  kFocusChanged,      ///< focus counts left the dead band
  kDeviceMoves,       ///< the device, or its motion line, reports motion
  kDigitalZoom,       ///< the image is enlarged digitally; switch it off
  kStationary,        ///< stationary for settle_s; the lens is being looked up
  kLensLoaded,        ///< the reference tags are being checked
  kTagsNotVisible,    ///< clear the view of the reference tags, or show the board
  kNoAnswer,          ///< the reference tags were not checked in time
  kTagsGood,
  kTagsBad,  ///< the tags are not where they should be; show the board
  kNoLens,   ///< never calibrated near this zoom; show the board
  kBoardStarted,
  kBoardAccepted,
  kBoardRefused,  ///< the calibration was not good enough; show the board again
  kImagesTooOld,  ///< images of the calibration are older than the last motion
  kBoardCancelled,
  kTagsContradict,  ///< the tags contradict the calibration just accepted: check their declaration
};
inline constexpr ZoomReason kLastZoomReason = ZoomReason::kTagsContradict;

/// Action that the supervisor requests from its caller.
enum class ZoomRequest : std::uint8_t {
  kNothing,
  kLoadLens,    ///< look up the present zoom in the store; respond with kLensKnown or kLensUnknown
  kVerifyTags,  ///< check the reference tags with the loaded lens
  kBoard,       ///< ask the operator for the board; results of tag checks are still accepted
};

struct ZoomEvent {
  enum class Kind : std::uint8_t {
    kReading,    ///< the sensor responded
    kLost,       ///< the sensor did not respond
    kTime,       ///< time passed; send at least once a second
    kLensKnown,  ///< a lens is loaded: calibrated or interpolated
    kLensUnknown,
    kTagsGood,
    kTagsBad,
    kTagsNotVisible,
    kBoardStarted,  ///< the operator shows the board, or the cell's fixed board is in view
    kBoardAccepted,
    kBoardRefused,
    kBoardCancelled,
  };
  Kind kind = Kind::kTime;
  double time_s = 0;    ///< now, monotonic; ignored if not finite or running backwards
  ZoomReading reading;  ///< for kReading
  /// For lens and tag events and kBoardAccepted: time of the observation, on the same clock. It is
  /// the time when the lens was looked up, or when the (oldest) image was taken.
  double observed_s = -std::numeric_limits<double>::infinity();
  std::optional<std::int32_t> zoom_band_counts;  ///< for kLensKnown: DeadBandCounts() at this zoom
  /// For kLensKnown: this calibration was accepted, and the tags have contradicted it ever since.
  bool contradicted = false;
};

/// Change of state or reason.
struct ZoomTransition {
  ZoomState from = ZoomState::kUnknown, to = ZoomState::kUnknown;
  ZoomReason why = ZoomReason::kNoReading;
  double time_s = 0;
  std::optional<std::int32_t> zoom_counts, focus_counts;
};

struct ZoomSupervisorSettings {
  std::int32_t zoom_band_counts = 2;   ///< dead band, unless kLensKnown provides one
  std::int32_t focus_band_counts = 4;  ///< dead band
  double settle_s = 0.3;               ///< the lens is stationary after this time without motion
  double lost_after_s = 1.0;           ///< the sensor is lost after this time without a position
  double verify_patience_s = 5.0;      ///< the board is requested after this time
};

/// Dead band within which the focal length changes by at most `tolerance` (1, relative); at least 1
/// count, the noise of an encoder.
/// @param log_focal_per_count  |d ln f / d count|, from LensCurve, or typically 1e-4..5e-4
std::int32_t DeadBandCounts(double log_focal_per_count, double tolerance);

/// State machine for the validity of the lens. Time is an input; nothing allocates.
///
/// Invariants, tested for all sequences of six events:
/// - A reading outside the dead band around the position where the lens came to rest, or one that
///   reports moving, moved or digital zoom, ends kValid immediately.
/// - kValid requires, since the last motion, sensor loss or failed tag check: either a successful
///   tag check in an image taken after the lens had been stationary for settle_s and was loaded, or
///   a calibration accepted from images taken after that time.
/// - kCalibrating is entered only while the lens is stationary, and left on any motion.
/// - With digital zoom the state is kRefused, and no calibration starts.
/// - Without a reading for lost_after_s the state is kUnknown.
/// - A calibration that the tags contradict from the start does not request another one: a second
///   calibration of the same lens cannot make tags agree that are declared wrongly. The board is
///   requested again after a motion, or if the tags have agreed in the meantime.
/// The position is compared with the rest position, never with the previous reading, so slow creep
/// is detected. The first reading after a sensor loss only reports that loss; the next one is
/// evaluated.
class ZoomSupervisor {
 public:
  explicit ZoomSupervisor(const ZoomSupervisorSettings& settings);

  /// @return  the transition, if state or reason changed
  std::optional<ZoomTransition> Handle(const ZoomEvent& event);

  ZoomState state() const { return state_; }
  ZoomReason reason() const { return reason_; }
  ZoomRequest request() const { return request_; }
  double since_s() const { return since_s_; }  ///< time of the last transition
  /// Observations made before this time are ignored; infinite while the lens is not stationary.
  double trusted_from_s() const { return trusted_from_s_; }

 private:
  bool SensorExpired();
  void CheckVerifyTimeout();
  bool IsCurrent(const ZoomEvent& event) const;
  void OnReading(const ZoomReading& reading);
  void OnLens(const ZoomEvent& event);
  void OnTags(const ZoomEvent& event);
  void OnBoard(const ZoomEvent& event);
  std::optional<ZoomReason> MotionIn(const ZoomReading& reading) const;
  void Invalidate();
  bool settled() const { return trusted_from_s_ < std::numeric_limits<double>::infinity(); }
  void SetState(ZoomState state, ZoomReason reason, ZoomRequest request);

  ZoomSupervisorSettings settings_;
  ZoomState state_ = ZoomState::kUnknown;
  ZoomReason reason_ = ZoomReason::kNoReading;
  ZoomRequest request_ = ZoomRequest::kNothing;
  double now_s_ = -std::numeric_limits<double>::infinity();
  double since_s_ = now_s_;
  double position_time_s_ = now_s_;           ///< time of the last reading with a position
  bool has_position_ = false;                 ///< the next three members are valid
  std::optional<std::int32_t> zoom_, focus_;  ///< rest position, the reference of the dead band
  double stationary_since_s_ = 0;
  double trusted_from_s_ = std::numeric_limits<double>::infinity();
  bool digital_ = false;
  bool lens_known_ = false;
  bool unconfirmed_ = false;  ///< the lens was calibrated here, and the tags have not agreed since
  std::int32_t zoom_band_counts_;
};

/// Text for a log line or a display: "verifying", "the zoom changed".
std::string_view ZoomStateText(ZoomState state);
std::string_view ZoomReasonText(ZoomReason reason);

}  // namespace plumbline::lens
