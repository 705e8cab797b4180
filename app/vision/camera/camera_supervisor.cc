#include "app/vision/camera/camera_supervisor.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <utility>

namespace plumbline::vision {
namespace {

constexpr double kFrameTimeout_s = 0.1;
constexpr double kBoardSearchInterval_s = 0.3;
/// Consecutive searches without a board after which a refused one has left the view.
constexpr int kSearchesToLeave = 3;
constexpr int kImageThreadNice = 5;  ///< the control cycle has priority

}  // namespace

CameraSupervisor::CameraSupervisor(const config::CameraConfig& camera,
                                   const config::VisionConfig& vision, CameraDevices devices,
                                   CameraStores& stores, std::string plumbline, CameraLink& link,
                                   log::LogSink sink, Show show)
    : zoom_(camera.zoom),
      board_(vision.board),
      declared_(camera.declared),
      devices_(std::move(devices)),
      lenses_(stores, camera.zoom.supervision, camera.declared, sink),
      plumbline_(std::move(plumbline)),
      link_(link),
      sink_(sink),
      show_(std::move(show)),
      supervisor_(LensSupervisorSettingsFrom(camera, vision), std::move(sink)) {}

CameraSupervisor::~CameraSupervisor() {
  Stop();
}

void CameraSupervisor::Start() {
  WithSupervisor([](LensSupervisor&) {});
  handled_starts_ = link_.start_board;
  handled_cancels_ = link_.cancel_board;
  zoom_thread_ = std::thread([this] { RunZoomThread(); });
  pthread_setname_np(zoom_thread_.native_handle(), "zoom");
  image_thread_ = std::thread([this] { RunImageThread(); });
  pthread_setname_np(image_thread_.native_handle(), "images");
}

void CameraSupervisor::Stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  if (zoom_thread_.joinable()) zoom_thread_.join();
  if (image_thread_.joinable()) image_thread_.join();
}

void CameraSupervisor::Pause(double seconds) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return stop_; });
}

FrameContext CameraSupervisor::CurrentContext() {
  const std::lock_guard lock(mutex_);
  return supervisor_.frame_context();
}

void CameraSupervisor::RunZoomThread() {
  double tick_s = MonotonicSeconds();
  for (;;) {
    sensor_heartbeat_.Beat();
    lens::ZoomReading reading;
    const zoom::ZoomResult result = devices_.zoom->Read(reading);
    const double now_s = MonotonicSeconds();
    const bool stop = WithSupervisor([&](LensSupervisor& supervisor) {
      if (result == zoom::ZoomResult::kOk) {
        supervisor.OnZoomReading(reading, now_s);
      } else {
        supervisor.OnSensorFault(result, devices_.zoom->problem(), now_s);
      }
      return stop_;
    });
    if (stop) return;
    tick_s = std::max(tick_s + zoom_.period_s, now_s);
    Pause(tick_s - now_s);
  }
}

void CameraSupervisor::RunImageThread() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kImageThreadNice);
  worker_.emplace(plumbline_, MonotonicSeconds);  // here: the process ends with this thread
  for (;;) {
    image_heartbeat_.Beat();
    HandleRequests();
    camera::CameraFrame frame;
    const camera::CameraResult result = devices_.camera->Read(kFrameTimeout_s, frame);
    const double now_s = MonotonicSeconds();
    const bool stop = WithSupervisor([&](LensSupervisor& supervisor) {
      supervisor.OnCameraResult(result, devices_.camera->problem(), now_s);
      return stop_;
    });
    if (stop) break;
    for (const std::string& remark : devices_.camera->TakeRemarks()) {
      sink_({log::Event::kCameraWarning, "camera: " + remark});
    }
    if (result == camera::CameraResult::kFrame) {
      TakeFrame(frame);
    } else {
      OnMissingFrame(now_s);
      Pause(result == camera::CameraResult::kNoFrame ? 0 : kFrameTimeout_s);
    }
  }
  worker_.reset();
}

