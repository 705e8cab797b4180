#include "app/camera/watch_core.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "app/printed_digits.h"
#include "firmware-like/deflection/uncertainty.h"

namespace plumbline {
namespace {

Event LogEventOf(const ZoomTransition& transition) {
  switch (transition.to) {
    case ZoomState::kValid:
      return Event::kLensValid;
    case ZoomState::kStale:
      return Event::kLensStale;
    case ZoomState::kRefused:
      return Event::kLensRefused;
    case ZoomState::kUnknown:
      return transition.why == ZoomReason::kSensorLost ? Event::kLensUnknown : Event::kLensState;
    default:
      return transition.from == ZoomState::kValid ? Event::kLensLeft : Event::kLensState;
  }
}

ZoomEvent EventOf(ZoomEvent::Kind kind, double now_s) {
  ZoomEvent event;
  event.kind = kind;
  event.time_s = now_s;
  return event;
}

const SeenBody* Find(const std::vector<SeenBody>& bodies, const std::string& name) {
  for (const SeenBody& body : bodies) {
    if (body.body->name == name) return &body;
  }
  return nullptr;
}

}  // namespace

WatchCore::WatchCore(WatchSettings settings, LogSink sink)
    : settings_(std::move(settings)), sink_(std::move(sink)), supervision_(settings_.zoom) {}

void WatchCore::Take(ZoomEvent event) {
  if (const auto transition = supervision_.Handle(event)) Tell(*transition);
}

void WatchCore::Tell(const ZoomTransition& transition) {
  const ZoomState to = transition.to;
  const bool stands = transition.why == ZoomReason::kStoodStill;
  if (to == ZoomState::kMoving || to == ZoomState::kUnknown ||
      transition.why == ZoomReason::kDigitalZoom) {
    ++rest_;
    ForgetLens();
  }
  if (stands) {
    rest_zoom_ = transition.zoom_counts;
    rest_focus_ = transition.focus_counts;
  }
  if (to != ZoomState::kValid) ForgetBodies();
  if (to != ZoomState::kCalibrating) {
    prompt_ = BoardPrompt::kNone;
    board_views_ = 0;
  }
  const std::string at =
      transition.zoom_counts ? fmt::format(" (zoom {})", *transition.zoom_counts) : "";
  const bool said = !look_words_.empty() && (transition.why == ZoomReason::kMarksBad);
  std::vector<LogField> fields = {{"CAMERA_STATE", std::string(ZoomStateText(to))}};
  if (transition.zoom_counts) {
    fields.push_back({"ZOOM_COUNTS", fmt::format("{}", *transition.zoom_counts)});
  }
  sink_({LogEventOf(transition),
         fmt::format("camera {}: {}{}{}", ZoomStateText(to), ZoomReasonText(transition.why), at,
                     said ? "; " + look_words_ : ""),
         fields});
}

void WatchCore::ForgetLens() {
  lens_.reset();
  memory_.reset();
  looked_up_ = false;
  doubts_ = 0;
  look_words_.clear();
  mark_moved_ = false;
}

void WatchCore::ForgetBodies() {
  tip_.Forget();
  for (CameraStatus::Body& body : bodies_) body.valid = false;
}

bool WatchCore::IsOf(const WatchOrders& asked) const {
  return asked.rest == rest_ && asked.lens == lens_;
}

void WatchCore::TakeReading(const ZoomReading& reading, double now_s) {
  if (sensor_ && *sensor_ != ZoomResult::kOk)
    sink_({Event::kSensorBack, "zoom sensor answers again"});
  sensor_ = ZoomResult::kOk;
  if (reading.zoom_counts) zoom_counts_ = reading.zoom_counts;
  if (reading.focus_counts) focus_counts_ = reading.focus_counts;
  zoom_time_s_ = reading.time_s;
  ZoomEvent event = EventOf(ZoomEvent::Kind::kReading, now_s);
  event.reading = reading;
  Take(event);
}

void WatchCore::TakeSensorFault(ZoomResult result, std::string_view problem, double now_s) {
  if (result != ZoomResult::kWaiting && sensor_ != result) {
    sensor_ = result;
    sink_(
        {Event::kSensorFault, fmt::format("zoom sensor: {}: {}", ZoomResultText(result), problem)});
  }
  Take(EventOf(ZoomEvent::Kind::kLost, now_s));
}

void WatchCore::TakeTime(double now_s) {
  Take(EventOf(ZoomEvent::Kind::kTime, now_s));
}

void WatchCore::TakeCameraResult(CameraResult result, std::string_view problem, double now_s) {
  const bool well = result == CameraResult::kFrame;
  if (well) frame_time_s_ = now_s;
  if (result == CameraResult::kWaiting || result == CameraResult::kNoFrame || camera_ == result) {
    return;
  }
  if (well && camera_) {
    sink_({Event::kCameraBack, fmt::format("camera back after {:.1f} s", now_s - camera_lost_s_)});
  } else if (!well) {
    if (!camera_ || *camera_ == CameraResult::kFrame) camera_lost_s_ = now_s;
    ForgetBodies();
    sink_({result == CameraResult::kEnded ? Event::kCameraEnded : Event::kCameraLost,
           fmt::format("camera: {}: {}", CameraResultText(result), problem)});
  }
  camera_ = result;
}

WatchOrders WatchCore::orders() const {
  WatchOrders orders;
  orders.state = state();
  const bool at_rest = state() == ZoomState::kVerifying || state() == ZoomState::kStale;
  orders.look_up = at_rest && !lens_ && !looked_up_;
  orders.want_board = supervision_.request() == ZoomAsk::kBoard;
  orders.zoom_counts = rest_zoom_;
  orders.focus_counts = rest_focus_;
  orders.lens = lens_;
  orders.memory = memory_;
  orders.rest = rest_;
  return orders;
}

void WatchCore::TakeLens(std::shared_ptr<const LensInUse> lens,
                         std::shared_ptr<const MarksMemory> memory, const WatchOrders& asked,
                         double asked_s, double now_s) {
  if (asked.rest != rest_ || lens_) return;
  looked_up_ = true;
  ZoomEvent event = EventOf(ZoomEvent::Kind::kLensUnknown, now_s);
  event.about_s = asked_s;
  if (lens) {
    event.kind = ZoomEvent::Kind::kLensKnown;
    event.zoom_band_counts = lens->band_counts;
    sink_({Event::kLensFound,
           lens->calibrated
               ? fmt::format("camera: lens {} of the store, f {:.1f} px", lens->id,
                             lens->known.lens.fx)
               : fmt::format("camera: a lens between calibrated zooms, f {:.1f} px +- {:.{}f} %",
                             lens->known.lens.fx, 100 * lens->log_focal_sd,
                             DecimalsFor({100 * lens->log_focal_sd}, 2))});
  }
  lens_ = std::move(lens);
  memory_ = lens_ ? std::move(memory) : nullptr;
  doubts_ = 0;
  Take(event);
}

bool WatchCore::TakeLook(const MarksLook& look, const WatchOrders& asked, double image_s,
                         double now_s) {
  // An image from before the lens stood, or was loaded, tells nothing of it.
  if (!IsOf(asked) || image_s < supervision_.trusted_from_s()) return false;
  ZoomEvent event = EventOf(ZoomEvent::Kind::kTime, now_s);
  event.about_s = image_s;
  bool changed = false;
  const bool good = look.verdict == MarksVerdict::kGood;
  if (good || look.verdict == MarksVerdict::kNotVisible) {
    event.kind = good ? ZoomEvent::Kind::kMarksGood : ZoomEvent::Kind::kMarksNotVisible;
    if (good) doubts_ = 0;
  } else {
    tip_.Forget();
    if (++doubts_ < kLooksToDoubt) return false;
    event.kind = look.verdict == MarksVerdict::kBad ? ZoomEvent::Kind::kMarksBad
                                                    : ZoomEvent::Kind::kMarksGood;
    doubts_ = look.verdict == MarksVerdict::kBad ? kLooksToDoubt : 0;
  }
  mark_moved_ = !look.left_out.empty();
  if (look.words != look_words_) {
    look_words_ = look.words;
    // What is bad is told with the change of state.
    if (!look.words.empty() && look.verdict != MarksVerdict::kBad) {
      sink_({good && !mark_moved_ ? Event::kMarksExplained : Event::kMarksDoubted,
             "camera: " + look.words});
    }
  }
  if (look.lens) {
    auto refined = std::make_shared<LensInUse>(*lens_);
    refined->known = *look.lens;
    lens_ = std::move(refined);
  }
  if (look.memory) {
    memory_ = std::make_shared<MarksMemory>(*look.memory);
    changed = true;
  }
  Take(event);
  return changed;
}

void WatchCore::TakeBodies(const std::vector<SeenBody>& seen, const WatchOrders& asked,
                           double image_s) {
  if (!asked.lens || asked.rest != rest_ || state() != ZoomState::kValid || doubts_ > 0) return;
  const LensCovariance& lens = asked.lens->known.covariance;
  const SeenBody* const cell = Find(seen, settings_.cell.name);
  const auto places = [this](const SeenBody& body) {
    return PlaceErrors{settings_.marks.place_sd_m,
                       body.body->place_sd_m.value_or(kPlaceSdOnOnePlate_m)};
  };
  for (std::size_t k = 0; k < settings_.bodies.size() && k < bodies_.size(); ++k) {
    const SeenBody* const body = Find(seen, settings_.bodies[k]);
    CameraStatus::Body& told = bodies_[k];
    told.valid = body != nullptr && cell != nullptr;
    if (!told.valid) continue;
    told.ambiguous = body->ambiguous || cell->ambiguous;
    told.X_WK = settings_.X_WK * (cell->estimate.X_CK.Inverse() * body->estimate.X_CK);
    const PointByCamera origin = MeasurePoint(cell->estimate, body->estimate, settings_.X_WK,
                                              Vec3::Zero(), lens, image_s, places(*body));
    told.radius_m = RadiusHolding95Percent(origin.covariance_W + origin.places_W);
    told.time_s = image_s;
  }
  const SeenBody* const tool = settings_.tool.empty() ? nullptr : Find(seen, settings_.tool);
  const bool sure = tool != nullptr && cell != nullptr && !tool->ambiguous && !cell->ambiguous &&
                    cell->used.size() >= 2;
  if (sure) {
    tip_.Take(MeasurePoint(cell->estimate, tool->estimate, settings_.X_WK, settings_.tip_T, lens,
                           image_s, places(*tool)));
  } else {
    tip_.Forget();
  }
}

bool WatchCore::StartBoard(double now_s) {
  Take(EventOf(ZoomEvent::Kind::kBoardStarted, now_s));
  const bool started = state() == ZoomState::kCalibrating;
  if (started) {
    prompt_ = BoardPrompt::kShowBoard;
  } else {
    sink_({Event::kBoardRefusedNow,
           fmt::format("camera: no calibration now: {}", ZoomReasonText(supervision_.reason()))});
  }
  return started;
}

void WatchCore::TakeProgress(BoardPrompt prompt, std::size_t kept, double now_s) {
  if (state() != ZoomState::kCalibrating) return;
  if (kept != board_views_ && prompt != BoardPrompt::kHoldStill) {
    sink_({Event::kBoardProgress,
           fmt::format("camera: {} views of the board; {}", kept, BoardPromptText(prompt))});
  }
  prompt_ = prompt;
  board_views_ = kept;
  TakeTime(now_s);
}

bool WatchCore::TakeAccepted(const LensInUse& lens, double oldest_s, double now_s) {
  if (state() != ZoomState::kCalibrating) return false;
  ZoomEvent event = EventOf(ZoomEvent::Kind::kBoardAccepted, now_s);
  event.about_s = oldest_s;
  Take(event);
  if (state() != ZoomState::kValid) return false;
  lens_ = std::make_shared<LensInUse>(lens);
  memory_.reset();  // the first look at the marks makes a new one
  looked_up_ = true;
  doubts_ = 0;
  return true;
}

void WatchCore::TakeRefused(const std::vector<std::string>& reasons, double now_s) {
  if (state() != ZoomState::kCalibrating) return;
  for (const std::string& reason : reasons) {
    sink_({Event::kBoardRefused, "camera: calibration refused: " + reason});
  }
  Take(EventOf(ZoomEvent::Kind::kBoardRefused, now_s));
}

void WatchCore::CancelBoard(double now_s) {
  if (state() != ZoomState::kCalibrating) return;
  Take(EventOf(ZoomEvent::Kind::kBoardCancelled, now_s));
}

void WatchCore::NoteKept(std::int64_t id) {
  if (!lens_) return;
  auto kept = std::make_shared<LensInUse>(*lens_);
  kept->id = id;
  lens_ = std::move(kept);
}

void WatchCore::NoteStoreFault(const std::string& fault) {
  if (fault == store_fault_) return;
  if (fault.empty()) {
    sink_({Event::kLensStoreWorks, "lens store works again"});
  } else {
    sink_({Event::kLensStoreFault, "lens store: " + fault});
  }
  store_fault_ = fault;
}

CameraStatus WatchCore::Status() const {
  CameraStatus status;
  status.configured = true;
  status.name = settings_.name;
  status.state = state();
  status.reason = supervision_.reason();
  status.lens_stale = state() != ZoomState::kValid;
  status.camera_lost = camera_ != CameraResult::kFrame;
  status.zoom_unknown = state() == ZoomState::kUnknown;
  status.board_wanted = supervision_.request() == ZoomAsk::kBoard;
  status.fiducials_hidden = status.reason == ZoomReason::kMarksNotVisible;
  status.fiducial_moved = mark_moved_;
  status.store_fault = !store_fault_.empty();
  status.prompt = prompt_;
  if (status.prompt == BoardPrompt::kNone && status.board_wanted) {
    status.prompt = BoardPrompt::kShowBoard;
  }
  status.board_views = static_cast<std::uint16_t>(board_views_);
  status.zoom_counts = zoom_counts_;
  status.focus_counts = focus_counts_;
  status.lens_id = lens_ ? static_cast<std::uint32_t>(lens_->id) : 0;
  status.zoom_time_s = zoom_time_s_;
  status.frame_time_s = frame_time_s_;
  status.bodies_configured = std::min(settings_.bodies.size(), bodies_.size());
  status.bodies = bodies_;
  if (const auto tip = tip_.Point(); tip && state() == ZoomState::kValid) {
    status.tip_valid = true;
    status.tip_W = tip->p_W;
    status.tip_covariance_W = tip->covariance_W;
    status.tip_places_W = tip->places_W;
    status.tip_time_s = tip->time_s;
  }
  return status;
}

}  // namespace plumbline
