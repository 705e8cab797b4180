#include "app/cell/model_store/model_change.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>
#include <string>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::cell {
namespace {

constexpr int kPoses = 200;
constexpr double kDifferentArm_m = 0.05;

/// Predicts a cell's loaded tip.
class TipPredictor {
 public:
  explicit TipPredictor(const model::CellModel& cell)
      : cell_(deflection::CellOfPoints(cell)), arm_(cell_) {}

  Result<Vec3> At(const ModelPose& pose) {
    if (arm_.size() != pose.q.size()) return Error{"the models do not have the same joints"};
    if (arm_.torques_missing())
      return Error{"joints are compliant, but link masses are not declared"};
    loads::Payload payload{cell_.payload_cog_F ? pose.payload_kg : 0.0,
                           cell_.payload_cog_F.value_or(Vec3::Zero())};
    if (pose.tool >= arm_.tools()) return Error{"the models do not have the same tools"};
    payload.tool = pose.tool;
    effects::Conditions conditions;
    conditions.payload_kg = pose.payload_kg;
    conditions.t_s = pose.t_s;
    conditions.temp_C = pose.temp_C;
    if (!arm_.AtCommanded(pose.q, payload, conditions, state_))
      return Error{"the deflected posture does not converge"};
    return state_.p_read_W;
  }

 private:
  const model::CellModel cell_;
  const deflection::LoadedArm arm_;
  deflection::LoadedState state_;
};

}  // namespace

Result<double> LargestTipChange(const model::CellModel& from, const model::CellModel& to,
                                const std::vector<ModelPose>& poses) {
  TipPredictor tips_before(from), tips_after(to);
  double largest_m = 0;
  for (const ModelPose& pose : poses) {
    const Result<Vec3> before = tips_before.At(pose);
    if (!before) return before.failure();
    const Result<Vec3> after = tips_after.At(pose);
    if (!after) return after.failure();
    largest_m = std::max(largest_m, (*after - *before).norm());
  }
  return largest_m;
}

std::vector<ModelPose> PosesWithinLimits(const model::CellModel& cell) {
  std::minstd_rand random(1);
  std::vector<ModelPose> poses(kPoses);
  for (ModelPose& pose : poses) {
    pose.tool = static_cast<int>(&pose - poses.data()) % cell.tools();
    pose.q.resize(cell.robot.size());
    for (int i = 0; i < cell.robot.size(); ++i) {
      const model::Joint& joint = cell.robot.joints[static_cast<std::size_t>(i)];
      const double range = joint.type == model::JointType::kPrismatic ? 1 : std::numbers::pi;
      const double low = std::isfinite(joint.min) ? joint.min : -range;
      const double high = std::isfinite(joint.max) ? joint.max : range;
      pose.q[i] = low + (high - low) * std::generate_canonical<double, 32>(random);
    }
  }
  return poses;
}

std::optional<std::string> DifferentArmReason(const model::CellModel& from,
                                              const model::CellModel& to) {
  if (from.robot.size() != to.robot.size()) {
    return fmt::format("it has {} joints, the model in force {}", to.robot.size(),
                       from.robot.size());
  }
  for (int i = 0; i < from.robot.size(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (from.robot.joints[at].type != to.robot.joints[at].type) {
      return fmt::format("its joint {} is of another type than in the model in force", i + 1);
    }
  }
  const kinematics::Chain before(from.robot), after(to.robot);
  kinematics::Posture posture_before, posture_after;
  double largest_m = 0;
  for (const ModelPose& pose : PosesWithinLimits(from)) {
    before.Evaluate(pose.q, posture_before);
    after.Evaluate(pose.q, posture_after);
    largest_m = std::max(largest_m, (posture_after.X_BF().p - posture_before.X_BF().p).norm());
  }
  if (largest_m < kDifferentArm_m) return std::nullopt;
  return fmt::format("its flange is up to {:.0f} mm from that of the model in force",
                     1e3 * largest_m);
}

}  // namespace plumbline::cell
