#include "app/camera/camera_watch.h"

#include <fmt/format.h>
#include <pthread.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <ctime>
#include <utility>

#include "app/lens_store/stored_views.h"
#include "app/printed_digits.h"

namespace plumbline {
namespace {

constexpr double kFrameTimeout_s = 0.1;
constexpr double kBoardLook_s = 0.3;  ///< between two looks for a board that was asked for
constexpr int kWatchNice = 5;         ///< of the images' thread: the cycle goes first
/// The dead band of a lens: what this share of its focal length is worth in counts. It moves the
/// corner of a 1080p image by 0.3 px.
constexpr double kBandOfFocal = 3e-4;
constexpr double kLeastPlaceSd_m = 1e-6;  ///< no place of a mark is known better
constexpr std::int32_t kMostBands =
    10;  ///< times the configured band: a curve that is flat by chance

WatchSettings SettingsFrom(const CameraConfig& camera, const VisionConfig& vision) {
  const TagsConfig& tags = vision.tags;
  WatchSettings settings;
  settings.name = camera.name;
  settings.zoom = camera.zoom.supervision;
  settings.acceptable_px = vision.board.acceptable_px;
  settings.cell = CellMarksOf(tags);
  settings.marks.place_sd_m =
      std::max(settings.cell.place_sd_m.value_or(tags.place_sd_m), kLeastPlaceSd_m);
  for (const Body& body : tags.database.bodies) settings.bodies.push_back(body.name);
  settings.X_WK = tags.X_WK;
  settings.tool = tags.tool;
  settings.tip_T = tags.tip_T;
  return settings;
}

BoardSettings BoardFrom(const BoardConfig& config) {
  BoardSettings board;
  board.board = config.board;
  board.views = config.views;
  board.most_views = config.most_views;
  board.patience_s = config.patience_s;
  board.options = {config.acceptable_px, config.distance_m};
  return board;
}

std::string UtcNow() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

}  // namespace

CameraWatch::CameraWatch(const CameraConfig& camera, const VisionConfig& vision,
                         CameraDevices devices, WatchStores& stores, std::string plumbline,
                         CameraLink& link, LogSink sink, Show show)
    : zoom_(camera.zoom),
      board_(vision.board),
      devices_(std::move(devices)),
      stores_(stores),
      plumbline_(std::move(plumbline)),
      link_(link),
      sink_(sink),
      show_(std::move(show)),
      core_(SettingsFrom(camera, vision), std::move(sink)) {}

CameraWatch::~CameraWatch() {
  Stop();
}

void CameraWatch::Start() {
  WithCore([](WatchCore&) {});
  started_ = link_.start_board;
  cancelled_ = link_.cancel_board;
  sensor_thread_ = std::thread([this] { ReadSensor(); });
  pthread_setname_np(sensor_thread_.native_handle(), "zoom");
  image_thread_ = std::thread([this] { ReadImages(); });
  pthread_setname_np(image_thread_.native_handle(), "images");
}

void CameraWatch::Stop() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  if (sensor_thread_.joinable()) sensor_thread_.join();
  if (image_thread_.joinable()) image_thread_.join();
}

void CameraWatch::Pause(double seconds) {
  std::unique_lock lock(mutex_);
  wake_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return stop_; });
}

WatchOrders CameraWatch::Orders() {
  const std::lock_guard lock(mutex_);
  return core_.orders();
}

void CameraWatch::ReadSensor() {
  double tick_s = MonotonicSeconds();
  for (;;) {
    sensor_pulse_.Beat();
    ZoomReading reading;
    const ZoomResult result = devices_.zoom->Read(reading);
    const double now_s = MonotonicSeconds();
    const bool stop = WithCore([&](WatchCore& core) {
      if (result == ZoomResult::kOk) {
        core.TakeReading(reading, now_s);
      } else {
        core.TakeSensorFault(result, devices_.zoom->problem(), now_s);
      }
      return stop_;
    });
    if (stop) return;
    tick_s = std::max(tick_s + zoom_.period_s, now_s);
    Pause(tick_s - now_s);
  }
}

void CameraWatch::ReadImages() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(gettid()), kWatchNice);
  worker_.emplace(plumbline_, MonotonicSeconds);  // ends with this thread
  for (;;) {
    image_pulse_.Beat();
    Obey();
    CameraFrame frame;
    const CameraResult result = devices_.camera->Read(kFrameTimeout_s, frame);
    const double now_s = MonotonicSeconds();
    const bool stop = WithCore([&](WatchCore& core) {
      core.TakeCameraResult(result, devices_.camera->problem(), now_s);
      return stop_;
    });
    if (stop) break;
    for (const std::string& remark : devices_.camera->TakeRemarks()) {
      sink_({Event::kCameraRemark, "camera: " + remark});
    }
    if (result == CameraResult::kFrame) {
      TakeFrame(frame);
    } else {
      WaitForFrames(now_s);
      Pause(result == CameraResult::kNoFrame ? 0 : kFrameTimeout_s);
    }
  }
  worker_.reset();
}

