#include "firmware-like/lens/zoom_supervisor.h"

#include <algorithm>
#include <cmath>

namespace plumbline::lens {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A missing position is no difference.
bool Beyond(const std::optional<std::int32_t>& a, const std::optional<std::int32_t>& b,
            std::int32_t band) {
  return a && b && std::abs(std::int64_t{*a} - std::int64_t{*b}) > band;
}

}  // namespace

std::int32_t DeadBandCounts(double log_focal_per_count, double tolerance) {
  constexpr double kMost = 1e6;
  const double counts = std::floor(tolerance / std::abs(log_focal_per_count));
  return counts > 1 ? static_cast<std::int32_t>(std::min(counts, kMost)) : 1;
}

ZoomSupervisor::ZoomSupervisor(const ZoomSupervisorSettings& settings)
    : settings_(settings), zoom_band_counts_(settings.zoom_band_counts) {}

std::optional<ZoomTransition> ZoomSupervisor::Handle(const ZoomEvent& event) {
  const ZoomState from = state_;
  const ZoomReason before = reason_;
  if (std::isfinite(event.time_s)) now_s_ = std::max(now_s_, event.time_s);
  if (SensorExpired()) {
    since_s_ = now_s_;
    return ZoomTransition{from, state_, reason_, now_s_, zoom_, focus_};
  }
  CheckVerifyTimeout();
  switch (event.kind) {
    case ZoomEvent::Kind::kReading:
      OnReading(event.reading);
      break;
    case ZoomEvent::Kind::kLost:
    case ZoomEvent::Kind::kTime:
      break;
    case ZoomEvent::Kind::kLensKnown:
    case ZoomEvent::Kind::kLensUnknown:
      OnLens(event);
      break;
    case ZoomEvent::Kind::kTagsGood:
    case ZoomEvent::Kind::kTagsBad:
    case ZoomEvent::Kind::kTagsNotVisible:
      OnTags(event);
      break;
    case ZoomEvent::Kind::kBoardStarted:
    case ZoomEvent::Kind::kBoardAccepted:
    case ZoomEvent::Kind::kBoardRefused:
    case ZoomEvent::Kind::kBoardCancelled:
      OnBoard(event);
      break;
  }
  if (state_ == from && reason_ == before) return std::nullopt;
  since_s_ = now_s_;
  return ZoomTransition{from, state_, reason_, now_s_, zoom_, focus_};
}

void ZoomSupervisor::SetState(ZoomState state, ZoomReason reason, ZoomRequest request) {
  state_ = state;
  reason_ = reason;
  request_ = request;
}

/// Discards the lens, which belongs to another zoom.
void ZoomSupervisor::Invalidate() {
  trusted_from_s_ = kNever;
  lens_known_ = false;
  unconfirmed_ = false;
  zoom_band_counts_ = settings_.zoom_band_counts;
}

bool ZoomSupervisor::SensorExpired() {
  if (!std::isfinite(position_time_s_) || now_s_ - position_time_s_ <= settings_.lost_after_s)
    return false;
  position_time_s_ = -kNever;
  has_position_ = false;
  zoom_.reset();
  focus_.reset();
  Invalidate();
  SetState(ZoomState::kUnknown, ZoomReason::kSensorLost, ZoomRequest::kNothing);
  return true;
}

void ZoomSupervisor::CheckVerifyTimeout() {
  if (state_ != ZoomState::kVerifying || now_s_ - since_s_ <= settings_.verify_patience_s) return;
  const bool hidden = reason_ == ZoomReason::kTagsNotVisible;
  SetState(ZoomState::kStale, hidden ? ZoomReason::kTagsNotVisible : ZoomReason::kNoAnswer,
           ZoomRequest::kBoard);
}

/// True if the observation was made since the lens came to rest, and not in the future.
bool ZoomSupervisor::IsCurrent(const ZoomEvent& event) const {
  return settled() && event.observed_s >= trusted_from_s_ && event.observed_s <= now_s_;
}

