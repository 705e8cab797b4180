// Whether the lens in use belongs to the zoom that the camera has now.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <string_view>

#include "firmware-like/lens/zoom_reading.h"

namespace plumbline {

/// What may be done with the lens: measured with in kValid only; everywhere else the overlay and
/// measured points are stale.
enum class ZoomState : std::uint8_t {
  kUnknown,      ///< no sensor, or it has not been heard for a time, or not long enough yet
  kMoving,       ///< zoom or focus moves, or has not stood long enough yet
  kVerifying,    ///< stands; its lens is looked up, or its fixed marks are looked at
  kValid,        ///< verified at this zoom since the last motion
  kStale,        ///< stands, but no lens of this zoom is to be trusted
  kCalibrating,  ///< the board is being captured
  kRefused,      ///< calibration was refused, or cannot be (digital zoom)
};

/// Why the state is what it is.
enum class ZoomReason : std::uint8_t {
  kNoReading,     ///< since the start
  kSensorLost,       ///< for lost_after_s; connect it
  kPositionReceived,    ///< it must stand before anything else
  kZoomChanged,      ///< counts beyond the dead band
  kFocusChanged,     ///< likewise
  kDeviceMoves,      ///< the device, or its line, says so
  kDigitalZoom,      ///< switch it off: the image is enlarged by computing
  kStoodStill,       ///< long enough; its lens is looked up
  kLensLoaded,       ///< the marks are looked at
  kMarksNotVisible,  ///< clear the view of the fixed marks, or show the board
  kNoAnswer,         ///< the marks were not judged in time
  kMarksGood,
  kMarksBad,  ///< they are not where they should be: show the board
  kNoLens,    ///< never calibrated near this zoom: show the board
  kBoardStarted,
  kBoardAccepted,
  kBoardRefused,  ///< the calibration was not good enough: show the board again
  kImagesTooOld,  ///< of a calibration: from before the last motion
  kBoardCancelled,
};

/// What the machine wants next of whoever runs it.
enum class ZoomAsk : std::uint8_t {
  kNothing,
  kLoadLens,     ///< look the present zoom up in the store; answer kLensKnown or kLensUnknown
  kVerifyTags,  ///< look at the fixed marks with the loaded lens
  kBoard,        ///< ask a person for the board; the marks may still be judged as well
};

struct ZoomEvent {
  enum class Kind : std::uint8_t {
    kReading,    ///< the sensor answered
    kLost,       ///< it did not
    kTime,       ///< nothing happened; at least once a second
    kLensKnown,  ///< loaded, calibrated or interpolated
    kLensUnknown,
    kMarksGood,
    kMarksBad,
    kMarksNotVisible,
    kBoardStarted,  ///< a person shows the board, or the cell's own stands ready
    kBoardAccepted,
    kBoardRefused,
    kBoardCancelled,
  };
  Kind kind = Kind::kTime;
  double time_s = 0;  ///< now, monotonic; one that is not finite or runs backwards is the last one
  ZoomReading reading;  ///< of kReading
  /// Of kLens.. and kMarks.., kBoardAccepted: the moment that the answer is about, on the same
  /// clock: when the lens was looked up, when the (oldest) image was taken.
  double about_s = -std::numeric_limits<double>::infinity();
  std::optional<std::int32_t> zoom_band_counts;  ///< of kLensKnown: DeadBandCounts() there
};

/// One for each change of state or reason.
struct ZoomTransition {
  ZoomState from = ZoomState::kUnknown, to = ZoomState::kUnknown;
  ZoomReason why = ZoomReason::kNoReading;
  double time_s = 0;
  std::optional<std::int32_t> zoom_counts, focus_counts;
};

struct ZoomSupervisionSettings {
  std::int32_t zoom_band_counts = 2;   ///< a change up to it is none; of kLensKnown where given
  std::int32_t focus_band_counts = 4;  ///< likewise
  double settle_s = 0.3;               ///< how long the counts must have stood
  double lost_after_s = 1.0;           ///< without a reading that tells the position
  double verify_patience_s = 5.0;      ///< then the board is asked for
};

/// Counts within which the focal length stays within `tolerance` of itself (1); at least 1, the
/// noise of an encoder, whatever it is worth.
/// @param log_focal_per_count  |d ln f / d count|, of LensCurve or 1e-4..5e-4
std::int32_t DeadBandCounts(double log_focal_per_count, double tolerance);

/// The state machine. Pure: time is an input, nothing allocates.
///
/// Held for every sequence of events (tests: all of length six):
/// - a reading beyond the dead band of where the lens came to rest, or one that says moving, moved
///   or digital zoom, leaves kValid at once;
/// - kValid needs, since the last motion, loss of the sensor or bad marks: good marks in an image
///   taken after the lens had stood for settle_s and was loaded, or a calibration accepted from
///   images taken after that;
/// - kCalibrating is entered only while the lens stands, and left by any motion;
/// - with digital zoom the state is kRefused and no calibration starts;
/// - without a reading for lost_after_s the state is kUnknown.
/// The position is never compared with the last reading, so that a creeping lens is noticed. A
/// reading that finds the sensor lost for too long tells only that; the next one counts again.
class ZoomSupervision {
 public:
  explicit ZoomSupervision(const ZoomSupervisionSettings& settings);

  std::optional<ZoomTransition> Take(const ZoomEvent& event);

  ZoomState state() const { return state_; }
  ZoomReason reason() const { return reason_; }
  ZoomAsk ask() const { return ask_; }
  double since_s() const { return since_s_; }  ///< of the last transition
  /// Images and look-ups from before are not believed; infinite while the lens does not stand.
  double trusted_from_s() const { return trusted_from_s_; }

 private:
  bool SensorExpired();
  void CheckVerifyTimeout();
  bool IsCurrent(const ZoomEvent& event) const;
  void OnReading(const ZoomReading& reading);
  void OnLens(const ZoomEvent& event);
  void OnMarks(const ZoomEvent& event);
  void OnBoard(const ZoomEvent& event);
  std::optional<ZoomReason> MotionIn(const ZoomReading& reading) const;
  void Invalidate();
  bool settled() const { return trusted_from_s_ < std::numeric_limits<double>::infinity(); }
  void SetState(ZoomState state, ZoomReason reason, ZoomAsk ask);

  ZoomSupervisionSettings settings_;
  ZoomState state_ = ZoomState::kUnknown;
  ZoomReason reason_ = ZoomReason::kNoReading;
  ZoomAsk ask_ = ZoomAsk::kNothing;
  double now_s_ = -std::numeric_limits<double>::infinity();
  double since_s_ = now_s_;
  double position_time_s_ = now_s_;  ///< when the position was last told
  bool has_position_ = false;     ///< zoom_, focus_ and stationary_since_s_ say where and since when
  std::optional<std::int32_t> zoom_, focus_;
  double stationary_since_s_ = 0;
  double trusted_from_s_ = std::numeric_limits<double>::infinity();
  bool digital_ = false;
  bool lens_known_ = false;
  std::int32_t zoom_band_counts_;
};

/// Words for a log line: "verifying", "the zoom changed".
std::string_view ZoomStateText(ZoomState state);
std::string_view ZoomReasonText(ZoomReason reason);

}  // namespace plumbline
