#include "app/display/view_process/view_loop.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <csignal>

#include "app/base/config/daemon_config_reader.h"
#include "app/base/log/log.h"
#include "app/base/service/service_manager.h"
#include "app/base/service/signals.h"
#include "app/display/view/screen_text.h"
#include "app/display/view_process/page_host.h"
#include "app/version.h"
#include "drivers/clock.h"

namespace plumbline::display {
namespace {

constexpr double kStateWait_s = 0.05, kScreenWait_s = 0.02;
constexpr double kMaxPictureAge_s = 0.5;  ///< then redrawn without a new state: clocks advance
constexpr double kUnseenPeriod_s = 1.0;   ///< between pictures that nobody sees
constexpr double kSharedPeriod_s = 0.1;   ///< between pictures for the page
constexpr double kStatusPeriod_s = 0.2;   ///< between updates of the page's status
constexpr double kRedrawPeriod_s = 10;    ///< of a picture that does not change
constexpr double kTrimPeriod_s = 3;       ///< between malloc_trim() calls
constexpr image::ImageSize kWithoutDisplay{1280, 720};

const char* KindOf(config::OverlayConfig::Display display) {
  return display == config::OverlayConfig::Display::kKms           ? "kms"
         : display == config::OverlayConfig::Display::kFramebuffer ? "framebuffer"
                                                                   : "none";
}

}  // namespace

ViewLoop::ViewLoop(const std::string& config_file, cell::ViewModel model,
                   display::DisplayMailbox& shown)
    : viewer_(config_file, std::move(model), log::Log),
      drawing_(log::Log),
      alarms_(std::make_unique<AlarmPictures>(viewer_.state_directory() + "/alarms",
                                              AlarmPictureLimits{}, log::Log)),
      shown_(shown) {
  OpenDisplay();
}

void ViewLoop::OpenDisplay() {
  const config::OverlayConfig& config = viewer_.config();
  display::DisplayConnection connection;
  const image::ImageSize size = config.size.value_or(image::ImageSize{0, 0});
  connection.kms.size = size;
  connection.none.size = config.size.value_or(kWithoutDisplay);
  if (!config.device.empty()) {
    connection.kms.card = config.device;
    connection.framebuffer.device = config.device;
  }
  display_.reset();
  on_display_ = false;
  auto made = display::MakeDisplay(KindOf(config.display), connection);
  if (made) {
    display_ = std::move(made).value();
  } else {
    log::Log({log::Event::kDisplayLost, made.error()});
  }
}

void ViewLoop::LogDisplayState(display::DisplayResult result) {
  if (result == display::DisplayResult::kReady || result == display::DisplayResult::kShown) {
    if (!display_problem_.empty())
      log::Log({log::Event::kDisplayBack, "the display shows pictures again"});
    display_problem_.clear();
  } else if (result == display::DisplayResult::kLost) {
    const std::string problem(display_->problem());
    if (problem != display_problem_) log::Log({log::Event::kDisplayLost, problem});
    display_problem_ = problem;
  }
}

bool ViewLoop::on_screen() const {
  return viewer_.config().display != config::OverlayConfig::Display::kNone && display_ &&
         display_problem_.empty();
}

bool ViewLoop::Due(double now_s) const {
  if (on_screen()) return fresh_ || now_s - drawn_s_ >= kMaxPictureAge_s;
  if (!shown_.PictureRequested(now_s)) return now_s - drawn_s_ >= kUnseenPeriod_s;
  return now_s - drawn_s_ >= (fresh_ ? kSharedPeriod_s : kMaxPictureAge_s);
}

void ViewLoop::DrawOne(image::ImageSize size, bool show) {
  const double now_s = MonotonicSeconds();
  drawn_s_ = now_s;
  fresh_ = false;
  if (!drawing_.Ready(now_s)) return;
  const display::ViewFacts& facts = viewer_.Facts();
  const display::PictureLayout layout = display::LayoutFor(facts, size);
  const std::vector<int>& meshes = drawing_.Meshes(viewer_.scene());
  const display::OverlayInput input{facts, viewer_.config(), meshes, viewer_.Pixels(),
                                    viewer_.MeshFacts()};
  const scene::DisplayList list =
      facts.state != nullptr ? display::PictureOf(input, layout, drawing_.text_width())
                             : display::PictureWithoutState(facts, layout, drawing_.text_width());
  const bool same = drawing_.Shows(list) && now_s - rendered_s_ < kRedrawPeriod_s;
  if (!same) {
    on_display_ = shared_ = kept_ = false;
    if (!drawing_.Draw(list)) return;
    rendered_s_ = now_s;
  }
  if (show && !on_display_) {
    const display::DisplayResult result = display_->Show(drawing_.renderer());
    on_display_ = result == display::DisplayResult::kShown;
    LogDisplayState(result);
  }
  if (now_s - trimmed_s_ >= kTrimPeriod_s) {
    if (trimmed_s_ > 0) malloc_trim(0);
    trimmed_s_ = now_s;
  }
  if (shared_) shown_.ConfirmPicture(now_s);
  const bool keep = !kept_ && alarms_->Due(now_s);
  const bool share =
      !shared_ && shown_.PictureRequested(now_s) && now_s - shared_s_ >= kSharedPeriod_s;
  if (!keep && !share) return;
  display::RgbImage picture = drawing_.renderer().ReadBack();
  if (share) {
    shared_ = true;
    shared_s_ = now_s;
    // The page shows everything but the images in its own way.
    const scene::Area& image = layout.image;
    const image::ImageSize part{static_cast<int>(image.width), static_cast<int>(image.height)};
    shown_.Publish(std::make_shared<const display::DisplayPicture>(display::DisplayPicture{
        display::Cropped(picture, static_cast<int>(image.x), static_cast<int>(image.y), part),
        now_s}));
  }
  if (keep) {
    kept_ = true;
    alarms_->Remember(std::move(picture), now_s);
  }
}

/// If drawing takes longer than the camera's frame interval, the newest state may be nearly one
/// frame old when the display is ready. Waiting for the next frame then takes at most half an
/// interval and yields an image that is half to one interval newer.
double ViewLoop::WaitForNextFrame_s(double now_s) const {
  const double interval_s = viewer_.image_interval_s(), age_s = now_s - state().now_s;
  if (!on_screen() || !(interval_s < kStateWait_s)) return 0;
  return age_s > interval_s / 2 && age_s < interval_s ? interval_s - age_s : 0;
}

void ViewLoop::RunOnce() {
  if (viewer_.Read(fresh_ && on_screen() ? 0 : kStateWait_s)) HandleState();
  PublishStatus(MonotonicSeconds());
  const bool due = Due(MonotonicSeconds());
  // A lost display is polled until it is back.
  display::DisplayResult screen = display::DisplayResult::kLost;
  if (display_ && (due || !on_screen())) {
    screen = display_->Wait(kScreenWait_s);
    LogDisplayState(screen);
  }
  if (!due || screen == display::DisplayResult::kBusy) return;
  // A newer state may have arrived while the display was busy.
  if (viewer_.Read(0)) HandleState();
  const double wait_s = WaitForNextFrame_s(MonotonicSeconds());
  if (wait_s > 0 && viewer_.Read(wait_s)) HandleState();
  const bool ready = screen == display::DisplayResult::kReady;
  DrawOne(ready ? display_->size() : viewer_.config().size.value_or(kWithoutDisplay), ready);
}

void ViewLoop::HandleState() {
  fresh_ = true;
  const cell::ViewState& state = viewer_.view().state;
  alarms_->Observe(state.alarms, state.utc_s);
}

void ViewLoop::PublishStatus(double now_s) {
  if (now_s - status_s_ < kStatusPeriod_s) return;
  status_s_ = now_s;
  shown_.Publish(std::make_shared<const display::DisplayStatus>(
      display::MakeDisplayStatus(viewer_.Facts(), drawing_.problem())));
}

void ViewLoop::Reload() {
  viewer_.Reload();
  OpenDisplay();
}

void ConfigureMalloc() {
  constexpr int kOwnPages = 1 << 20;
  mallopt(M_ARENA_MAX, 2);
  mallopt(M_MMAP_THRESHOLD, kOwnPages);
}

int RunView(const std::string& config_file, const std::string& port_file) {
  ConfigureMalloc();
  const int signals = service::OpenSignalDescriptor();
  config::FaultList faults;
  std::optional<cell::ViewModel> model = cell::ReadViewModel(config_file, 0, faults);
  log::LogFaults(faults);
  if (!model) {
    log::Log(
        {log::Event::kNotStarted,
         fmt::format("not started: {} has the faults logged above; fix them and run 'plumbline "
                     "check' to verify",
                     config_file)});
    return 1;
  }
  service::ServiceManager manager;
  display::DisplayMailbox shown;
  PageHost page(shown, manager.TakeSocket("http"), log::Log, port_file);
  const config::DaemonConfig config = model->config;
  ViewLoop loop(config_file, std::move(*model), shown);
  log::Log({log::Event::kViewStarted, fmt::format("plumbline-view {}", PLUMBLINE_VERSION)});
  page.Open(config);
  for (;;) {
    signalfd_siginfo info{};
    if (read(signals, &info, sizeof info) == sizeof info) {
      if (info.ssi_signo != SIGHUP) break;
      loop.Reload();
      config::FaultList ignored;  // already logged by Reload()
      if (const auto fresh = config::ReadDaemonConfig(config_file, ignored)) page.Open(*fresh);
    }
    loop.RunOnce();
    page.Poll(MonotonicSeconds());
    log::FlushLog();
  }
  log::FlushLog(true);
  return 0;
}

}  // namespace plumbline::display
