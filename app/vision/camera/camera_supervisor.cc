#include "app/vision/camera/camera_supervisor.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "app/base/target/declared_facts.h"
#include "app/base/text/text.h"
#include "app/vision/camera/lens_messages.h"
#include "app/vision/lens_store/stored_views.h"
#include "drivers/clock.h"
#include "drivers/files/text_file.h"

namespace plumbline::vision {
bool SharedLensStore::Open() {
  if (store_) return true;
  const double now_s = MonotonicSeconds();
  if (now_s - last_attempt_s_ < kRetryInterval_s) return false;
  last_attempt_s_ = now_s;
  auto opened = LensStore::Open(path_);
  if (!opened) {
    problem_ = opened.error();
    return false;
  }
  store_.emplace(std::move(opened).value());
  if (!store_->notice().empty())
    sink_({log::Event::kLensStoreRestored, "lens store: " + store_->notice()});
  return true;
}

Result<std::optional<LensFound>> SharedLensStore::Find(const LensKey& key,
                                                       const LensTolerance& tolerance,
                                                       const target::DeclaredFacts& declared) {
  const std::lock_guard lock(mutex_);
  if (!Open()) return Error{problem_};
  auto found = store_->Find(key, tolerance, declared);
  if (!found) {
    problem_ = found.error();
    store_.reset();
  }
  return found;
}

std::optional<LensEntry> SharedLensStore::Withheld(const LensKey& key,
                                                   const LensTolerance& tolerance,
                                                   const target::DeclaredFacts& declared) {
  const std::lock_guard lock(mutex_);
  if (!Open()) return std::nullopt;
  auto withheld = store_->Withheld(key, tolerance, declared);
  return withheld ? *std::move(withheld) : std::nullopt;
}

Result<std::int64_t> SharedLensStore::Append(const LensEntry& entry) {
  const std::lock_guard lock(mutex_);
  if (!store_) last_attempt_s_ = -1e300;  // a new lens is always worth an attempt
  if (!Open()) return Error{problem_};
  return store_->Append(entry);
}

CameraStores::CameraStores(const std::string& state_directory, const target::Body& cell,
                           const log::LogSink& sink)
    : lenses(state_directory + "/lenses.sqlite", sink),
      baselines(state_directory + "/fixed_marks.json", cell, baselines_problem) {
  if (!baselines_problem.empty())
    sink({log::Event::kTagFileFault, "reference tags: " + baselines_problem});
}

namespace {

/// Dead band of a lens, as a relative change of its focal length: this moves the corner of a 1080p
/// image by 0.3 px. It is converted to zoom counts by the slope of the lens curve.
constexpr double kRelativeFocalBand = 3e-4;
/// Limit on that conversion, in configured dead bands, where the curve is flat by chance.
constexpr std::int32_t kMaxBands = 10;

LensKey LensKeyFor(const camera::CameraIdentity& camera, const FrameContext& context) {
  return {camera.serial, camera.mode, context.zoom_counts.value_or(0), context.focus_counts};
}

}  // namespace

CameraLenses::CameraLenses(CameraStores& stores, const lens::ZoomSupervisorSettings& zoom,
                           const target::DeclaredFacts& declared, log::LogSink sink)
    : stores_(stores), zoom_(zoom), declared_(declared), sink_(std::move(sink)) {}

Result<CameraLenses::Found> CameraLenses::Find(const camera::CameraIdentity& camera,
                                               const FrameContext& context) {
  const LensKey key = LensKeyFor(camera, context);
  const LensTolerance tolerance{zoom_.zoom_band_counts, zoom_.focus_band_counts};
  const auto found = stores_.lenses.Find(key, tolerance, declared_);
  if (!found) return Error{found.error()};
  if (!*found || (*found)->how != LensFound::How::kCalibrated) {
    if (const auto withheld = stores_.lenses.Withheld(key, tolerance, declared_))
      sink_(LensWithheldEntry(withheld->id, MissingOf(withheld->declared, declared_)));
  }
  if (!*found) return Found{};
  const LensFound& stored = **found;
  auto lens = std::make_shared<ActiveLens>();
  lens->known = static_cast<const lens::KnownLens&>(stored.entry);
  lens->declared = stored.entry.declared;
  lens->calibrated = stored.how == LensFound::How::kCalibrated;
  lens->log_focal_sd = stored.log_focal_sd;
  if (stored.log_focal_per_count) {
    lens->band_counts =
        std::min(lens::DeadBandCounts(*stored.log_focal_per_count, kRelativeFocalBand),
                 kMaxBands * std::max(1, zoom_.zoom_band_counts));
  }
  if (!lens->calibrated) return Found{lens, nullptr};
  lens->id = stored.entry.id;
  lens->contradicted = stores_.baselines.IsContradicted(lens->id);
  return Found{lens, stores_.baselines.Find(lens->id)};
}

Result<std::int64_t> CameraLenses::Store(const camera::CameraIdentity& camera,
                                         const FrameContext& context, const BoardSession& session,
                                         double temp_C) {
  const LensCalibration& solved = *session.calibration();
  LensEntry entry;
  entry.key = LensKeyFor(camera, context);
  static_cast<lens::KnownLens&>(entry) = static_cast<const lens::KnownLens&>(solved);
  entry.rms_px = solved.rms_px;
  entry.uncertainty_px = solved.uncertainty.max_px;
  entry.board = WordsOf(solved.board);
  entry.declared = solved.declared;
  entry.corners = EncodeViews({solved.board, session.views()});
  if (std::isfinite(temp_C)) entry.temp_C = temp_C;
  entry.utc = text::TextOfUtcNow();
  const double fx_sd = std::sqrt(solved.covariance(kFx, kFx));
  const int decimals = text::DecimalsFor({fx_sd}, 2);
  sink_({log::Event::kCalibrated,
         fmt::format("camera: calibrated: f {:.{}f} px +- {:.{}f} px, projection uncertainty "
                     "{:.2g} px (both 1 sd), {}{}",
                     solved.lens.fx, decimals, fx_sd, decimals, solved.uncertainty.max_px,
                     BoardViewsText(solved.frames_used.size()),
                     solved.notes.empty() ? "" : "; " + solved.notes.front())});
  return stores_.lenses.Append(entry);
}

void CameraLenses::StoreContradiction(const ActiveLens& lens) {
  if (lens.id == 0 || stores_.baselines.IsContradicted(lens.id)) return;
  if (const auto kept = stores_.baselines.StoreContradiction(lens.id); !kept) {
    sink_({log::Event::kTagFileFault, "reference tags: not saved: " + kept.error()});
  }
}

void CameraLenses::StoreBaseline(const ActiveLens& lens, const TagBaseline& baseline) {
  if (!lens.calibrated || lens.id == 0) return;
  if (const auto kept = stores_.baselines.Store(lens.id, baseline); !kept) {
    sink_({log::Event::kTagFileFault, "reference tags: not saved: " + kept.error()});
  }
}

namespace {

Result<std::unique_ptr<zoom::ZoomSensor>> ZoomFrom(const config::ZoomConfig& config) {
  if (config.kind.empty()) {  // a lens without zoom is always at 0
    zoom::ZoomRow still;
    still.reading.zoom_counts = 0;
    return zoom::ReplayZoom::Create({still}, MonotonicSeconds);
  }
  zoom::ZoomConnection connection = config.connection;
  if (config.kind == "replay") {
    const Result<std::string> text = files::ReadFileUpTo(files::kTableSize, config.replay_file);
    if (!text) return Error{fmt::format("{}: {}", config.replay_file, text.error())};
    auto rows = zoom::ZoomRowsFromCsv(*text);
    if (!rows) return Error{fmt::format("{}: {}", config.replay_file, rows.error())};
    connection.replay = std::move(rows).value();
  }
  const zoom::ZoomKind* const kind = zoom::FindZoomKind(config.kind);
  if (kind == nullptr) return Error{fmt::format("unknown zoom sensor \"{}\"", config.kind)};
  return kind->make(connection);
}

}  // namespace

Result<CameraDevices> MakeCameraDevices(const config::CameraConfig& config,
                                        const config::TagsConfig& tags) {
  CameraDevices devices;
  auto camera = camera::MakeCamera(config.kind, config.connection);
  if (!camera) return Error{fmt::format("[camera]: {}", camera.error())};
  devices.camera = std::move(camera).value();
  auto zoom = ZoomFrom(config.zoom);
  if (!zoom) return Error{fmt::format("[zoom]: {}", zoom.error())};
  devices.zoom = std::move(zoom).value();
  auto family = target::TagFamilyOfName(tags.family);
  if (!family) return Error{fmt::format("tags.family: {}", family.error())};
  TrackerSettings settings;
  settings.detector.threshold = tags.threshold;
  devices.tracker = std::make_unique<Tracker>(std::move(family).value(), tags.database, settings);
  return devices;
}

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
    if (show_)
      show_(*devices_.camera, frame, {}, nullptr, session_ ? &session_->guidance() : nullptr);
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
  if (show_) show_(*devices_.camera, frame, tracked, fits ? &lens->known : nullptr, nullptr);
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
    supervisor.OnBoardProgress(session_->prompt(), session_->guidance(), MonotonicSeconds());
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
