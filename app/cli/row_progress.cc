#include "app/cli/row_progress.h"

#include <fmt/format.h>

#include <cmath>

namespace plumbline::cli {
namespace {

constexpr double kQuietPeriod_s = 2;
constexpr int kLineInterval_percent = 10;
constexpr double kEstimateFrom = 0.05;  // share of the rows; before it the rate is too uncertain

std::string TimeText(double seconds) {
  if (seconds < 90) return fmt::format("{:.0f} s", std::ceil(seconds));
  if (seconds < 5400) return fmt::format("{:.0f} min", std::ceil(seconds / 60));
  return fmt::format("{:.1f} h", seconds / 3600);
}

}  // namespace

void RowProgress::Show(std::size_t done, std::size_t of, double elapsed_s) {
  if (of == 0) return;
  const double share = static_cast<double>(done) / static_cast<double>(of);
  const int percent = static_cast<int>(100 * share);
  if (percent == last_percent_) return;
  if (!on_terminal_ && (elapsed_s < kQuietPeriod_s ||
                        percent / kLineInterval_percent == last_percent_ / kLineInterval_percent)) {
    return;
  }
  const std::string left =
      share < kEstimateFrom ? "" : ", " + TimeText(elapsed_s * (1 - share) / share) + " left";
  const std::string line = fmt::format("{:3d} %  {} of {} {}{}", percent, done, of, rows_, left);
  if (on_terminal_) {
    err_ << "\r\033[K" << line << std::flush;
  } else {
    err_ << line << '\n' << std::flush;
  }
  last_percent_ = percent;
}

void RowProgress::Clear() {
  if (on_terminal_ && last_percent_ >= 0) err_ << "\r\033[K" << std::flush;
}

}  // namespace plumbline::cli