/// A capture whose camera went away ends when its patience does: nobody waits for ever.
void CameraWatch::WaitForFrames(double now_s) {
  if (Orders().state != ZoomState::kCalibrating) {
    blind_s_.reset();
    return;
  }
  if (session_) {
    session_->TakeMiss("no frame of the camera", now_s);
    if (session_->state() != BoardSession::State::kCapturing) FinishBoard();
    return;
  }
  if (!blind_s_) blind_s_ = now_s;
  if (now_s - *blind_s_ < board_.patience_s) return;
  blind_s_.reset();
  const std::string why = fmt::format("no frame of the camera within {:.0f} s", board_.patience_s);
  WithCore([&](WatchCore& core) { core.TakeRefused({why}, now_s); });
}

void CameraWatch::Obey() {
  const double now_s = MonotonicSeconds();
  if (const std::uint32_t asked = link_.start_board; asked != started_) {
    started_ = asked;
    WithCore([&](WatchCore& core) { return core.StartBoard(now_s); });
  }
  if (const std::uint32_t asked = link_.cancel_board; asked != cancelled_) {
    cancelled_ = asked;
    WithCore([&](WatchCore& core) { core.CancelBoard(now_s); });
  }
}

void CameraWatch::TakeFrame(const CameraFrame& frame) {
  blind_s_.reset();
  const WatchOrders asked = Orders();
  if (asked.rest != rest_) devices_.tracker->Forget();
  rest_ = asked.rest;
  if (asked.state == ZoomState::kCalibrating) {
    if (show_) show_(*devices_.camera, frame, {}, nullptr);
    CaptureBoard(frame);
    return;
  }
  session_.reset();
  if (asked.look_up) LookUp(asked);
  Track(asked, frame);
  if (asked.want_board && board_.by_itself) WatchForBoard(frame);
}

void CameraWatch::Track(const WatchOrders& asked, const CameraFrame& frame) {
  const LensInUse* const lens = asked.lens.get();
  const bool fits = lens != nullptr && lens->known.size == frame.luma.size();
  if (lens != nullptr && !fits && !odd_size_) {
    sink_(
        {Event::kCameraSize,
         fmt::format("camera: its images have {} x {} px, the lens is of {} x {}; not measured in: "
                     "set the camera to that size, or calibrate in this one",
                     frame.luma.width, frame.luma.height, lens->known.size.width,
                     lens->known.size.height)});
  }
  odd_size_ = lens != nullptr && !fits;
  const TrackedFrame& tracked =
      devices_.tracker->Update(frame.luma, frame.time_s, fits ? &lens->known : nullptr);
  if (show_) show_(*devices_.camera, frame, tracked, fits ? &lens->known.lens : nullptr);
  if (lens == nullptr) return;
  std::vector<SeenTag> tags;  // none where the lens tells nothing of this image
  if (fits) {
    tags.reserve(tracked.tags.size());
    for (const TrackedTag& tag : tracked.tags) tags.push_back(tag.seen);
  }
  const WatchSettings& settings = core_.settings();
  const MarksLook look = LookAtMarks(*lens, asked.memory.get(), settings.cell, tags,
                                     settings.acceptable_px, settings.marks);
  const bool changed = WithCore([&](WatchCore& core) {
    const bool memory = core.TakeLook(look, asked, frame.time_s, MonotonicSeconds());
    core.TakeBodies(tracked.bodies, asked, frame.time_s);
    return memory;
  });
  if (changed && look.memory) KeepMarks(asked, *look.memory);
}

void CameraWatch::KeepMarks(const WatchOrders& asked, const MarksMemory& memory) {
  if (!asked.lens->calibrated || asked.lens->id == 0) return;
  if (const auto kept = stores_.marks.Keep(asked.lens->id, memory); !kept) {
    sink_({Event::kMarksFile, "fixed marks: not kept: " + kept.error()});
  }
}

LensKey CameraWatch::KeyOf(const WatchOrders& asked) const {
  const CameraIdentity& camera = devices_.camera->identity();
  return {camera.serial, camera.mode, asked.zoom_counts.value_or(0), asked.focus_counts};
}