/// A capture times out even if the camera no longer delivers frames.
void CameraSupervisor::OnMissingFrame(double now_s) {
  if (CurrentContext().state != lens::ZoomState::kCalibrating) {
    waiting_since_s_.reset();
    return;
  }
  if (session_) {
    session_->TakeFailure("no frame from the camera", now_s);
    if (session_->state() != BoardSession::State::kCapturing) FinishBoard();
    return;
  }
  if (!waiting_since_s_) waiting_since_s_ = now_s;
  if (now_s - *waiting_since_s_ < board_.patience_s) return;
  waiting_since_s_.reset();
  const std::string why =
      fmt::format("no frame from the camera within {:.0f} s", board_.patience_s);
  WithSupervisor([&](LensSupervisor& supervisor) { supervisor.OnBoardRefused({why}, now_s); });
}

void CameraSupervisor::HandleRequests() {
  const double now_s = MonotonicSeconds();
  if (const std::uint32_t starts = link_.start_board; starts != handled_starts_) {
    handled_starts_ = starts;
    WithSupervisor([&](LensSupervisor& supervisor) { return supervisor.StartBoard(now_s); });
  }
  if (const std::uint32_t cancels = link_.cancel_board; cancels != handled_cancels_) {
    handled_cancels_ = cancels;
    WithSupervisor([&](LensSupervisor& supervisor) { supervisor.CancelBoard(now_s); });
  }
}

void CameraSupervisor::TakeFrame(const camera::CameraFrame& frame) {
  waiting_since_s_.reset();
  const FrameContext context = CurrentContext();
  if (context.standstill != standstill_) devices_.tracker->Forget();
  if (context.standstill != standstill_) refused_board_in_view_ = false;
  standstill_ = context.standstill;
  if (context.state == lens::ZoomState::kCalibrating) {
    if (show_) show_(*devices_.camera, frame, {}, nullptr);
    CaptureBoard(frame);
    return;
  }
  session_.reset();
  if (context.needs_lens) LookUpLens(context);
  Track(context, frame);
  if (context.search_for_board && board_.by_itself) LookForBoard(frame);
}

void CameraSupervisor::Track(const FrameContext& context, const camera::CameraFrame& frame) {
  const ActiveLens* const lens = context.lens.get();
  const bool fits = lens != nullptr && lens->known.size == frame.luma.size();
  if (lens != nullptr && !fits && !size_mismatch_) {
    sink_({log::Event::kCameraSize,
           fmt::format(
               "camera: images are {} x {} px, but the lens was calibrated at {} x {} px; nothing "
               "is measured in them. Set the camera to that size, or calibrate at this one.",
               frame.luma.width, frame.luma.height, lens->known.size.width,
               lens->known.size.height)});
  }
  size_mismatch_ = lens != nullptr && !fits;
  devices_.tracker->AssumeOpenCvPrints(context.opencv_prints);
  devices_.tracker->SetAside(context.set_aside);
  const TrackedFrame& tracked =
      devices_.tracker->Update(frame.luma, frame.time_s, fits ? &lens->known : nullptr);
  if (show_) show_(*devices_.camera, frame, tracked, fits ? &lens->known : nullptr);
  if (lens == nullptr) return;
  std::vector<SeenTag> tags;  // empty if the lens does not apply to this image
  if (fits) {
    tags.reserve(tracked.tags.size());
    for (const TrackedTag& tag : tracked.tags) {
      if (InUsableRegion(lens->known, tag.seen)) tags.push_back(tag.seen);
    }
  }
  const LensSupervisorSettings& settings = supervisor_.settings();
  const TagCheck check = CheckReferenceTags(*lens, context.baseline.get(), settings.cell, tags,
                                            settings.acceptable_px, settings.tag_check);
  bool contradicted = false;
  const bool changed = WithSupervisor([&](LensSupervisor& supervisor) {
    const bool baseline = supervisor.OnTagCheck(check, context, frame.time_s, MonotonicSeconds());
    supervisor.OnBodies(tracked.bodies, context, frame.time_s);
    contradicted = supervisor.contradicted();
    return baseline;
  });
  if (changed && check.baseline) lenses_.StoreBaseline(*lens, *check.baseline);
  if (contradicted) lenses_.StoreContradiction(*lens);
}

