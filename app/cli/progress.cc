#include "app/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <chrono>
#include <cmath>

#include "app/base/terminal/terminal_output.h"
#include "drivers/clock.h"

namespace plumbline::cli {
namespace {

volatile std::sig_atomic_t requested = 0;

void HandleSignal(int) {
  requested = 1;
}

}  // namespace

Interruption::Interruption() {
  requested = 0;
  struct sigaction action {};
  action.sa_handler = &HandleSignal;
  // The second signal has the default effect, in case the work does not poll often enough.
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  sigemptyset(&action.sa_mask);
  sigaction(SIGINT, &action, &old_interrupt_);
  sigaction(SIGTERM, &action, &old_terminate_);
}

bool Interruption::Disarm() {
  struct sigaction ignore {};
  ignore.sa_handler = SIG_IGN;
  sigemptyset(&ignore.sa_mask);
  sigaction(SIGINT, &ignore, nullptr);
  sigaction(SIGTERM, &ignore, nullptr);
  disarmed_ = !Requested();
  return disarmed_;
}

Interruption::~Interruption() {
  if (disarmed_) return;
  sigaction(SIGINT, &old_interrupt_, nullptr);
  sigaction(SIGTERM, &old_terminate_, nullptr);
}

bool Interruption::Requested() {
  return requested != 0;
}

namespace {

constexpr double kQuietPeriod_s = 2;
constexpr double kTerminalQuietPeriod_s = 0.5;  // a quick command must not flicker
constexpr int kLineInterval_percent = 10;
constexpr double kEstimateFrom = 0.05;  // share done; before it the rate is too uncertain

std::string DurationText(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", std::ceil(seconds));
  if (seconds < 5400) return fmt::format("{:.0f} min", std::ceil(seconds / 60));
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace

Progress::Progress(std::ostream& err, Display display)
    : err_(err), display_(std::move(display)), start_s_(0) {
  if (!display_.clock_s) display_.clock_s = MonotonicSeconds;
  start_s_ = display_.clock_s();
  if (display_.columns > 0 && !display_.quiet) updater_ = std::thread([this] { Update(); });
}

Progress::Progress(std::ostream& err, bool quiet)
    : Progress(err, Display{terminal::TerminalColumns(STDERR_FILENO), quiet, 1, {}}) {}

Progress::~Progress() {
  Clear();
  if (updater_.joinable()) updater_.join();
}

void Progress::Show(double share, const std::string& doing) {
  const std::lock_guard lock(mutex_);
  if (display_.quiet || ended_) return;
  const int percent = static_cast<int>(100 * share);
  share_ = share;
  doing_ = doing;
  if (display_.columns > 0) {
    ShowOnTerminal();
    last_percent_ = percent;
    return;
  }
  if (percent / kLineInterval_percent == last_percent_ / kLineInterval_percent &&
      last_percent_ >= 0) {
    return;
  }
  if (display_.clock_s() - start_s_ < kQuietPeriod_s) return;
  err_ << Line() << '\n' << std::flush;
  last_percent_ = percent;
}

void Progress::ShowCount(std::size_t done, std::size_t of, const std::string& things) {
  if (of == 0) return;
  Show(static_cast<double>(done) / static_cast<double>(of),
       fmt::format("{} of {} {}", done, of, things));
}

void Progress::Clear() {
  const std::lock_guard lock(mutex_);
  if (!shown_.empty()) err_ << terminal::ReplacedLine() << std::flush;
  shown_.clear();
  ended_ = true;
  end_.notify_all();
}

std::string Progress::Line() const {
  const double elapsed_s = display_.clock_s() - start_s_;
  std::string line = fmt::format("{:3d} %  {}", static_cast<int>(100 * share_), doing_);
  if (share_ >= kEstimateFrom && share_ < 1) {
    line += fmt::format(", {} left", DurationText(elapsed_s * (1 - share_) / share_));
  }
  return line;
}

void Progress::ShowOnTerminal() {
  if (display_.clock_s() - start_s_ < kTerminalQuietPeriod_s) return;
  // A line as wide as the terminal would leave its end behind when it is erased.
  const std::string line = Line().substr(0, static_cast<std::size_t>(display_.columns - 1));
  if (line == shown_) return;
  err_ << terminal::ReplacedLine() << line << std::flush;
  shown_ = line;
}

void Progress::Update() {
  std::unique_lock lock(mutex_);
  const std::chrono::duration<double> period(display_.update_s);
  while (!end_.wait_for(lock, period, [this] { return ended_; })) {
    if (!doing_.empty()) ShowOnTerminal();
  }
}

}  // namespace plumbline::cli
