#include "app/vision/camera/lens_supervisor.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "app/vision/camera/lens_messages.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

const SeenBody* FindBody(const std::vector<SeenBody>& bodies, const std::string& name) {
  for (const SeenBody& body : bodies) {
    if (body.body->name == name) return &body;
  }
  return nullptr;
}

}  // namespace

void TrackedBodies::Take(const LensSupervisorSettings& settings, const std::vector<SeenBody>& seen,
                         const lens::LensCovariance& lens, double image_s) {
  const SeenBody* const cell = FindBody(seen, settings.cell.name);
  const auto places = [&settings](const SeenBody& body) {
    return TagPositionSd{settings.tag_check.place_sd_m,
                         body.body->place_sd_m.value_or(target::kPlaceSdOnOnePlate_m)};
  };
  for (std::size_t k = 0; k < settings.bodies.size() && k < bodies_.size(); ++k) {
    const SeenBody* const body = FindBody(seen, settings.bodies[k]);
    status::CameraStatus::Body& status = bodies_[k];
    status.valid = body != nullptr && cell != nullptr;
    if (!status.valid) continue;
    status.ambiguous = body->ambiguous || cell->ambiguous;
    status.X_WK = settings.X_WK * (cell->estimate.X_CK.Inverse() * body->estimate.X_CK);
    const CameraPoint origin = MeasurePoint(cell->estimate, body->estimate, settings.X_WK,
                                            Vec3::Zero(), lens, image_s, places(*body));
    status.radius_m =
        statistics::RadiusHolding95Percent(origin.covariance_W + origin.tag_covariance_W);
    status.time_s = image_s;
  }
  const SeenBody* const tool = settings.tool.empty() ? nullptr : FindBody(seen, settings.tool);
  const bool reliable = tool != nullptr && cell != nullptr && !tool->ambiguous &&
                        !cell->ambiguous && cell->used.size() >= 2;
  if (reliable) {
    tip_.Take(MeasurePoint(cell->estimate, tool->estimate, settings.X_WK, settings.tip_T, lens,
                           image_s, places(*tool)));
  } else {
    tip_.Reset();
  }
}

void TrackedBodies::Invalidate() {
  tip_.Reset();
  for (status::CameraStatus::Body& body : bodies_) body.valid = false;
}

void TrackedBodies::AddTo(status::CameraStatus& status, bool lens_valid) const {
  status.bodies = bodies_;
  const auto tip = tip_.Point();
  if (!tip || !lens_valid) return;
  status.tip_valid = true;
  status.tip_W = tip->p_W;
  status.tip_covariance_W = tip->covariance_W;
  status.tip_tag_covariance_W = tip->tag_covariance_W;
  status.tip_time_s = tip->time_s;
}

void DeviceFaults::OnSensor(zoom::ZoomResult result, std::string_view problem) {
  if (result == zoom::ZoomResult::kWaiting || sensor_ == result) return;
  if (result != zoom::ZoomResult::kOk) {
    sink_({log::Event::kSensorFault,
           fmt::format("zoom sensor: {}: {}", zoom::ZoomResultText(result), problem)});
  } else if (sensor_) {
    sink_({log::Event::kSensorBack, "zoom sensor responds again"});
  }
  sensor_ = result;
}

bool DeviceFaults::OnCamera(camera::CameraResult result, std::string_view problem, double now_s) {
  if (result == camera::CameraResult::kWaiting || result == camera::CameraResult::kNoFrame ||
      camera_ == result) {
    return false;
  }
  const bool ok = result == camera::CameraResult::kFrame;
  if (ok && camera_) {
    sink_({log::Event::kCameraBack,
           fmt::format("camera back after {:.1f} s", now_s - camera_lost_s_)});
  } else if (!ok) {
    if (!camera_ || *camera_ == camera::CameraResult::kFrame) camera_lost_s_ = now_s;
    sink_({result == camera::CameraResult::kEnded ? log::Event::kCameraEnded
                                                  : log::Event::kCameraLost,
           fmt::format("camera: {}: {}", camera::CameraResultText(result), problem)});
  }
  camera_ = result;
  return !ok;
}

