#include "app/cell/daemon/gauge_worker.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "drivers/clock.h"

namespace plumbline::cell {
namespace {

constexpr double kWait_s = 0.05;         // for one gauge
constexpr double kMaxCyclesWait_s = 1;   // for the control cycle to handle a press
constexpr double kMaxJournalWait_s = 1;  // for its row to be written
/// Nobody presses a button at intervals as regular as this [s, and as a share], four times in a
/// row.
constexpr double kRegular_s = 1, kRegularShare = 0.05;
constexpr std::size_t kRegularIntervals = 4;

/// The number of an artefact in the cell's list, from 1; 0: there is none of that name.
std::uint16_t ArtefactNumber(const model::CellModel& cell, const std::string& name) {
  const auto found =
      std::find_if(cell.artefacts.begin(), cell.artefacts.end(),
                   [&name](const model::Artefact& artefact) { return artefact.name == name; });
  if (found == cell.artefacts.end()) return 0;
  return static_cast<std::uint16_t>(found - cell.artefacts.begin() + 1);
}

const char* RemedyFor(correction::CorrectionCode code) {
  switch (code) {
    case correction::CorrectionCode::kRobotMoving:
      return "keep the robot at standstill for 0.2 s, then press the button";
    case correction::CorrectionCode::kNotRecorded:
      return "set enabled = true in [monitoring], or wait until the journal keeps up";
    case correction::CorrectionCode::kPending:
      return "the journal is being opened: press the button again";
    case correction::CorrectionCode::kBadCommand:
      return "a gauge reads at most 500 mm: check its unit, and its [[artefact]] in the cell";
    default:
      return "see `plumbline status`, then press the button again";
  }
}

}  // namespace

GaugeWorker::GaugeWorker(GaugeMailbox& mailbox, log::LogSink sink)
    : mailbox_(mailbox), sink_(std::move(sink)) {}

void GaugeWorker::Start(const config::DaemonConfig& config) {
  config_ = config;
  gauges_.clear();
  for (const config::GaugeConfig& one : config.gauges) {
    gauges_.push_back(
        {one, ArtefactNumber(config.machine.cell, one.artefact), gauge::Gauge(one.connection)});
    status::GaugeStatus& status = gauges_.back().status;
    status.state = status::GaugeState::kConnecting;
    status.artefact = gauges_.back().artefact;
    status.since_s = MonotonicSeconds();
    const std::string_view name = status::CutToSize(one.artefact, status.name.size());
    std::copy(name.begin(), name.end(), status.name.begin());
  }
  PublishStatus();
  if (gauges_.empty()) return;
  stop_ = false;
  thread_ = std::thread([this] { Run(); });
}

void GaugeWorker::Stop() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  // Withdraws a press that was not handled: another cell may have another artefact of that number.
  mailbox_.press.Begin() = {};
  mailbox_.press.Publish();
}

std::uint64_t GaugeWorker::beats() const {
  return thread_.joinable() ? heartbeat_.beats() : static_cast<std::uint64_t>(MonotonicSeconds());
}

void GaugeWorker::Run() {
  while (!stop_) {
    heartbeat_.Beat();
    const double start_s = MonotonicSeconds();
    for (ReadGauge& gauge : gauges_) ReadOnce(gauge);
    // Gauges that are not connected return at once.
    SleepSeconds(std::max(0.0, kWait_s - (MonotonicSeconds() - start_s)));
  }
}

void GaugeWorker::SetState(ReadGauge& gauge) {
  using enum status::GaugeState;
  const bool connected = gauge.device.connected();
  gauge.connected_once = gauge.connected_once || connected;
  const status::GaugeState state = connected              ? kConnected
                                   : gauge.connected_once ? kReconnecting
                                                          : kConnecting;
  if (state == gauge.status.state) return;
  gauge.status.state = state;
  gauge.status.since_s = MonotonicSeconds();
  PublishStatus();
}

void GaugeWorker::PublishStatus() {
  status::GaugeStatuses& all = mailbox_.status.Begin();
  all = {};
  for (std::size_t k = 0; k < std::min(gauges_.size(), all.size()); ++k) all[k] = gauges_[k].status;
  mailbox_.status.Publish();
}

void GaugeWorker::ReadOnce(ReadGauge& gauge) {
  double reading_m = 0;
  const gauge::GaugeResult result =
      gauge.device.Read(kWait_s / static_cast<double>(gauges_.size()), reading_m);
  SetState(gauge);
  FollowAwaited(gauge);
  if (gauge.device.connected() && gauge.lost) {
    gauge.lost = false;
    sink_({log::Event::kGaugeBack,
           fmt::format("gauge {} is connected again", gauge.config.artefact)});
  }
  const auto refuse = [&](status::GaugeOutcome outcome) {
    gauge.latest = 0;
    Refuse(gauge, outcome, fmt::format("not recorded: {}", gauge.device.problem()));
  };
  switch (result) {
    case gauge::GaugeResult::kReading:
      Record(gauge, reading_m);
      break;
    case gauge::GaugeResult::kFault:
      refuse(status::GaugeOutcome::kFault);
      break;
    case gauge::GaugeResult::kUnreadable:
      refuse(status::GaugeOutcome::kUnreadable);
      break;
    case gauge::GaugeResult::kLost:
      if (gauge.lost) break;
      gauge.lost = true;
      sink_({log::Event::kGaugeLost,
             fmt::format("gauge {}: {}", gauge.config.artefact, gauge.device.problem())});
      break;
    case gauge::GaugeResult::kNothing:
    case gauge::GaugeResult::kWaiting:
      break;
  }
}

