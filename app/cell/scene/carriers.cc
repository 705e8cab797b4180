#include "app/cell/scene/carriers.h"

#include <fmt/format.h>

#include <filesystem>

#include "app/base/config/daemon_config_reader.h"
#include "app/cell/model_store/model_store.h"
#include "drivers/files/text_file.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/lens/known_lens.h"
#include "firmware-like/scene/loaded_tool.h"

namespace plumbline::cell {
namespace {

constexpr std::uint16_t kRobotUnknown =
    alarm::kRobotMissing | alarm::kRobotStale | alarm::kRobotImplausible | alarm::kDecodingWrong;

}  // namespace

std::optional<ViewModel> ReadViewModel(const std::string& path, int version,
                                       config::FaultList& faults) {
  std::optional<config::DaemonConfig> config = config::ReadDaemonConfig(path, faults);
  if (!config) return std::nullopt;
  if (version > 0) {
    const std::string file = ModelStore::ModelFile(config->state_directory, version);
    const config::FileSource files = [&](const std::string& name) {
      return files::ReadTextFile(name == config->cell_file ? file : name);
    };
    const Result<std::string> text = files::ReadTextFile(path);
    config::FaultList own;
    std::optional<config::DaemonConfig> applied;
    if (text) applied = config::DaemonConfigFromText(*text, path, files, own);
    if (!applied) {
      faults.Append(own);
      faults.Add({config::Fault::Severity::kFault, file, 0, "",
                  fmt::format("model version {} is in force but cannot be read; the tool and the "
                              "assembly points are not drawn",
                              version)});
      return std::nullopt;
    }
    config = std::move(applied);
  }
  deflection::LoadedArm arm(config->machine.cell);
  return ViewModel{std::move(*config), std::move(arm), version};
}

std::optional<ToolState> ComputeToolState(const ViewState& state, const ViewModel& model) {
  const deflection::LoadedArm& arm = model.arm;
  if (state.q.size() != arm.size() || !state.q.allFinite() || !state.payload_kg ||
      state.tool >= arm.tools()) {
    return std::nullopt;
  }
  const loads::Payload payload{*state.payload_kg, state.payload_cog_F, state.tool};
  effects::Conditions conditions;
  conditions.payload_kg = payload.mass_kg;
  const model::CellModel& cell = model.config.machine.cell;
  if (cell.domain && cell.domain->time_zero_s) {
    conditions.t_s = state.utc_s - *cell.domain->time_zero_s;
  }
  conditions.temp_C = state.temp_C;
  // Noise is not drawn: only a resolved displacement by the motion bends the tool and the joints.
  const ViewMotion& motion = state.motion;
  const bool dynamic = motion.resolved() && motion.sag.size() == state.q.size();
  const model::JointVector q = dynamic ? model::JointVector(state.q + motion.sag) : state.q;
  deflection::LoadedState loaded;
  if (!arm.AtCommanded(q, payload, conditions, loaded)) return std::nullopt;

  ToolState tool;
  const scene::BendField still = scene::BendFieldOf(cell.ToolAt(state.tool), loaded);
  tool.bend = dynamic ? scene::BendFieldOf(cell.ToolAt(state.tool), loaded,
                                           {motion.acceleration_F, motion.angular_acceleration_F})
                      : still;
  // An identified offset of the tool frame shifts the whole tool: the tip determines the flange.
  const Pose X_FT{RotationFromVector(loaded.slope_F), arm.X_FT(state.tool).p + loaded.bend_F};
  tool.X_WF = loaded.X_WT * X_FT.Inverse();
  const Vec3 end_F(0, 0, still.length_m);
  const Vec3 lag_F = scene::BentPoint(tool.bend, end_F) - scene::BentPoint(still, end_F);
  tool.tip_W = loaded.X_WT.p + tool.X_WF.R * lag_F;
  kinematics::Posture unloaded;
  arm.chain().Evaluate(state.q, unloaded);
  tool.X_WF_nominal = arm.X_WB() * unloaded.X_BF();
  for (int i = 0; i < loaded.posture.size; ++i)
    tool.links_W.push_back(arm.X_WB() * loaded.posture.X_BL[static_cast<std::size_t>(i)]);
  tool.tip_nominal_W = tool.X_WF_nominal * arm.X_FT(state.tool).p;
  return tool;
}

const PlacedCarrier* Carriers::Find(const Carrier& carrier) const {
  const auto of = [](const std::optional<PlacedCarrier>& placed) {
    return placed ? &*placed : nullptr;
  };
  switch (carrier.kind) {
    case Carrier::Kind::kWorld:
      return of(world);
    case Carrier::Kind::kBase:
      return of(base);
    case Carrier::Kind::kLink: {
      const auto k = static_cast<std::size_t>(carrier.link - 1);
      return k < links.size() ? &links[k] : nullptr;
    }
    case Carrier::Kind::kFlange:
      return of(flange);
    case Carrier::Kind::kBody: {
      const auto found = bodies.find(carrier.body);
      return found == bodies.end() ? nullptr : &found->second;
    }
    case Carrier::Kind::kTag: {
      const auto found = tags.find(carrier.tag);
      return found == tags.end() ? nullptr : &found->second;
    }
  }
  return nullptr;
}

std::optional<Pose> Carriers::InWorld(const Carrier& carrier) const {
  if (carrier.kind == Carrier::Kind::kWorld) return Pose{};
  if (carrier.kind == Carrier::Kind::kFlange) {
    return tool && !robot_stale ? std::optional(tool->X_WF) : std::nullopt;
  }
  const PlacedCarrier* const placed = Find(carrier);
  if (placed == nullptr || !world || placed->stale || world->stale) return std::nullopt;
  return world->X_CK.Inverse() * placed->X_CK;
}

Carriers CarrierTracker::Update(const ViewState& state, std::size_t camera_number,
                                const ViewModel* model, double now_s) {
  const ViewCamera& camera = CameraOf(state, camera_number);
  Carriers carriers;
  // What a silent daemon reported last holds for neither lens nor robot.
  const bool old_state = now_s - state.now_s > kStateOld_s;
  carriers.lens_stale = old_state || !camera.status.configured ||
                        camera.status.state != lens::ZoomState::kValid || !camera.lens;
  carriers.image_stale = !camera.image || now_s - camera.image->time_s > kImageFresh_s;
  carriers.robot_stale = old_state || (state.alarms & kRobotUnknown) != 0 || state.q.size() == 0;

  // Poses estimated with another lens are not comparable.
  if (!camera.lens || (lens_ && *lens_ != *camera.lens)) {
    world_.reset();
    bodies_.clear();
    tags_.clear();
  }
  lens_ = camera.lens;
  carriers.focal_px = lens_ ? lens_->fx : 0;
  const double seen_s = camera.image ? camera.image->time_s : now_s;
  if (lens_) {
    for (const ViewTag& tag : camera.tags) {
      if (tag.X_CM && !tag.ambiguous) tags_[tag.id] = {*tag.X_CM, seen_s};
    }
    for (const ViewBody& body : camera.bodies) {
      if (!body.ambiguous) bodies_[body.name] = {body.X_CK, seen_s};
    }
  }
  const bool untrusted = carriers.lens_stale || carriers.image_stale;
  const auto old = [&](const Seen& seen) { return untrusted || now_s - seen.time_s > kFresh_s; };
  const auto forget = [&](auto& seen) {
    std::erase_if(seen, [&](const auto& one) { return now_s - one.second.time_s > kForgotten_s; });
  };
  // A frozen image keeps its carriers, drawn grey; the image itself is marked as stale.
  if (!carriers.image_stale) forget(bodies_);
  if (!carriers.image_stale) forget(tags_);
  for (const auto& [name, seen] : bodies_) carriers.bodies[name] = {seen.X_CK, old(seen)};
  for (const auto& [id, seen] : tags_) carriers.tags[id] = {seen.X_CK, old(seen)};

  if (model == nullptr) return carriers;
  carriers.tool = ComputeToolState(state, *model);
  if (const config::VisionConfig& vision = model->config.vision; !vision.cameras.empty()) {
    const config::TagsConfig& tags = vision.tags;
    const auto cell = bodies_.find(tags.cell);
    if (cell != bodies_.end()) {
      world_ = Seen{cell->second.X_CK * tags.X_WK.Inverse(), cell->second.time_s};
    }
  }
  if (!world_) return carriers;
  carriers.world = {world_->X_CK, untrusted || now_s - world_->time_s > kForgotten_s};
  carriers.PlaceArm(*model);
  return carriers;
}

void Carriers::PlaceArm(const ViewModel& model) {
  const Pose& X_CW = world->X_CK;
  base = {X_CW * model.arm.X_WB(), world->stale};
  if (!tool) return;
  const bool arm_stale = world->stale || robot_stale;
  flange = {X_CW * tool->X_WF, arm_stale};
  links.clear();
  for (const Pose& X_WL : tool->links_W) links.push_back({X_CW * X_WL, arm_stale});
}

Carriers MergeInMeasurementFrame(std::span<const Carriers> cameras) {
  Carriers merged;
  merged.tool = cameras.front().tool;
  merged.robot_stale = cameras.front().robot_stale;
  std::map<std::string, double> body_px_per_m;
  std::map<int, double> tag_px_per_m;
  for (const Carriers& camera : cameras) {
    if (!camera.world || camera.world->stale) continue;
    const Pose X_WC = camera.world->X_CK.Inverse();
    const auto add = [&](const auto& seen, auto& best, auto& places) {
      for (const auto& [name, placed] : seen) {
        const double px_per_m = camera.focal_px / placed.X_CK.p.z();
        if (placed.stale || px_per_m <= best[name]) continue;
        best[name] = px_per_m;
        places[name] = {X_WC * placed.X_CK, false};
      }
    };
    add(camera.bodies, body_px_per_m, merged.bodies);
    add(camera.tags, tag_px_per_m, merged.tags);
    merged.world = PlacedCarrier{};
    if (camera.base) merged.base = {X_WC * camera.base->X_CK, camera.base->stale};
    if (camera.flange) merged.flange = {X_WC * camera.flange->X_CK, camera.flange->stale};
    merged.links.clear();
    for (const PlacedCarrier& link : camera.links)
      merged.links.push_back({X_WC * link.X_CK, link.stale});
  }
  return merged;
}

void ShareDetections(std::span<Carriers> cameras) {
  // Share only the cameras' own detections, not what they received.
  const std::vector<Carriers> own(cameras.begin(), cameras.end());
  for (std::size_t a = 0; a < own.size(); ++a) {
    for (std::size_t b = 0; b < own.size(); ++b) {
      const auto &to = own[a].world, &from = own[b].world;
      if (a == b || !to || !from || to->stale || from->stale) continue;
      const Pose X_AB = to->X_CK * from->X_CK.Inverse();
      const auto take = [&](const auto& seen, auto& places) {
        for (const auto& [name, placed] : seen) {
          const auto here = places.find(name);
          const bool missed = here == places.end() || here->second.stale;
          if (missed && !placed.stale) places[name] = {X_AB * placed.X_CK, false};
        }
      };
      take(own[b].bodies, cameras[a].bodies);
      take(own[b].tags, cameras[a].tags);
    }
  }
}

}  // namespace plumbline::cell