void DeviceFaults::OnStore(const std::string& fault) {
  if (fault == store_) return;
  if (fault.empty()) {
    sink_({log::Event::kLensStoreWorks, "lens store works again"});
  } else {
    sink_({log::Event::kLensStoreFault, "lens store: " + fault});
  }
  store_ = fault;
}

namespace {

lens::ZoomEvent EventOf(lens::ZoomEvent::Kind kind, double now_s) {
  lens::ZoomEvent event;
  event.kind = kind;
  event.time_s = now_s;
  return event;
}

}  // namespace

LensSupervisor::LensSupervisor(LensSupervisorSettings settings, log::LogSink sink)
    : settings_(std::move(settings)),
      sink_(std::move(sink)),
      supervision_(settings_.zoom),
      faults_(sink_) {}

void LensSupervisor::Take(lens::ZoomEvent event) {
  if (const auto transition = supervision_.Handle(event)) ApplyTransition(*transition);
}

void LensSupervisor::ApplyTransition(const lens::ZoomTransition& transition) {
  const lens::ZoomState to = transition.to;
  const bool came_to_rest = transition.why == lens::ZoomReason::kStationary;
  if (to == lens::ZoomState::kMoving || to == lens::ZoomState::kUnknown ||
      transition.why == lens::ZoomReason::kDigitalZoom) {
    ++standstill_;
    DropLens();
  }
  if (came_to_rest) {
    standstill_zoom_ = transition.zoom_counts;
    standstill_focus_ = transition.focus_counts;
  }
  if (to != lens::ZoomState::kValid) bodies_.Invalidate();
  if (to != lens::ZoomState::kCalibrating) {
    prompt_ = lens::BoardPrompt::kNone;
    board_views_ = 0;
  }
  sink_(TransitionEntry(transition, check_message_));
}

void LensSupervisor::DropLens() {
  lens_.reset();
  baseline_.reset();
  looked_up_ = false;
  failed_checks_ = 0;
  check_message_.clear();
  contradicting_.clear();
}

bool LensSupervisor::IsCurrent(const FrameContext& context) const {
  return context.standstill == standstill_ && context.lens == lens_;
}

void LensSupervisor::OnZoomReading(const lens::ZoomReading& reading, double now_s) {
  faults_.OnSensor(zoom::ZoomResult::kOk, {});
  if (reading.zoom_counts) zoom_counts_ = reading.zoom_counts;
  if (reading.focus_counts) focus_counts_ = reading.focus_counts;
  zoom_time_s_ = reading.time_s;
  lens::ZoomEvent event = EventOf(lens::ZoomEvent::Kind::kReading, now_s);
  event.reading = reading;
  Take(event);
}

void LensSupervisor::OnSensorFault(zoom::ZoomResult result, std::string_view problem,
                                   double now_s) {
  faults_.OnSensor(result, problem);
  Take(EventOf(lens::ZoomEvent::Kind::kLost, now_s));
}

void LensSupervisor::OnTime(double now_s) {
  Take(EventOf(lens::ZoomEvent::Kind::kTime, now_s));
}

void LensSupervisor::OnCameraResult(camera::CameraResult result, std::string_view problem,
                                    double now_s) {
  if (result == camera::CameraResult::kFrame) frame_time_s_ = now_s;
  if (faults_.OnCamera(result, problem, now_s)) bodies_.Invalidate();
}

FrameContext LensSupervisor::frame_context() const {
  FrameContext context;
  context.state = state();
  const bool at_rest = state() == lens::ZoomState::kVerifying || state() == lens::ZoomState::kStale;
  context.needs_lens = at_rest && !lens_ && !looked_up_;
  context.search_for_board = supervision_.request() == lens::ZoomRequest::kBoard;
  context.zoom_counts = standstill_zoom_;
  context.focus_counts = standstill_focus_;
  context.lens = lens_;
  context.baseline = baseline_;
  context.opencv_prints = opencv_prints_;
  if (state() == lens::ZoomState::kValid || state() == lens::ZoomState::kVerifying) {
    context.set_aside = contradicting_;
  }
  context.standstill = standstill_;
  return context;
}