void GaugeWorker::SetOutcome(ReadGauge& gauge, status::GaugeOutcome outcome) {
  gauge.status.outcome = outcome;
  PublishStatus();
}

void GaugeWorker::Refuse(ReadGauge& gauge, status::GaugeOutcome outcome, const std::string& text) {
  sink_({log::Event::kGaugeRefused, fmt::format("gauge {}: {}", gauge.config.artefact, text)});
  SetOutcome(gauge, outcome);  // its reason is already in the log
}

void GaugeWorker::Record(ReadGauge& gauge, double reading_m) {
  gauge.latest = 0;
  const double now_s = MonotonicSeconds();
  gauge.status.reading_m = reading_m;
  gauge.status.reading_s = now_s;
  if (IsContinuous(gauge, now_s)) {
    if (std::exchange(gauge.continuous, true)) return PublishStatus();
    return Refuse(
        gauge, status::GaugeOutcome::kContinuous,
        fmt::format(
            "it sends every {:.2f} s, which is no press: not recorded while this lasts. Its latest "
            "{} rows in the journal may be such readings. Set it to send when its button is "
            "pressed",
            gauge.intervals_s.back(), kRegularIntervals));
  }
  if (std::exchange(gauge.continuous, false)) {
    sink_({log::Event::kGaugeBack,
           fmt::format("gauge {}: single readings again, recorded from here on",
                       gauge.config.artefact)});
  }
  mailbox_.press.Begin() = {++number_, gauge.artefact, reading_m, now_s, gauge.config.sigma_m};
  mailbox_.press.Publish();
  const std::optional<correction::CorrectionCode> code = CodeOf(number_);
  const std::string reading = fmt::format("{:.4f} mm", 1e3 * reading_m);
  if (code == correction::CorrectionCode::kOk) return Await(gauge, reading);
  if (code) {
    const auto outcome = static_cast<status::GaugeOutcome>(
        static_cast<unsigned>(status::GaugeOutcome::kRefused) + static_cast<unsigned>(*code));
    Refuse(gauge, outcome,
           fmt::format("{} not recorded: {}; {}", reading, correction::Describe(*code),
                       RemedyFor(*code)));
  } else if (!stop_) {
    Refuse(gauge, status::GaugeOutcome::kNoAnswer,
           reading +
               " not recorded: the control cycle did not answer in time; press the button again");
  }
}

/// Follows an accepted press into the journal: an accepted row may still be lost.
void GaugeWorker::Await(ReadGauge& gauge, const std::string& reading) {
  gauge.awaited.push_back({number_, reading});
  gauge.latest = number_;
  const double until_s = MonotonicSeconds() + kMaxJournalWait_s;
  while (!stop_ && MonotonicSeconds() < until_s && mailbox_.taken < number_) {
    heartbeat_.Beat();
    SleepSeconds(0.005);
  }
  FollowAwaited(gauge);
  if (gauge.awaited.empty() || stop_) return;
  Refuse(gauge, status::GaugeOutcome::kWaiting,
         reading +
             " not in the journal yet: it is written as soon as the journal can be; see "
             "`plumbline log --level warning`");
}

void GaugeWorker::FollowAwaited(ReadGauge& gauge) {
  const std::uint32_t taken = mailbox_.taken, dropped = mailbox_.dropped;
  std::size_t known = 0;
  for (; known < gauge.awaited.size() && gauge.awaited[known].number <= taken; ++known) {
    const AwaitedPress& press = gauge.awaited[known];
    if (press.number > dropped) {
      sink_({log::Event::kGaugeRecorded,
             fmt::format("gauge {}: {} recorded", gauge.config.artefact, press.reading)});
      if (press.number == gauge.latest) SetOutcome(gauge, status::GaugeOutcome::kRecorded);
      continue;
    }
    Refuse(gauge, status::GaugeOutcome::kNotKept,
           press.reading +
               " not recorded: monitoring was switched off or the arm was changed meanwhile; press "
               "the button again");
  }
  gauge.awaited.erase(gauge.awaited.begin(),
                      gauge.awaited.begin() + static_cast<std::ptrdiff_t>(known));
}

/// Adds a reading to the history; true if the latest intervals are too regular for presses.
bool GaugeWorker::IsContinuous(ReadGauge& gauge, double now_s) {
  std::vector<double>& intervals_s = gauge.intervals_s;
  intervals_s.push_back(now_s - std::exchange(gauge.last_reading_s, now_s));
  if (intervals_s.size() > kRegularIntervals) intervals_s.erase(intervals_s.begin());
  if (intervals_s.size() < kRegularIntervals) return false;
  const auto [least, most] = std::minmax_element(intervals_s.begin(), intervals_s.end());
  return *most < kRegular_s && *most - *least < std::max(kRegularShare * *most, kWait_s);
}

std::optional<correction::CorrectionCode> GaugeWorker::CodeOf(std::uint32_t number) {
  const double until_s = MonotonicSeconds() + kMaxCyclesWait_s;
  while (!stop_ && MonotonicSeconds() < until_s) {
    heartbeat_.Beat();
    const std::uint64_t handled = mailbox_.handled;
    if (handled >> 8U == number) return static_cast<correction::CorrectionCode>(handled & 0xFFU);
    SleepSeconds(0.005);
  }
  return std::nullopt;
}

bool GaugesDiffer(const config::DaemonConfig& a, const config::DaemonConfig& b) {
  if (a.gauges != b.gauges) return true;
  return std::any_of(a.gauges.begin(), a.gauges.end(), [&](const config::GaugeConfig& gauge) {
    return ArtefactNumber(a.machine.cell, gauge.artefact) !=
           ArtefactNumber(b.machine.cell, gauge.artefact);
  });
}

}  // namespace plumbline::cell