void CameraWatch::LookUp(const WatchOrders& asked) {
  if (devices_.camera->identity().serial.empty()) return;
  const double asked_s = MonotonicSeconds();
  const ZoomSupervisionSettings& bands = zoom_.supervision;
  const auto found =
      stores_.lenses.Find(KeyOf(asked), {bands.zoom_band_counts, bands.focus_band_counts});
  WithCore([&](WatchCore& core) { core.NoteStoreFault(found ? "" : found.error()); });
  if (!found) return;
  std::shared_ptr<LensInUse> lens;
  std::shared_ptr<const MarksMemory> memory;
  if (*found) {
    const LensFound& entry = **found;
    lens = std::make_shared<LensInUse>();
    lens->known = entry.entry;
    lens->calibrated = entry.how == LensFound::How::kCalibrated;
    lens->id = lens->calibrated ? entry.entry.id : 0;
    lens->log_focal_sd = entry.log_focal_sd;
    if (entry.log_focal_per_count) {
      lens->band_counts = std::min(DeadBandCounts(*entry.log_focal_per_count, kBandOfFocal),
                                   kMostBands * std::max(1, zoom_.supervision.zoom_band_counts));
    }
    if (lens->calibrated) memory = stores_.marks.Find(lens->id);
  }
  WithCore(
      [&](WatchCore& core) { core.TakeLens(lens, memory, asked, asked_s, MonotonicSeconds()); });
}

void CameraWatch::WatchForBoard(const CameraFrame& frame) {
  if (const auto answer = worker_->Poll(); answer && *answer && look_rest_ == rest_) {
    const bool started =
        WithCore([&](WatchCore& core) { return core.StartBoard(MonotonicSeconds()); });
    if (started) sink_({Event::kBoardSeen, "camera: the board is in view; its capture begins"});
    return;
  }
  if (!worker_->idle() || frame.time_s - looked_s_ < kBoardLook_s) return;
  looked_s_ = frame.time_s;
  look_rest_ = rest_;
  if (const auto given = worker_->Ask(frame.luma, board_.board); !given) {
    sink_({Event::kBoardWorker, "camera: " + given.error()});
  }
}

void CameraWatch::CaptureBoard(const CameraFrame& frame) {
  if (!session_) {
    session_.emplace(BoardFrom(board_), frame.luma.size(), frame.time_s);
    look_rest_.reset();
    asked_image_s_ = 0;  // whatever the worker has is of a frame from before
  }
  if (auto answer = worker_->Poll()) {
    if (*answer && asked_image_s_ > 0) {
      BoardView view = std::move(*answer).value();
      view.time_s = asked_image_s_;
      session_->Take(std::move(view));
    } else if (!*answer) {
      session_->TakeMiss(answer->error(), frame.time_s);
    }
  }
  if (worker_->idle()) {
    asked_image_s_ = frame.time_s;
    if (const auto given = worker_->Ask(frame.luma, board_.board); !given) {
      session_->TakeMiss(given.error(), frame.time_s);
    }
  }
  WithCore([&](WatchCore& core) {
    core.TakeProgress(session_->prompt(), session_->kept(), MonotonicSeconds());
  });
  if (session_->state() != BoardSession::State::kCapturing) FinishBoard();
}

void CameraWatch::FinishBoard() {
  const BoardSession session = std::move(*session_);
  session_.reset();
  if (session.state() == BoardSession::State::kRefused) {
    WithCore([&](WatchCore& core) { core.TakeRefused(session.reasons(), MonotonicSeconds()); });
    return;
  }
  const LensCalibration& solved = *session.calibration();
  LensInUse lens;
  lens.known = solved;
  lens.calibrated = true;
  const WatchOrders asked = Orders();
  const bool taken = WithCore([&](WatchCore& core) {
    return core.TakeAccepted(lens, session.oldest_s(), MonotonicSeconds());
  });
  if (taken) KeepLens(session, asked);
}

void CameraWatch::KeepLens(const BoardSession& session, const WatchOrders& asked) {
  const LensCalibration& solved = *session.calibration();
  LensEntry entry;
  entry.key = KeyOf(asked);
  static_cast<KnownLens&>(entry) = solved;
  entry.rms_px = solved.rms_px;
  entry.uncertainty_px = solved.uncertainty.max_px;
  entry.board = WordsOf(solved.board);
  entry.corners = BytesOfViews({solved.board, session.views()});
  if (const double temp_C = link_.temp_C; std::isfinite(temp_C)) entry.temp_C = temp_C;
  entry.utc = UtcNow();
  const double fx_sd = std::sqrt(solved.covariance(kFx, kFx));
  const int decimals = DecimalsFor({fx_sd}, 2);
  sink_({Event::kCalibrated,
         fmt::format("camera: calibrated, f {:.{}f} px +- {:.{}f}, certain to {:.2g} px, {} views",
                     solved.lens.fx, decimals, fx_sd, decimals, solved.uncertainty.max_px,
                     solved.frames_used.size())});
  const auto kept = stores_.lenses.Append(entry);  // if not: it is used until the zoom changes
  WithCore([&](WatchCore& core) {
    core.NoteStoreFault(kept ? "" : kept.error());
    if (kept) core.NoteKept(*kept);
  });
}

}  // namespace plumbline