void LensSupervisor::OnLensLookup(std::shared_ptr<const ActiveLens> lens,
                                  std::shared_ptr<const TagBaseline> baseline,
                                  const FrameContext& context, double lookup_time_s, double now_s) {
  if (context.standstill != standstill_ || lens_) return;
  looked_up_ = true;
  lens::ZoomEvent event = EventOf(lens::ZoomEvent::Kind::kLensUnknown, now_s);
  event.observed_s = lookup_time_s;
  if (lens) {
    event.kind = lens::ZoomEvent::Kind::kLensKnown;
    event.zoom_band_counts = lens->band_counts;
    event.contradicted = lens->contradicted;
    sink_(LensFoundEntry(*lens));
  }
  lens_ = std::move(lens);
  baseline_ = lens_ ? std::move(baseline) : nullptr;
  failed_checks_ = 0;
  Take(event);
}

/// Reads the tags as OpenCV draws them, or no longer so, if the check has shown that. Only tags
/// whose origin is not named are affected; otherwise the check remains bad.
/// @return  whether the reading has changed
bool LensSupervisor::AdoptPrints(const TagCheck& check) {
  if (!check.all_turned || !settings_.opencv_turns) return false;
  const bool named = std::ranges::all_of(settings_.cell.tags, [](const target::BodyTag& tag) {
    return tag.drawn_by != target::DrawnBy::kUnspecified;
  });
  if (named) return false;
  opencv_prints_ = !opencv_prints_;
  failed_checks_ = 0;
  sink_(PrintsEntry(settings_.family, opencv_prints_));
  return true;
}

bool LensSupervisor::OnTagCheck(const TagCheck& check, const FrameContext& context, double image_s,
                                double now_s) {
  // An image taken before the zoom came to rest, or before the lens was loaded, says nothing about
  // the lens.
  if (!IsCurrent(context) || image_s < supervision_.trusted_from_s()) return false;
  lens::ZoomEvent event = EventOf(lens::ZoomEvent::Kind::kTime, now_s);
  event.observed_s = image_s;
  bool changed = false;
  const bool good = check.verdict == TagTestOutcome::kGood;
  if (good || check.verdict == TagTestOutcome::kNotVisible) {
    event.kind = good ? lens::ZoomEvent::Kind::kTagsGood : lens::ZoomEvent::Kind::kTagsNotVisible;
    if (good) failed_checks_ = 0;
  } else {
    bodies_.ResetTip();
    if (++failed_checks_ < kChecksToReject) return false;
    if (AdoptPrints(check)) return false;
    event.kind = check.verdict == TagTestOutcome::kBad ? lens::ZoomEvent::Kind::kTagsBad
                                                       : lens::ZoomEvent::Kind::kTagsGood;
    failed_checks_ = check.verdict == TagTestOutcome::kBad ? kChecksToReject : 0;
  }
  contradicting_ = check.excluded;
  if (check.message != check_message_) {
    check_message_ = check.message;
    // A bad lens is logged with the change of state.
    if (!check.message.empty() && check.verdict != TagTestOutcome::kBad) {
      sink_({good && contradicting_.empty() ? log::Event::kZoomDriftRefined
                                            : log::Event::kTagsContradict,
             "camera: " + check.message});
    }
  }
  if (check.lens) {
    auto refined = std::make_shared<ActiveLens>(*lens_);
    refined->known = *check.lens;
    lens_ = std::move(refined);
  }
  if (check.baseline) {
    baseline_ = std::make_shared<TagBaseline>(*check.baseline);
    changed = true;
  }
  const bool contradicted_before = contradicted();
  Take(event);
  if (contradicted()) {
    contradicting_ = check.unresolved;
    if (!contradicted_before) sink_(ContradictionEntry(check));
  }
  return changed;
}

void LensSupervisor::OnBodies(const std::vector<SeenBody>& seen, const FrameContext& context,
                              double image_s) {
  if (!context.lens || context.standstill != standstill_ || state() != lens::ZoomState::kValid ||
      failed_checks_ > 0)
    return;
  bodies_.Take(settings_, seen, context.lens->known.covariance, image_s);
}

