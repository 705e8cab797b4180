#include "app/view/carriers.h"

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/scene/loaded_tool.h"

namespace plumbline {
namespace {

constexpr std::uint16_t kRobotUnknown =
    alarm::kRobotMissing | alarm::kRobotStale | alarm::kRobotImplausible | alarm::kDecodingWrong;

bool SameLens(const Lens& a, const Lens& b) {
  return a.fx == b.fx && a.fy == b.fy && a.cx == b.cx && a.cy == b.cy && a.k1 == b.k1 &&
         a.k2 == b.k2 && a.p1 == b.p1 && a.p2 == b.p2 && a.k3 == b.k3;
}

}  // namespace

std::optional<ToolNow> ToolOf(const ViewState& state, const ViewModel& model) {
  const LoadedArm& arm = model.arm;
  if (state.q.size() != arm.size() || !state.q.allFinite() || !state.payload_kg) {
    return std::nullopt;
  }
  const Payload payload{*state.payload_kg, state.payload_cog_F};
  Conditions conditions;
  conditions.payload_kg = payload.mass_kg;
  const CellModel& cell = model.config.machine.cell;
  if (cell.domain && cell.domain->time_zero_s) {
    conditions.t_s = state.utc_s - *cell.domain->time_zero_s;
  }
  conditions.temp_C = state.temp_C;
  LoadedState loaded;
  if (!arm.AtCommanded(state.q, payload, conditions, loaded)) return std::nullopt;

  ToolNow tool;
  tool.bend = BendFieldOf(cell.tool, loaded);
  // An identified offset of the tool's frame seats the whole tool elsewhere: the tip decides.
  const Pose X_FT{RotationFromVector(loaded.slope_F), arm.X_FT().p + loaded.bend_F};
  tool.X_WF = loaded.X_WT * X_FT.Inverse();
  tool.tip_W = loaded.X_WT.p;
  Posture unloaded;
  arm.chain().Evaluate(state.q, unloaded);
  tool.X_WF_nominal = arm.X_WB() * unloaded.X_BF();
  tool.tip_nominal_W = tool.X_WF_nominal * arm.X_FT().p;
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

Carriers CarrierMemory::Take(const ViewState& state, const ViewModel* model, double now_s) {
  const ViewCamera& camera = state.camera;
  Carriers carriers;
  carriers.lens_stale =
      !state.watch.configured || state.watch.state != ZoomState::kValid || !camera.lens;
  carriers.image_stale = !camera.image || now_s - camera.image->time_s > kImageFresh_s;
  carriers.robot_stale = (state.alarms & kRobotUnknown) != 0 || state.q.size() == 0;

  // What was seen through another lens lies elsewhere.
  if (!camera.lens || (lens_ && !SameLens(*lens_, *camera.lens))) {
    world_.reset();
    bodies_.clear();
    tags_.clear();
  }
  lens_ = camera.lens;
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
  // While the image stands, what was in it stands too: greyed, and the image is marked.
  if (!carriers.image_stale) forget(bodies_);
  if (!carriers.image_stale) forget(tags_);
  for (const auto& [name, seen] : bodies_) carriers.bodies[name] = {seen.X_CK, old(seen)};
  for (const auto& [id, seen] : tags_) carriers.tags[id] = {seen.X_CK, old(seen)};

  if (model == nullptr) return carriers;
  carriers.tool = ToolOf(state, *model);
  if (model->config.camera) {
    const TagsConfig& tags = model->config.camera->tags;
    const auto cell = bodies_.find(tags.cell);
    if (cell != bodies_.end()) {
      world_ = Seen{cell->second.X_CK * tags.X_WK.Inverse(), cell->second.time_s};
    }
  }
  if (!world_) return carriers;
  carriers.world = {world_->X_CK, untrusted || now_s - world_->time_s > kForgotten_s};
  carriers.base = {world_->X_CK * model->arm.X_WB(), carriers.world->stale};
  if (carriers.tool) {
    carriers.flange = {world_->X_CK * carriers.tool->X_WF,
                       carriers.world->stale || carriers.robot_stale};
  }
  return carriers;
}

}  // namespace plumbline