void CameraSupervisor::LookUpLens(const FrameContext& context) {
  const camera::CameraIdentity& camera = devices_.camera->identity();
  if (camera.serial.empty()) return;
  const double lookup_time_s = MonotonicSeconds();
  const auto found = lenses_.Find(camera, context);
  WithSupervisor(
      [&](LensSupervisor& supervisor) { supervisor.OnStoreFault(found ? "" : found.error()); });
  if (!found) return;
  WithSupervisor([&](LensSupervisor& supervisor) {
    supervisor.OnLensLookup(found->lens, found->baseline, context, lookup_time_s,
                            MonotonicSeconds());
  });
}

void CameraSupervisor::LookForBoard(const camera::CameraFrame& frame) {
  const auto answer = worker_->Poll();
  if (answer && search_standstill_ == standstill_) {
    searches_without_board_ = *answer ? 0 : searches_without_board_ + 1;
    if (searches_without_board_ >= kSearchesToLeave) refused_board_in_view_ = false;
  }
  if (answer && *answer && !refused_board_in_view_ && search_standstill_ == standstill_) {
    const bool started = WithSupervisor(
        [&](LensSupervisor& supervisor) { return supervisor.StartBoard(MonotonicSeconds()); });
    if (started) sink_({log::Event::kBoardSeen, "camera: the board is in view; capture started"});
    return;
  }
  if (!worker_->idle() || frame.time_s - searched_s_ < kBoardSearchInterval_s) return;
  searched_s_ = frame.time_s;
  search_standstill_ = standstill_;
  if (const auto given = worker_->Submit(frame.luma, board_.board); !given) {
    sink_({log::Event::kBoardWorker, "camera: " + given.error()});
  }
}

void CameraSupervisor::CaptureBoard(const camera::CameraFrame& frame) {
  if (!session_) {
    session_.emplace(BoardSettingsFrom(board_, declared_), frame.luma.size(), frame.time_s);
    search_standstill_.reset();
    worker_image_s_ = 0;  // a pending response belongs to a frame from before the capture
  }
  if (auto answer = worker_->Poll()) {
    if (*answer && worker_image_s_ > 0) {
      BoardView view = std::move(*answer).value();
      view.time_s = worker_image_s_;
      session_->Take(std::move(view));
    } else if (!*answer) {
      session_->TakeFailure(answer->error(), frame.time_s);
    }
  }
  if (worker_->idle()) {
    worker_image_s_ = frame.time_s;
    if (const auto given = worker_->Submit(frame.luma, board_.board); !given) {
      session_->TakeFailure(given.error(), frame.time_s);
    }
  }
  WithSupervisor([&](LensSupervisor& supervisor) {
    supervisor.OnBoardProgress(session_->prompt(), session_->kept(), MonotonicSeconds());
  });
  if (session_->state() != BoardSession::State::kCapturing) FinishBoard();
}

void CameraSupervisor::FinishBoard() {
  const BoardSession session = std::move(*session_);
  session_.reset();
  if (session.state() == BoardSession::State::kRefused) {
    refused_board_in_view_ = true;
    searches_without_board_ = 0;
    WithSupervisor([&](LensSupervisor& supervisor) {
      supervisor.OnBoardRefused(session.reasons(), MonotonicSeconds());
    });
    return;
  }
  const LensCalibration& solved = *session.calibration();
  ActiveLens lens;
  lens.known = static_cast<const lens::KnownLens&>(solved);
  lens.calibrated = true;
  lens.declared = solved.declared;
  const FrameContext context = CurrentContext();
  const bool taken = WithSupervisor([&](LensSupervisor& supervisor) {
    return supervisor.OnBoardAccepted(lens, session.oldest_s(), MonotonicSeconds());
  });
  if (taken) StoreLens(session, context);
}

void CameraSupervisor::StoreLens(const BoardSession& session, const FrameContext& context) {
  // If this fails, the lens is still used until the zoom changes.
  const auto stored = lenses_.Store(devices_.camera->identity(), context, session, link_.temp_C);
  WithSupervisor([&](LensSupervisor& supervisor) {
    supervisor.OnStoreFault(stored ? "" : stored.error());
    if (stored) supervisor.SetStoredId(*stored);
  });
}

}  // namespace plumbline::vision