bool LensSupervisor::StartBoard(double now_s) {
  Take(EventOf(lens::ZoomEvent::Kind::kBoardStarted, now_s));
  const bool started = state() == lens::ZoomState::kCalibrating;
  if (started) {
    prompt_ = lens::BoardPrompt::kShowBoard;
  } else {
    sink_({log::Event::kCalibrationNotPossible,
           fmt::format("camera: calibration cannot start now: {}",
                       lens::ZoomReasonText(supervision_.reason()))});
  }
  return started;
}

void LensSupervisor::OnBoardProgress(lens::BoardPrompt prompt, const lens::BoardGuidance& guidance,
                                     double now_s) {
  if (state() != lens::ZoomState::kCalibrating) return;
  if (guidance.views > board_views_) sink_(BoardProgressEntry(prompt, guidance));
  prompt_ = prompt;
  board_views_ = guidance.views;
  OnTime(now_s);
}

bool LensSupervisor::OnBoardAccepted(const ActiveLens& lens, double oldest_s, double now_s) {
  if (state() != lens::ZoomState::kCalibrating) return false;
  lens::ZoomEvent event = EventOf(lens::ZoomEvent::Kind::kBoardAccepted, now_s);
  event.observed_s = oldest_s;
  Take(event);
  if (state() != lens::ZoomState::kValid) return false;
  lens_ = std::make_shared<ActiveLens>(lens);
  baseline_.reset();  // the first tag check sets a new one
  looked_up_ = true;
  failed_checks_ = 0;
  return true;
}

void LensSupervisor::OnBoardRefused(const std::vector<std::string>& reasons, double now_s) {
  if (state() != lens::ZoomState::kCalibrating) return;
  for (const std::string& reason : reasons) {
    sink_({log::Event::kBoardRefused, "camera: calibration refused: " + reason});
  }
  Take(EventOf(lens::ZoomEvent::Kind::kBoardRefused, now_s));
}

void LensSupervisor::CancelBoard(double now_s) {
  if (state() != lens::ZoomState::kCalibrating) return;
  Take(EventOf(lens::ZoomEvent::Kind::kBoardCancelled, now_s));
}

void LensSupervisor::SetStoredId(std::int64_t id) {
  if (!lens_) return;
  auto stored = std::make_shared<ActiveLens>(*lens_);
  stored->id = id;
  lens_ = std::move(stored);
}

status::CameraStatus LensSupervisor::Status() const {
  status::CameraStatus status;
  status.configured = true;
  status.name = settings_.name;
  status.state = state();
  status.reason = supervision_.reason();
  status.lens_stale = state() != lens::ZoomState::kValid;
  status.camera_lost = faults_.camera_lost();
  status.zoom_unknown = state() == lens::ZoomState::kUnknown;
  status.board_wanted = supervision_.request() == lens::ZoomRequest::kBoard;
  status.fiducials_hidden = status.reason == lens::ZoomReason::kTagsNotVisible;
  status.fiducial_moved = !contradicting_.empty();
  status.opencv_prints = opencv_prints_;
  for (const int id : contradicting_) {
    if (status.contradicting_count == status.contradicting_tags.size()) break;
    status.contradicting_tags[status.contradicting_count++] = id;
  }
  status.store_fault = faults_.store_fault();
  status.prompt = prompt_;
  if (status.prompt == lens::BoardPrompt::kNone && status.board_wanted) {
    status.prompt = lens::BoardPrompt::kShowBoard;
  }
  status.board_views = static_cast<std::uint16_t>(board_views_);
  status.zoom_counts = zoom_counts_;
  status.focus_counts = focus_counts_;
  status.lens_id = lens_ ? static_cast<std::uint32_t>(lens_->id) : 0;
  if (lens_) {
    status.rests_on_no_window = lens_->declared.no_window;
    status.rests_on_fixed_focus = lens_->declared.fixed_focus;
    status.usable_radius_px = UsableEverywhere(lens_->known)
                                  ? std::numeric_limits<double>::infinity()
                                  : lens_->known.usable_radius_px;
  }
  status.zoom_time_s = zoom_time_s_;
  status.frame_time_s = frame_time_s_;
  status.bodies_configured = std::min(settings_.bodies.size(), status.bodies.size());
  bodies_.AddTo(status, state() == lens::ZoomState::kValid);
  return status;
}

}  // namespace plumbline::vision
