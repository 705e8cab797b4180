#include "app/view_process/view_loop.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>

#include "app/config/daemon_config_reader.h"
#include "app/log/fault_log.h"
#include "app/log/log.h"
#include "app/service/service_manager.h"
#include "app/service/signals.h"
#include "app/version.h"
#include "app/view/screen_text.h"
#include "app/view_process/page_side.h"
#include "drivers/clock.h"

namespace plumbline {
namespace {

constexpr double kStateWait_s = 0.05, kScreenWait_s = 0.02;
constexpr double kOldest_s = 0.5;    ///< a picture on a screen: ages and clocks go on
constexpr double kUnseen_s = 1.0;    ///< from picture to picture where nobody looks
constexpr double kShared_s = 0.1;    ///< from picture to picture for who looks from elsewhere
constexpr double kTold_s = 0.2;      ///< from word to word for them
constexpr double kTrimPeriod_s = 3;  ///< what compiled shaders and pictures left behind
constexpr ImageSize kWithoutDisplay{1280, 720};

const char* KindOf(OverlayConfig::Display display) {
  return display == OverlayConfig::Display::kKms           ? "kms"
         : display == OverlayConfig::Display::kFramebuffer ? "framebuffer"
                                                           : "none";
}

}  // namespace

ViewLoop::ViewLoop(const std::string& config_file, ViewModel model, Shown& shown)
    : viewer_(config_file, std::move(model), Log),
      drawing_(Log),
      alarms_(std::make_unique<AlarmPictures>(viewer_.state_directory() + "/alarms",
                                              AlarmPictureLimits{}, Log)),
      shown_(shown) {
  OpenDisplay();
}

void ViewLoop::OpenDisplay() {
  const OverlayConfig& config = viewer_.config();
  DisplayConnection connection;
  const ImageSize size = config.size.value_or(ImageSize{0, 0});
  connection.kms.size = size;
  connection.none.size = config.size.value_or(kWithoutDisplay);
  if (!config.device.empty()) {
    connection.kms.card = config.device;
    connection.framebuffer.device = config.device;
  }
  display_.reset();
  auto made = MakeDisplay(KindOf(config.display), connection);
  if (made) {
    display_ = std::move(made).value();
  } else {
    Log({Event::kDisplayLost, made.error()});
  }
}

void ViewLoop::TellDisplay(DisplayResult result) {
  if (result == DisplayResult::kReady || result == DisplayResult::kShown) {
    if (!display_problem_.empty()) Log({Event::kDisplayBack, "the display shows pictures again"});
    display_problem_.clear();
  } else if (result == DisplayResult::kLost) {
    const std::string problem(display_->problem());
    if (problem != display_problem_) Log({Event::kDisplayLost, problem});
    display_problem_ = problem;
  }
}

bool ViewLoop::on_screen() const {
  return viewer_.config().display != OverlayConfig::Display::kNone && display_ &&
         display_problem_.empty();
}

bool ViewLoop::Due(double now_s) const {
  if (on_screen()) return fresh_ || now_s - drawn_s_ >= kOldest_s;
  if (!shown_.Asked(now_s)) return now_s - drawn_s_ >= kUnseen_s;
  return now_s - drawn_s_ >= (fresh_ ? kShared_s : kOldest_s);
}

void ViewLoop::DrawOne(ImageSize size, bool show) {
  const double now_s = MonotonicSeconds();
  drawn_s_ = now_s;
  fresh_ = false;
  if (!drawing_.Ready(now_s)) return;
  const ViewFacts& facts = viewer_.Facts();
  const PictureLayout layout = LayoutOf(size);
  const std::vector<int>& meshes = drawing_.Meshes(viewer_.scene());
  const OverlayInput input{facts, viewer_.config(), meshes, viewer_.Pixels()};
  const bool drawn = drawing_.Draw(facts.state != nullptr
                                       ? PictureOf(input, layout, drawing_.text_width())
                                       : PictureWithoutState(facts, layout, drawing_.text_width()));
  if (!drawn) return;
  if (show) TellDisplay(display_->Show(drawing_.renderer()));
  if (now_s - trimmed_s_ >= kTrimPeriod_s) {
    if (trimmed_s_ > 0) malloc_trim(0);
    trimmed_s_ = now_s;
  }
  const bool keep = alarms_->Due(now_s);
  const bool share = shown_.Asked(now_s) && now_s - shared_s_ >= kShared_s;
  if (!keep && !share) return;
  RgbImage picture = drawing_.renderer().ReadBack();
  if (share) {
    shared_s_ = now_s;
    shown_.Put(std::make_shared<const ShownPicture>(ShownPicture{picture, now_s}));
  }
  if (keep) alarms_->Remember(std::move(picture), now_s);
}

/// Where drawing takes longer than the camera from frame to frame, the newest state may be nearly
/// as old as a frame when the screen is ready. A picture of the next one costs at most half a frame
/// of waiting, and shows what is half a frame to a whole one newer.
double ViewLoop::PatienceForNext_s(double now_s) const {
  const double interval_s = viewer_.image_interval_s(), age_s = now_s - state().now_s;
  if (!on_screen() || !(interval_s < kStateWait_s)) return 0;
  return age_s > interval_s / 2 && age_s < interval_s ? interval_s - age_s : 0;
}

void ViewLoop::Round() {
  if (viewer_.Read(fresh_ && on_screen() ? 0 : kStateWait_s)) TakeState();
  TellShown(MonotonicSeconds());
  const bool due = Due(MonotonicSeconds());
  // One that is lost is asked whether it is there again.
  DisplayResult screen = DisplayResult::kLost;
  if (display_ && (due || !on_screen())) {
    screen = display_->Wait(kScreenWait_s);
    TellDisplay(screen);
  }
  if (!due || screen == DisplayResult::kBusy) return;
  // What came while the screen was busy is newer.
  if (viewer_.Read(0)) TakeState();
  const double patience_s = PatienceForNext_s(MonotonicSeconds());
  if (patience_s > 0 && viewer_.Read(patience_s)) TakeState();
  const bool ready = screen == DisplayResult::kReady;
  DrawOne(ready ? display_->size() : viewer_.config().size.value_or(kWithoutDisplay), ready);
}

void ViewLoop::TakeState() {
  fresh_ = true;
  const ViewState& state = viewer_.view().state;
  alarms_->Observe(state.alarms, state.utc_s);
}

void ViewLoop::TellShown(double now_s) {
  if (now_s - told_s_ < kTold_s) return;
  told_s_ = now_s;
  shown_.Put(std::make_shared<const ShownNow>(ShownOf(viewer_.Facts(), drawing_.problem())));
}

void ViewLoop::Reload() {
  viewer_.Reload();
  OpenDisplay();
}

void KeepHeapSmall() {
  constexpr int kOwnPages = 1 << 20;
  mallopt(M_ARENA_MAX, 2);
  mallopt(M_MMAP_THRESHOLD, kOwnPages);
}

int RunView(const std::string& config_file) {
  KeepHeapSmall();
  const int signals = OpenSignals();
  FaultList faults;
  std::optional<ViewModel> model = ReadViewModel(config_file, 0, faults);
  LogFaults(faults);
  if (!model) {
    Log({Event::kNotStarted,
         fmt::format("not started: mend {} first (plumbline check tells the same)", config_file)});
    return 1;
  }
  ServiceManager manager;
  Shown shown;
  PageSide page(shown, manager.TakeSocket("http"), Log);
  const DaemonConfig config = model->config;
  ViewLoop loop(config_file, std::move(*model), shown);
  Log({Event::kViewStarted, fmt::format("plumbline-view {}", PLUMBLINE_VERSION)});
  page.Open(config);
  for (;;) {
    signalfd_siginfo info{};
    if (read(signals, &info, sizeof info) == sizeof info) {
      if (info.ssi_signo != SIGHUP) break;
      loop.Reload();
      FaultList ignored;  // Reload() told them
      if (const auto fresh = ReadDaemonConfig(config_file, ignored)) page.Open(*fresh);
    }
    loop.Round();
    page.Round(MonotonicSeconds());
    LogRepeats();
  }
  LogRepeats(true);
  return 0;
}

}  // namespace plumbline
