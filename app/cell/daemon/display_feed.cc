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
                  const lens::KnownLens* lens, const lens::BoardGuidance* guidance) {
  ViewCamera view;
  if (guidance != nullptr) view.guidance = *guidance;
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
    : publisher_(std::move(publisher)),
      mailboxes_(mailboxes),
      cameras_(cameras),
      trackers_(std::max<std::size_t>(1, cameras)) {}

void DisplayFeed::Configure(const ConfigInForce& in_force) {
  const std::lock_guard lock(mutex_);
  const config::DaemonConfig& config = in_force.config;
  state_.generation = in_force.generation;
  state_.model_version = in_force.models.applied;
  const config::OverlayConfig& overlay = config.overlay;
  const bool same_objects = model_ && model_->config.overlay.objects_file == overlay.objects_file &&
                            model_->config.overlay.near_m == overlay.near_m;
  model_.emplace(ViewModel{config, deflection::LoadedArm(config.machine.cell)});
  if (!same_objects) {
    if (scene_) scene_->End(), ending_.push_back(std::move(scene_));
    measured_.reset();
    if (overlay.objects_file.empty()) {
      PublishSceneStatus(
          {});  // nothing is monitored; otherwise the old status ages until it is lost
    } else {
      const bool tags_known = !config.vision.cameras.empty();
      scene_ = std::make_unique<SceneWorker>(
          overlay.objects_file,
          tags_known ? std::optional(config.vision.tags.database) : std::nullopt, overlay.near_m,
          log::Log);
    }
  }
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

void DisplayFeed::PublishImage(std::size_t k, camera::Camera& camera,
                               const camera::CameraFrame& frame, const vision::TrackedFrame& seen,
                               const lens::KnownLens* lens, const lens::BoardGuidance* guidance) {
  const std::lock_guard lock(mutex_);
  const bool has_viewers = HasViewers();
  if (!Needed(has_viewers)) return;
  ViewImage image;  // not shared
  if (has_viewers) {
    const std::vector<std::uint8_t>* const bgr = camera.Bgr();
    const int memory = publisher_->memory_number();
    const auto shared = publisher_->Share(k, frame.luma, bgr != nullptr ? bgr->data() : nullptr);
    if (shared) image = *shared;
    if (publisher_->memory_number() != memory) {
      for (ViewCamera& other : cameras_) {
        if (other.image) other.image->stamp = 0;
      }
    }
  }
  image.time_s = frame.time_s;
  image.sequence = frame.sequence;
  cameras_[k] = SeenBy(camera, seen, lens, guidance);
  cameras_[k].image = image;
  Send(has_viewers);
}

void DisplayFeed::NoteLink(const robot::RobotLinkStatus& link) {
  const bool lost = !link.connected && link.failures > 0;
  state_.robot_problem = lost ? link.problem.view() : "";
  state_.robot_remedy = lost ? robot::LinkRemedy(link.result) : "";
}

void DisplayFeed::PublishIfDue() {
  const std::lock_guard lock(mutex_);
  if (cycle_ == nullptr) return;
  NoteLink(cycle_->parts().link->Status());
  NoteMeasured();
  std::erase_if(ending_, [](const auto& old) { return old->ended(); });
  if (MonotonicSeconds() - sent_s_ < kPeriodWithoutImages_s) return;
  if (const bool has_viewers = HasViewers(); Needed(has_viewers)) Send(has_viewers);
}

void DisplayFeed::NoteMeasured() {
  std::shared_ptr<const SceneMeasurements> newest = scene_ ? scene_->Newest() : nullptr;
  if (!newest || newest == measured_) return;
  measured_ = std::move(newest);
  if (measured_->pairs.empty()) return;
  status::SceneStatus status = SceneStatusOf(*measured_);
  status.time_s = MonotonicSeconds();
  PublishSceneStatus(status);
}

void DisplayFeed::PublishSceneStatus(const status::SceneStatus& status) {
  mailboxes_.scene.Begin() = status;
  mailboxes_.scene.Publish();
}

void DisplayFeed::MeasureIn(ViewState& state) {
  std::vector<Carriers> carriers;
  for (std::size_t k = 0; k < trackers_.size(); ++k) {
    carriers.push_back(trackers_[k].Update(state, k, &*model_, state.now_s));
  }
  Carriers merged = MergeInMeasurementFrame(carriers);
  merged.world =
      PlacedCarrier{};  // the arm's place is declared, whether a camera sees the cell or not
  merged.PlaceArm(*model_);
  scene_->Submit({state.now_s, std::move(merged)});
  NoteMeasured();
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

void DisplayFeed::Send(bool has_viewers) {
  ViewState& state = state_;
  state.now_s = sent_s_ = MonotonicSeconds();
  state.utc_s = service::SystemUtcSeconds();
  state.version = PLUMBLINE_VERSION;
  const model::CellModel& cell = model_->config.machine.cell;
  state.cell = cell.robot.name;
  {
    const auto snapshot = cycle_->ReadSnapshot();
    CopySnapshot(*snapshot, cell, state);
    if (point_changes_ != snapshot->point_changes) CopyPoints(*snapshot);
  }
  const CycleCounters counters = cycle_->counters();
  state.cycle = {state.now_s - start_s_, counters.longest_cycle_s, counters.cycles,
                 counters.overruns, counters.starts};
  state.monitoring = *mailboxes_.monitoring.Read();
  for (std::size_t k = 0; k < cameras_.size(); ++k) {
    cameras_[k].status = *mailboxes_.cameras[k].status.Read();
  }
  state.cameras = cameras_;
  if (scene_) MeasureIn(state);
  state.scene.reset();
  if (measured_) state.scene = *measured_;
  if (!has_viewers) return;
  for (ViewCamera& camera : state.cameras) {
    if (camera.image && camera.image->stamp == 0) camera.image.reset();
  }
  state.lines.clear();
  for (const log::LogLine& line : log::RecentLog()) {
    state.lines.push_back({line.number, line.utc_s, static_cast<int>(line.level), line.text});
  }
  publisher_->Send(state);
}

}  // namespace plumbline::cell