std::optional<ZoomReason> ZoomSupervisor::MotionIn(const ZoomReading& reading) const {
  if (reading.moved || reading.motion == LensMotion::kMoving) return ZoomReason::kDeviceMoves;
  if (Beyond(reading.zoom_counts, zoom_, zoom_band_counts_)) return ZoomReason::kZoomChanged;
  if (Beyond(reading.focus_counts, focus_, settings_.focus_band_counts)) {
    return ZoomReason::kFocusChanged;
  }
  return std::nullopt;
}

void ZoomSupervisor::OnReading(const ZoomReading& reading) {
  // A sensor that has reported the zoom before but not now gives no position.
  const bool has_zoom = reading.zoom_counts || !zoom_;
  if (has_zoom) position_time_s_ = now_s_;

  const bool was_digital = digital_;
  digital_ = reading.digital_zoom.value_or(digital_);
  std::optional<ZoomReason> motion = MotionIn(reading);
  if (!motion && was_digital && !digital_) motion = ZoomReason::kZoomChanged;

  const bool first = !has_position_;
  if (first || motion || digital_) {
    has_position_ = true;
    stationary_since_s_ = now_s_;
    if (reading.zoom_counts) zoom_ = reading.zoom_counts;
    if (reading.focus_counts) focus_ = reading.focus_counts;
    Invalidate();
  }
  if (!zoom_) zoom_ = reading.zoom_counts;
  if (!focus_) focus_ = reading.focus_counts;
  if (digital_) {
    SetState(ZoomState::kRefused, ZoomReason::kDigitalZoom, ZoomRequest::kNothing);
  } else if (motion) {
    SetState(ZoomState::kMoving, *motion, ZoomRequest::kNothing);
  } else if (first) {
    SetState(ZoomState::kUnknown, ZoomReason::kPositionReceived, ZoomRequest::kNothing);
  } else if (!settled() && has_zoom && now_s_ - stationary_since_s_ >= settings_.settle_s) {
    trusted_from_s_ = now_s_;
    SetState(ZoomState::kVerifying, ZoomReason::kStationary, ZoomRequest::kLoadLens);
  }
}

void ZoomSupervisor::OnLens(const ZoomEvent& event) {
  if (!IsCurrent(event)) return;
  lens_known_ = event.kind == ZoomEvent::Kind::kLensKnown;
  if (lens_known_) {
    trusted_from_s_ = now_s_;  // tags must be checked with this lens
    zoom_band_counts_ = event.zoom_band_counts.value_or(settings_.zoom_band_counts);
    unconfirmed_ = event.contradicted;
  }
  if (state_ == ZoomState::kCalibrating) return;
  if (lens_known_) {
    SetState(ZoomState::kVerifying, ZoomReason::kLensLoaded, ZoomRequest::kVerifyTags);
  } else if (state_ != ZoomState::kRefused) {
    SetState(ZoomState::kStale, ZoomReason::kNoLens, ZoomRequest::kBoard);
  }
}

void ZoomSupervisor::OnTags(const ZoomEvent& event) {
  if (!IsCurrent(event) || !lens_known_ || state_ == ZoomState::kCalibrating) return;
  switch (event.kind) {
    case ZoomEvent::Kind::kTagsGood:
      unconfirmed_ = false;
      if (state_ != ZoomState::kValid) {
        SetState(ZoomState::kValid, ZoomReason::kTagsGood, ZoomRequest::kNothing);
      }
      break;
    case ZoomEvent::Kind::kTagsBad:
      trusted_from_s_ = now_s_;  // an older image must not make the lens valid again
      if (unconfirmed_) {
        SetState(ZoomState::kStale, ZoomReason::kTagsContradict, ZoomRequest::kNothing);
      } else {
        SetState(ZoomState::kStale, ZoomReason::kTagsBad, ZoomRequest::kBoard);
      }
      break;
    default:  // not visible: neither invalidates nor confirms the lens
      if (state_ == ZoomState::kVerifying) {
        SetState(ZoomState::kVerifying, ZoomReason::kTagsNotVisible, ZoomRequest::kVerifyTags);
      }
      break;
  }
}

