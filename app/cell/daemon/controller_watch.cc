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
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::cell {
namespace {

using Verdict = measure::Identification::Verdict;

constexpr std::size_t kEnough = 10, kEnoughNew = 3;
constexpr double kPause_s = 60;  // between two identifications
constexpr int kIdentifyingNice = 19;

bool SameArm(const model::CellModel& a, const model::CellModel& b) {
  return a.robot.joints.size() == b.robot.joints.size() && a.robot.name == b.robot.name;
}

}  // namespace

void ControllerWatch::Configure(const config::DaemonConfig& config) {
  const bool same = cell_ && SameArm(*cell_, config.machine.cell);
  Abandon();  // its result belongs to the previous cell
  cell_ = config.machine.cell;
  measure::ControllerSample sample;
  measure::StepsOf(config.robot.connection.profile, sample);
  if (!same) collector_.Clear();
  sample_ = sample;
  new_postures_ = collector_.postures().size();
  last_s_ = 0;
  difference_reported_ = answered_ = false;
  reported_.clear();
}

void ControllerWatch::Abandon() {
  if (!running_.valid()) return;
  stop_.request_stop();
  running_.wait();
  running_ = {};
  stop_ = {};
}

void ControllerWatch::Observe(const Snapshot& snapshot) {
  if (!cell_) return;
  Collect(snapshot);
  if (running_.valid() && running_.wait_for(std::chrono::seconds(0)) == std::future_status::ready) {
    const Result<Found> found = running_.get();
    answered_ = true;
    if (found) Take(*found);
  }
  StartIfDue(snapshot.now_s);
}

void ControllerWatch::Collect(const Snapshot& snapshot) {
  // A contradiction of the pose is what the identification explains.
  if (snapshot.input_fault != InputFault::kOk && snapshot.input_fault != InputFault::kTcpMismatch)
    return;
  auto posture = filter_.Observe(snapshot.reading);
  if (!posture || posture->q.size() != cell_->robot.size()) return;
  if (snapshot.payload_valid) posture->payload = snapshot.payload;
  const int tool = loads::ToolIndexOf(*cell_, snapshot.reading.tool_number).value_or(0);
  if (tool != sample_.tool) {  // a sample has one tool
    collector_.Clear();
    sample_.tool = tool;
  }
  sample_.joint_step = snapshot.reading.q_resolution;
  sample_.of_flange = snapshot.reading.tcp_is_flange;
  sample_.X_FT.reset();
  if (!sample_.of_flange) sample_.X_FT = snapshot.reading.X_FT;
  if (!collector_.Add(*posture)) return;
  ++new_postures_;
  ReportFirstDifference();
}

void ControllerWatch::ReportFirstDifference() {
  if (difference_reported_) return;
  measure::ControllerSample sample = sample_;
  sample.postures = collector_.postures();
  const measure::RelationContext context(*cell_);
  const auto difference = measure::UnexplainedDifference(context, sample);
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
  if (running_.valid() || collector_.postures().size() < kEnough || new_postures_ < kEnoughNew)
    return;
  if (last_s_ > 0 && now_s - last_s_ < kPause_s) return;
  last_s_ = now_s;
  new_postures_ = 0;
  measure::ControllerSample sample = sample_;
  sample.postures = collector_.postures();
  running_ = RunOnThread<Found>([cell = *cell_, sample = std::move(sample),
                                 stop = stop_.get_token()] {
    setpriority(PRIO_PROCESS, 0, kIdentifyingNice);  // of this thread
    const measure::RelationContext context(cell);
    Found found;
    found.identification = measure::Identify(
        context, sample, [&stop](double, const std::string&) { return !stop.stop_requested(); });
    found.finding = measure::FindingText(found.identification, context);
    found.remedy = measure::FindingRemedy(found.identification, context, sample);
    found.twice = measure::CompensatedTwice(cell, found.identification);
    return found;
  });
}

void ControllerWatch::Take(const Found& found) {
  const measure::Identification& identification = found.identification;
  const Verdict verdict = identification.verdict;
  if (verdict == Verdict::kTooFew) return;
  // What is not clear changes nothing: neither an alarm nor its end.
  if (verdict == Verdict::kNotClear) return;
  if (verdict == Verdict::kNamed) twice_ = found.twice;
  const std::string kind = verdict == Verdict::kNone
                               ? "none"
                               : measure::NameOf(identification.best.hypothesis.front().kind);
  if (kind == reported_) return;
  const bool first = reported_.empty();
  reported_ = kind;
  if (identification.IsNominal()) {
    if (!first) {
      sink_({log::Event::kControllerAgrees,
             "the controller's tool pose is that of the cell's table "
             "again"});
    }
    return;
  }
  const log::Event event = twice_                      ? log::Event::kCompensatedTwice
                           : verdict == Verdict::kNone ? log::Event::kControllerUnexplained
                                                       : log::Event::kControllerModel;
  sink_({event,
         fmt::format("{}{}, in {} postures. {}", found.finding,
                     twice_ ? ", which this cell corrects as well: corrected twice" : "",
                     identification.postures, found.remedy),
         {{"RELATION", kind}}});
}

}  // namespace plumbline::cell
