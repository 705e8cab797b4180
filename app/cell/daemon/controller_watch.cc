#include "app/cell/daemon/controller_watch.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <utility>

#include "app/base/config/model_fingerprint.h"
#include "app/cell/daemon/reload.h"
#include "app/measure/controller/relation_text.h"
#include "app/measure/controller/reported_steps.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::cell {
namespace {

using Verdict = measure::Identification::Verdict;

constexpr std::size_t kEnough = 10, kEnoughNew = 3;
constexpr double kPause_s = 60;  // between two identifications
constexpr int kIdentifyingNice = 19;

constexpr double kOldest_s = 8 * 3600;  // of a posture: one shift
constexpr double kLost_s = 2;           // between two readings
constexpr double kCheckPeriod_s = 1;

template <typename T>
bool Ended(const std::future<T>& future) {
  return future.valid() && future.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
}

bool SameArm(const model::CellModel& a, const model::CellModel& b) {
  return a.robot.joints.size() == b.robot.joints.size() && a.robot.name == b.robot.name;
}

}  // namespace

void ControllerWatch::Configure(const config::DaemonConfig& config) {
  const bool same = context_ && SameArm(context_->cell, config.machine.cell);
  Abandon();  // its result belongs to the previous cell
  context_ = std::make_unique<const measure::RelationContext>(config.machine.cell);
  measure::ControllerSample sample;
  measure::StepsOf(config.robot.connection.profile, sample);
  if (!same) collector_.Clear();
  sample_ = sample;
  named_.reset();
  new_postures_ = collector_.postures().size();
  last_s_ = 0;
  difference_reported_ = answered_ = differs_ = false;
  reported_.clear();
}

void ControllerWatch::Abandon() {
  if (!running_.valid()) return;
  stop_.request_stop();
  abandoned_ = std::move(running_);  // at most one: none starts before the abandoned one has ended
  stop_ = {};
}

void ControllerWatch::StartAnew() {
  Abandon();
  collector_.Clear();
  named_.reset();
  new_postures_ = 0;
  last_s_ = 0;
  reported_.clear();
}

void ControllerWatch::Observe(const Snapshot& snapshot) {
  if (!context_) return;
  Collect(snapshot);
  if (Ended(running_)) {
    const Result<Found> found = running_.get();
    answered_ = true;
    if (found) Take(*found);
  }
  if (Ended(abandoned_)) abandoned_ = {};
  StartIfDue(snapshot.now_s);
}

void ControllerWatch::Collect(const Snapshot& snapshot) {
  const model::RobotState& reading = snapshot.reading;
  if (reading.sequence != 0) {
    const bool lost = last_reading_s_ > 0 && reading.timestamp_s - last_reading_s_ > kLost_s;
    if (lost) StartAnew();  // the controller may have been restarted
    last_reading_s_ = reading.timestamp_s;
  }
  // A contradiction of the pose is what the identification explains.
  if (snapshot.input_fault != InputFault::kOk && snapshot.input_fault != InputFault::kTcpMismatch)
    return;
  auto posture = filter_.Observe(reading, context_->cell);
  if (!posture || posture->q.size() != context_->cell.robot.size()) return;
  if (snapshot.payload_valid) posture->payload = snapshot.payload;
  sample_.joint_step = reading.q_resolution;
  if (ContradictsNamed(*posture)) StartAnew();
  collector_.Expire(reading.timestamp_s - kOldest_s);
  if (!collector_.Add(*posture)) return;
  ++new_postures_;
  ReportFirstDifference();
}

bool ControllerWatch::ContradictsNamed(const measure::ControllerPosture& posture) {
  const double now_s = posture.t_s.value_or(0);
  if (!named_ || now_s - checked_s_ < kCheckPeriod_s) return false;
  checked_s_ = now_s;
  return measure::Contradicts(*context_, named_->sample, named_->fit, posture);
}

void ControllerWatch::ReportFirstDifference() {
  if (difference_reported_) return;
  measure::ControllerSample sample = sample_;
  sample.postures = collector_.postures();
  const auto difference = measure::UnexplainedDifference(*context_, sample);
  if (!difference) return;
  difference_reported_ = true;
  sink_({log::Event::kControllerPoseDiffers,
         fmt::format("the controller's tool pose is {:.3f} mm and {:.4f} deg from the cell's rigid "
                     "table, more than its resolution explains. The relation is named once the "
                     "robot has been at standstill in {} postures; or run plumbline "
                     "identify-controller",
                     kMmPerMetre * difference->distance_m, kDegPerRad * difference->angle_rad,
                     kEnough)});
}

void ControllerWatch::StartIfDue(double now_s) {
  if (running_.valid() || abandoned_.valid() || collector_.postures().size() < kEnough ||
      new_postures_ < kEnoughNew)
    return;
  if (last_s_ > 0 && now_s - last_s_ < kPause_s) return;
  last_s_ = now_s;
  new_postures_ = 0;
  measure::ControllerSample sample = sample_;
  sample.postures = collector_.postures();
  running_ = RunOnThread<Found>([cell = context_->cell, sample = std::move(sample),
                                 stop = stop_.get_token()] {
    setpriority(PRIO_PROCESS, 0, kIdentifyingNice);  // of this thread
    const measure::RelationContext context(cell);
    Found found;
    found.identification = measure::Identify(
        context, sample, [&stop](double, const std::string&) { return !stop.stop_requested(); });
    found.finding = measure::FindingText(found.identification, context);
    found.remedy = measure::FindingRemedy(found.identification, context, sample);
    found.twice = measure::CompensatedTwice(context, sample, found.identification);
    found.sample = sample;
    return found;
  });
}

void ControllerWatch::Take(const Found& found) {
  const measure::Identification& identification = found.identification;
  const Verdict verdict = identification.verdict;
  if (verdict == Verdict::kTooFew) return;
  // What is not clear changes nothing: neither an alarm nor its end.
  if (verdict == Verdict::kNotClear) return;
  twice_ = verdict == Verdict::kNamed && found.twice;
  named_.reset();
  if (verdict == Verdict::kNamed) named_ = Named{found.sample, identification.best};
  const std::string relations =
      verdict == Verdict::kNone ? "none" : measure::RelationNames(identification.best.hypothesis);
  const std::string finding = twice_ ? relations + ", twice" : relations;
  if (finding == reported_) return;
  reported_ = finding;
  if (identification.IsNominal()) {
    if (differs_) {
      sink_({log::Event::kControllerAgrees,
             "the controller's tool pose is that of the cell's table again"});
    }
    differs_ = difference_reported_ = false;
    return;
  }
  differs_ = true;
  const log::Event event = twice_                      ? log::Event::kCompensatedTwice
                           : verdict == Verdict::kNone ? log::Event::kControllerUnexplained
                                                       : log::Event::kControllerModel;
  sink_({event,
         fmt::format("{}{}, in {} postures. {}", found.finding,
                     twice_ ? ", which this cell corrects as well: corrected twice" : "",
                     identification.postures, found.remedy),
         {{"RELATION", relations}}});
}

}  // namespace plumbline::cell
