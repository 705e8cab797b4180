#include "app/model_store/model_change.h"

#include <algorithm>

#include "firmware-like/deflection/loaded_arm.h"

namespace plumbline {
namespace {

Result<Vec3> TipOf(const CellModel& cell, const ModelPose& pose) {
  const LoadedArm arm(CellOfSession(cell, pose.session));
  if (arm.size() != pose.q.size()) return Error{"the models have not the same joints"};
  if (arm.torques_missing()) return Error{"joints yield, but link masses are not declared"};
  const Payload payload{cell.payload_cog_F ? pose.payload_kg : 0.0,
                        cell.payload_cog_F.value_or(Vec3::Zero())};
  LoadedState state;
  Conditions conditions;
  conditions.payload_kg = pose.payload_kg;
  conditions.t_s = pose.t_s;
  conditions.temp_C = pose.temp_C;
  if (!arm.AtCommanded(pose.q, payload, conditions, state))
    return Error{"the sagged posture does not settle"};
  return state.p_read_W;
}

}  // namespace

Result<double> LargestChange(const CellModel& from, const CellModel& to,
                             const std::vector<ModelPose>& poses) {
  double largest_m = 0;
  for (const ModelPose& pose : poses) {
    const Result<Vec3> before = TipOf(from, pose);
    if (!before) return Error{before.error()};
    const Result<Vec3> after = TipOf(to, pose);
    if (!after) return Error{after.error()};
    largest_m = std::max(largest_m, (*after - *before).norm());
  }
  return largest_m;
}

}  // namespace plumbline
