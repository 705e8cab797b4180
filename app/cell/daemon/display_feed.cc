#include "app/cell/daemon/display_feed.h"

#include <algorithm>

#include "app/base/config/carried_numbers.h"
#include "app/base/log/log.h"
#include "app/base/service/utc_clock.h"
#include "app/version.h"
#include "drivers/clock.h"

namespace plumbline::cell {
namespace {

constexpr double kPeriodWithoutImages_s = 0.15;

ViewCamera SeenBy(const camera::Camera& camera, const vision::TrackedFrame& seen,
                  const lens::KnownLens* lens) {
  ViewCamera view;
  view.serial = camera.identity().serial;
  view.mode = camera.identity().mode;
  if (lens != nullptr) {
    view.lens = lens->lens;
    if (!UsableEverywhere(*lens)) view.usable_radius_px = lens->usable_radius_px;
  }
  for (const vision::TrackedTag& tag : seen.tags) {
    ViewTag shown;
    shown.id = tag.seen.id;
    std::copy_n(tag.seen.corners_px.begin(), shown.corners_px.size(), shown.corners_px.begin());
    if (tag.estimate) shown.X_CM = tag.estimate->X_CK;
    shown.ambiguous = tag.ambiguous;
    view.tags.push_back(shown);
  }
  for (const vision::SeenBody& body : seen.bodies) {
    view.bodies.push_back({body.body->name, body.estimate.X_CK, body.ambiguous});
  }
  return view;
}

/// Copies everything but the points.
void CopySnapshot(const Snapshot& snapshot, const model::CellModel& cell, ViewState& state) {
  state.status = snapshot.status;
  state.alarms = snapshot.alarms;
  state.warnings = snapshot.warnings;
  state.health = snapshot.health;
  state.data_age_s = snapshot.data_age_s;
  state.q = snapshot.robot.q;
  const motion::DynamicDeflection& dynamic = snapshot.motion.deflection;
  state.motion = {
      snapshot.motion.state,  snapshot.motion.age_s,          dynamic.sag,
      dynamic.acceleration_F, dynamic.angular_acceleration_F, dynamic.tip_acceleration_W.norm(),
      dynamic.tip_W,          snapshot.motion.radius_m};
  state.payload_kg.reset();
  state.payload_cog_F.setZero();
  state.tool = 0;
  if (snapshot.payload_valid) {
    state.payload_kg = snapshot.payload.mass_kg;
    state.payload_cog_F = snapshot.payload.cog_F;
    state.tool = snapshot.payload.tool;
  }
  const config::NumberAdvice advice = config::AdviceOn(snapshot.undeclared, cell);
  state.payload_problem = advice.problem;
  state.payload_remedy = advice.remedy;
  state.temp_C = snapshot.robot.temp_C;
}

}  // namespace

DisplayFeed::DisplayFeed(std::unique_ptr<ViewPublisher> publisher, CycleMailboxes& mailboxes,
                         std::size_t cameras)
    : publisher_(std::move(publisher)), mailboxes_(mailboxes), cameras_(cameras) {}

void DisplayFeed::Configure(const config::DaemonConfig& config) {
  const std::lock_guard lock(mutex_);
  cell_ = config.machine.cell;
  point_ids_.clear();
  point_changes_.reset();
  for (const correction::AssemblyPoint& point : config.machine.points)
    point_ids_.push_back(point.id);
}

void DisplayFeed::Reopen(const std::function<std::unique_ptr<ViewPublisher>()>& open) {
  const std::lock_guard lock(mutex_);
  if (!publisher_) publisher_ = open();
}

void DisplayFeed::Start(const ControlCycle& cycle) {
  const std::lock_guard lock(mutex_);
  cycle_ = &cycle;
  start_s_ = MonotonicSeconds();
}

bool DisplayFeed::HasViewers() {
  const bool has_viewers = publisher_->PollViewers();
  if (const auto& scene = publisher_->scene(); scene && scene->time_s != scene_s_) {
    scene_s_ = scene->time_s;
    mailboxes_.scene.Begin() = *scene;
    mailboxes_.scene.Publish();
  }
  return has_viewers;
}

void DisplayFeed::PublishImage(std::size_t k, camera::Camera& camera,
                               const camera::CameraFrame& frame, const vision::TrackedFrame& seen,
                               const lens::KnownLens* lens) {
  const std::lock_guard lock(mutex_);
  if (!publisher_ || cycle_ == nullptr || !HasViewers()) return;
  const std::vector<std::uint8_t>* const bgr = camera.Bgr();
  const int memory = publisher_->memory_number();
  auto image = publisher_->Share(k, frame.luma, bgr != nullptr ? bgr->data() : nullptr);
  if (publisher_->memory_number() != memory) {
    for (ViewCamera& other : cameras_) other.image.reset();
  }
  if (image) {
    image->time_s = frame.time_s;
    image->sequence = frame.sequence;
  }
  cameras_[k] = SeenBy(camera, seen, lens);
  cameras_[k].image = image;
  Send();
}

void DisplayFeed::NoteLink(const robot::RobotLinkStatus& link) {
  const bool lost = !link.connected && link.failures > 0;
  state_.robot_problem = lost ? link.problem.view() : "";
  state_.robot_remedy = lost ? robot::LinkRemedy(link.result) : "";
}

void DisplayFeed::PublishIfDue() {
  const std::lock_guard lock(mutex_);
  if (!publisher_ || cycle_ == nullptr) return;
  NoteLink(cycle_->parts().link->Status());
  if (MonotonicSeconds() - sent_s_ < kPeriodWithoutImages_s || !HasViewers()) return;
  Send();
}

void DisplayFeed::CopyPoints(const Snapshot& snapshot) {
  point_changes_ = snapshot.point_changes;
  ++state_.points_number;
  state_.points.clear();
  const std::size_t points = std::min(snapshot.points.size(), point_ids_.size());
  for (std::size_t i = 0; i < points; ++i) {
    const PointResult& point = snapshot.points[i];
    state_.points.push_back({point_ids_[i], point.valid, point.correction.extrapolated, point.code,
                             point.correction.X_BP_command, point.correction.translation_B,
                             point.correction.uncertainty_m, point.correction.basis,
                             point.correction.q, point.posture.taught, point.posture.differs});
  }
}

void DisplayFeed::Send() {
  ViewState& state = state_;
  state.now_s = sent_s_ = MonotonicSeconds();
  state.utc_s = service::SystemUtcSeconds();
  state.version = PLUMBLINE_VERSION;
  state.cell = cell_.robot.name;
  {
    const auto snapshot = cycle_->ReadSnapshot();
    CopySnapshot(*snapshot, cell_, state);
    if (point_changes_ != snapshot->point_changes) CopyPoints(*snapshot);
  }
  const CycleCounters counters = cycle_->counters();
  state.cycle = {state.now_s - start_s_, counters.longest_cycle_s, counters.cycles,
                 counters.overruns, counters.starts};
  state.monitoring = *mailboxes_.monitoring.Read();
  state.model_version = state.monitoring.model.applied;
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    cameras_[k].status = *mailboxes_.cameras[k].status.Read();
  }
  state.cameras = cameras_;
  state.lines.clear();
  for (const log::LogLine& line : log::RecentLog()) {
    state.lines.push_back({line.number, line.utc_s, static_cast<int>(line.level), line.text});
  }
  publisher_->Send(state);
}

}  // namespace plumbline::cell