void ZoomSupervisor::OnBoard(const ZoomEvent& event) {
  if (event.kind == ZoomEvent::Kind::kBoardStarted) {
    if (settled())
      SetState(ZoomState::kCalibrating, ZoomReason::kBoardStarted, ZoomRequest::kNothing);
    return;
  }
  if (state_ != ZoomState::kCalibrating) return;  // motion or sensor loss has ended the capture
  const bool current = IsCurrent(event);
  trusted_from_s_ = now_s_;  // the board may have covered the tags
  switch (event.kind) {
    case ZoomEvent::Kind::kBoardAccepted:
      if (current) {
        lens_known_ = unconfirmed_ = true;
        SetState(ZoomState::kValid, ZoomReason::kBoardAccepted, ZoomRequest::kNothing);
      } else {
        SetState(ZoomState::kRefused, ZoomReason::kImagesTooOld, ZoomRequest::kBoard);
      }
      break;
    case ZoomEvent::Kind::kBoardRefused:
      SetState(ZoomState::kRefused, ZoomReason::kBoardRefused, ZoomRequest::kBoard);
      break;
    default:
      if (lens_known_) {
        SetState(ZoomState::kVerifying, ZoomReason::kBoardCancelled, ZoomRequest::kVerifyTags);
      } else {
        SetState(ZoomState::kStale, ZoomReason::kBoardCancelled, ZoomRequest::kBoard);
      }
      break;
  }
}

std::string_view ZoomStateText(ZoomState state) {
  switch (state) {
    case ZoomState::kUnknown:
      return "unknown";
    case ZoomState::kMoving:
      return "moving";
    case ZoomState::kVerifying:
      return "verifying";
    case ZoomState::kValid:
      return "valid";
    case ZoomState::kStale:
      return "stale";
    case ZoomState::kCalibrating:
      return "calibrating";
    case ZoomState::kRefused:
      return "refused";
  }
  return "?";
}

std::string_view ZoomReasonText(ZoomReason reason) {
  switch (reason) {
    case ZoomReason::kNoReading:
      return "no reading from the zoom sensor yet";
    case ZoomReason::kSensorLost:
      return "the zoom sensor does not respond";
    case ZoomReason::kPositionReceived:
      return "the zoom sensor responds; waiting for the lens to come to rest";
    case ZoomReason::kZoomChanged:
      return "the zoom changed";
    case ZoomReason::kFocusChanged:
      return "the focus changed";
    case ZoomReason::kDeviceMoves:
      return "the lens is moving";
    case ZoomReason::kDigitalZoom:
      return "digital zoom is on; switch it off";
    case ZoomReason::kStationary:
      return "the lens is at rest";
    case ZoomReason::kLensLoaded:
      return "a lens for this zoom is loaded; checking the reference tags";
    case ZoomReason::kTagsNotVisible:
      return "the reference tags are not visible; clear the view or show the board";
    case ZoomReason::kNoAnswer:
      return "the reference tags were not checked in time; show the board";
    case ZoomReason::kTagsGood:
      return "the reference tags are where they should be";
    case ZoomReason::kTagsBad:
      return "the reference tags are not where they should be; show the board";
    case ZoomReason::kNoLens:
      return "never calibrated near this zoom; show the board";
    case ZoomReason::kBoardStarted:
      return "the board is being captured";
    case ZoomReason::kBoardAccepted:
      return "the calibration was accepted";
    case ZoomReason::kBoardRefused:
      return "the calibration was refused; show the board again";
    case ZoomReason::kImagesTooOld:
      return "the images of the board are older than the last motion; show the board again";
    case ZoomReason::kBoardCancelled:
      return "the calibration was cancelled";
    case ZoomReason::kTagsContradict:
      return "the reference tags contradict the accepted calibration; check bodies.toml";
  }
  return "?";
}

}  // namespace plumbline::lens
