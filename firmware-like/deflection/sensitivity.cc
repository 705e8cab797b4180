#include "firmware-like/deflection/sensitivity.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "firmware-like/deflection/equations.h"

namespace plumbline::deflection {
namespace {

using I = effects::Influence<double>;
/// Wide enough for the joints of most arms, if every wanted entry has a closed form.
using NarrowDual = ceres::Jet<double, 8>;
using Square =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, model::kMaxJoints, model::kMaxJoints>;

/// Joint entries that act only through the deflection s; the tip depends on them only via the
/// posture.
constexpr int kSagEntries = I::kTorque + 1;
static_assert(I::kTurn == 0 && I::kLengthA == kSagEntries, "the entries of the sag come first");

/// d sag / d entry for one joint: derivative of the sum in LoadedArm::Equations.
/// @param tau  measured or computed torque [N m]
double SagDerivative(int kind, double compliance, double added_torque, double tau) {
  switch (kind) {
    case I::kTurn:
      return 1;
    case I::kCompliance:
      return tau + added_torque;
    case I::kHardening:
      return -tau * tau * tau;
    case I::kLoadGap:
      return tau > 0 ? 1 : tau < 0 ? -1 : 0;
    case I::kLoadShare:
      return std::abs(tau);
    default:  // kTorque
      return compliance;
  }
}

/// True for an entry that does not affect the posture; see AddReadingEntries.
bool ActsOnReadingOnly(int entry) {
  return (entry >= I::kBase && entry < I::kBaseRollPitchYaw) || entry >= I::kTip;
}

/// True for an entry whose derivative has a closed form: structural deflection of a joint, tilt of
/// the base, and the errors of ranges, which do not affect a position.
bool HasClosedForm(int entry) {
  return (entry >= I::kBearing * model::kMaxJoints && entry < I::kFirst) ||
         (entry >= I::kBaseTilt && entry < I::kTip) || entry >= I::kRangeZero;
}

bool WantsStructure(const InfluenceSet& wanted) {
  for (int entry = I::kBearing * model::kMaxJoints; entry < I::kFirst; ++entry) {
    if (wanted[entry]) return true;
  }
  return false;
}

/// The wanted entries, plus those required by their closed forms.
InfluenceSet WithIngredients(const LoadedArm& arm, const InfluenceSet& wanted) {
  InfluenceSet all = wanted;
  const bool tilts = wanted[I::kBaseTilt] || wanted[I::kBaseTilt + 1];
  for (std::size_t axis = 0; axis < 2 && tilts; ++axis) all.set(I::kGravityTurnX + axis);
  const bool moves = arm.read_by_camera() && (tilts || WantsStructure(wanted));
  for (std::size_t axis = 0; axis < 3 && moves; ++axis) all.set(I::kBase + axis);
  return all;
}

/// The wanted entries that need dual numbers, in ascending order.
int DualEntries(const LoadedArm& arm, const InfluenceSet& wanted,
                std::array<int, I::kSize>& entries) {
  int count = 0;
  for (int entry = 0; entry < I::kSize; ++entry) {
    const bool of_joint = entry < I::kJointEntries * model::kMaxJoints;
    if (entry < kSagEntries * model::kMaxJoints) continue;
    if (of_joint && entry % model::kMaxJoints >= arm.size()) continue;
    if (HasClosedForm(entry) || (!arm.read_by_camera() && ActsOnReadingOnly(entry))) continue;
    if (wanted[entry]) entries[count++] = entry;
  }
  return count;
}

/// Factor by which an instrument other than a camera enlarges the reported position.
double Enlargement(const LoadedArm& arm, const effects::Influence<double>& influence) {
  return arm.read_by_range() ? 1 : 1 + influence[I::kScale];
}

/// Closed forms without a measuring camera: p = (1 + scale) (p_WB + R_WB (... + R_BF tip)); scale
/// is 0 for ranges.
void AddReadingEntries(const LoadedArm& arm, const effects::Influence<double>& influence,
                       const InfluenceSet& wanted, Sensitivity& sensitivity) {
  const double enlarged = Enlargement(arm, influence);
  const LoadedStateOf<double>& state = sensitivity.state;
  const Mat3 R_WF = state.X_WT.R * SmallRotation<double>(state.slope_F).transpose();
  for (int axis = 0; axis < 3; ++axis) {
    if (wanted[I::kBase + axis]) sensitivity.dp.col(I::kBase + axis)[axis] = enlarged;
    if (wanted[I::kTip + axis]) sensitivity.dp.col(I::kTip + axis) = enlarged * R_WF.col(axis);
  }
  if (wanted[I::kScale] && !arm.read_by_range()) sensitivity.dp.col(I::kScale) = state.X_WT.p;
}

/// d (reported position) / d (position of the tip).
Mat3 ReadingPerPlace(const LoadedArm& arm, const effects::Influence<double>& influence,
                     const Sensitivity& sensitivity) {
  if (arm.read_by_camera()) return sensitivity.dp.middleCols<3>(I::kBase);
  return Enlargement(arm, influence) * Mat3::Identity();
}

/// Derivative of the rotation R, as a rotation vector, with respect to one variable of the dual
/// numbers.
template <typename T>
Vec3 RotationDerivative(const Mat3Of<T>& R, int variable) {
  Mat3 value, change;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      value(i, j) = R(i, j).a;
      change(i, j) = R(i, j).v[variable];
    }
  }
  const Mat3 turn = change * value.transpose();
  return 0.5 * Vec3(turn(2, 1) - turn(1, 2), turn(0, 2) - turn(2, 0), turn(1, 0) - turn(0, 1));
}

/// A tilt rotates the arm rigidly, while gravity rotates the opposite way in B; first order.
void AddTiltEntries(const LoadedArm& arm, const effects::Influence<double>& influence,
                    const InfluenceSet& wanted, Sensitivity& sensitivity) {
  const Mat3 reading = ReadingPerPlace(arm, influence, sensitivity);
  const Vec3 arm_W = sensitivity.state.X_WT.p - arm.X_WB().p - influence.Vector(I::kBase);
  for (int axis = 0; axis < 2; ++axis) {
    if (!wanted[I::kBaseTilt + axis]) continue;
    sensitivity.dp.col(I::kBaseTilt + axis) =
        reading * Vec3::Unit(axis).cross(arm_W) - sensitivity.dp.col(I::kGravityTurnX + axis);
    sensitivity.dr.col(I::kBaseTilt + axis) =
        Vec3::Unit(axis) - sensitivity.dr.col(I::kGravityTurnX + axis);
  }
}

/// Each structural deflection moves the tip rigidly; the motion is then rotated by the structure
/// further inboard, by the lean and by the base.
void AddStructureEntries(const LoadedArm& arm, const model::JointVector& theta,
                         const effects::Influence<double>& influence, const InfluenceSet& wanted,
                         Sensitivity& sensitivity) {
  constexpr std::size_t kMost = model::kMaxJoints * kStructureEntries.size();
  const LoadedStateOf<double>& state = sensitivity.state;
  const Pose& X_BF = state.posture.X_BF();
  Mat3 R_BT = X_BF.R * SmallRotation<double>(state.slope_F);
  Vec3 p_B =
      X_BF * Vec3(arm.X_FT(state.tool.payload.tool).p + influence.Vector(I::kTip) + state.bend_F);
  loads::OutboardMassesOf<double> outboard;
  model::JointVector tau;
  const Vec3 g_B = X_BF.R * state.tool.g_F;
  arm.loads().Torques(state.posture, g_B, state.tool.payload, tau, &outboard);
  Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, kMost> columns(3, kMost), turns(3, kMost);
  std::array<int, kMost> entries{};
  int count = 0;
  const model::JointVector axes = arm.chain().AxisPositions<double>(theta);
  for (int i = arm.size() - 1; i >= 0; --i) {
    const auto motions =
        StructureMotions<double>(arm.chain(), state.posture, outboard, g_B, i, axes[i]);
    for (std::size_t k = 0; k < motions.size(); ++k) {
      const double size = influence.Joint(kStructureEntries[k], i);
      const Mat3 R = SmallRotation<double>(size * motions[k].turn);
      const Vec3 lever = R * (p_B - motions[k].centre);
      if (size != 0) {
        columns.leftCols(count) = (R * columns.leftCols(count)).eval();
        turns.leftCols(count) = (R * turns.leftCols(count)).eval();
      }
      entries[count] = kStructureEntries[k] * model::kMaxJoints + i;
      columns.col(count) = motions[k].turn.cross(lever) + motions[k].shift;
      turns.col(count++) = motions[k].turn;
      p_B = motions[k].centre + lever + size * motions[k].shift;
      R_BT = R * R_BT;
    }
  }
  // Lean and base rotate everything: from R_BT to R_WT.
  const Mat3 R_WB = state.X_WT.R * R_BT.transpose();
  const Mat3 outwards = ReadingPerPlace(arm, influence, sensitivity) * R_WB;
  for (int k = 0; k < count; ++k) {
    const int entry = entries[k];
    if (!wanted[entry]) continue;
    sensitivity.dp.col(entry) = outwards * columns.col(k);
    sensitivity.dr.col(entry) = R_WB * turns.col(k);
  }
}

/// Adds the entries with closed forms, and clears entries that were only their ingredients.
void AddClosedForms(const LoadedArm& arm, const model::JointVector& theta,
                    const effects::Influence<double>& influence, const InfluenceSet& wanted,
                    const InfluenceSet& ingredients, Sensitivity& sensitivity) {
  if (WantsStructure(wanted)) AddStructureEntries(arm, theta, influence, wanted, sensitivity);
  AddTiltEntries(arm, influence, wanted, sensitivity);
  for (int entry = 0; entry < I::kSize; ++entry) {
    const auto at = static_cast<std::size_t>(entry);
    if (!ingredients[at] || wanted[at]) continue;
    sensitivity.dp.col(entry).setZero();
    sensitivity.dr.col(entry).setZero();
  }
}

/// Partial derivatives of tip and deflection, combined by the implicit function theorem.
struct PartialDerivatives {
  Eigen::Matrix<double, 3, model::kMaxJoints> p_theta, r_theta;
  Square s_theta;
  Eigen::Matrix<double, model::kMaxJoints, I::kSize> s_x =
      Eigen::Matrix<double, model::kMaxJoints, I::kSize>::Zero();
};

/// Derivatives with respect to theta and to `entries` by dual numbers of type T, processed in
/// batches of T's width. The derivatives of the tip with respect to the entries are stored in
/// `sensitivity`.
template <typename T>
void Differentiate(const LoadedArm& arm, const model::JointVector& theta,
                   const loads::Payload& payload, const effects::Influence<double>& influence,
                   const model::JointVector& measured_tau, std::span<const int> entries,
                   bool with_turn, PartialDerivatives& partial, Sensitivity& sensitivity) {
  constexpr int kWidth = T::DIMENSION;
  const int n = arm.size();
  const int variables = n + static_cast<int>(entries.size());
  const loads::PayloadOf<T> load{T(payload.mass_kg), payload.cog_F.cast<T>(), payload.tool};
  LoadedStateOf<T> state;
  for (int first = 0; first < variables; first += kWidth) {
    model::JointVectorOf<T> theta_dual = theta.cast<T>();
    effects::Influence<T> influence_dual;
    for (int k = 0; k < I::kSize; ++k) influence_dual[k].a = influence[k];
    const int count = std::min(kWidth, variables - first);
    for (int k = 0; k < count; ++k) {
      const int variable = first + k;
      if (variable < n) {
        theta_dual[variable].v[k] = 1;
      } else {
        influence_dual[entries[variable - n]].v[k] = 1;
      }
    }
    arm.Equations<T>(theta_dual, load, &influence_dual, measured_tau, state);
    const Vec3Of<T>& p_W = state.p_read_W;
    for (int k = 0; k < count; ++k) {
      const int variable = first + k;
      const Vec3 dp(p_W[0].v[k], p_W[1].v[k], p_W[2].v[k]);
      const Vec3 dr = with_turn ? RotationDerivative<T>(state.X_WT.R, k) : Vec3(Vec3::Zero());
      if (variable < n) {
        partial.p_theta.col(variable) = dp;
        partial.r_theta.col(variable) = dr;
        for (int i = 0; i < n; ++i) partial.s_theta(i, variable) = state.sag[i].v[k];
      } else {
        const int entry = entries[variable - n];
        sensitivity.dp.col(entry) = dp;
        sensitivity.dr.col(entry) = dr;
        for (int i = 0; i < n; ++i) partial.s_x(i, entry) = state.sag[i].v[k];
      }
    }
  }
}

}  // namespace

bool SensitivityAt(const LoadedArm& arm, const model::JointVector& q, const loads::Payload& payload,
                   const effects::Influence<double>& influence,
                   const model::JointVector& measured_tau, const InfluenceSet& wanted,
                   Sensitivity& sensitivity, bool with_turn) {
  if (!arm.AtCommanded(q, payload, &influence, measured_tau, sensitivity.state)) return false;
  const int n = arm.size();
  const model::JointVector theta = q + sensitivity.state.sag;
  sensitivity.p_W = sensitivity.state.p_read_W;
  sensitivity.dp.setZero();
  sensitivity.dr.setZero();

  std::array<int, I::kSize> entries_of_all{};
  const InfluenceSet ingredients = WithIngredients(arm, wanted);
  const int dual_entries = DualEntries(arm, ingredients, entries_of_all);
  const std::span<const int> entries(entries_of_all.data(), static_cast<std::size_t>(dual_entries));
  PartialDerivatives partial;
  partial.s_theta.resize(n, n);
  const bool few = n + dual_entries <= NarrowDual::DIMENSION;
  const auto differentiate = few ? Differentiate<NarrowDual> : Differentiate<effects::Dual>;
  differentiate(arm, theta, payload, influence, measured_tau, entries, with_turn, partial,
                sensitivity);
  for (int i = 0; i < n; ++i) {
    const double tau = measured_tau.size() > i ? measured_tau[i] : sensitivity.state.tau[i];
    const double compliance = arm.compliance(i) + influence.Joint(I::kCompliance, i);
    const model::JointVector reported =
        arm.chain().ReportedFromDrives<double>(model::JointVector::Unit(n, i));
    for (int kind = 0; kind < kSagEntries; ++kind) {
      const int entry = kind * model::kMaxJoints + i;
      if (!wanted[entry]) continue;
      partial.s_x.col(entry).head(n) =
          SagDerivative(kind, compliance, influence.Joint(I::kTorque, i), tau) * reported;
    }
  }
  if (!arm.read_by_camera()) AddReadingEntries(arm, influence, wanted, sensitivity);
  // p_theta (I - s_theta)^-1 once, then every entry.
  const Square through = (Square::Identity(n, n) - partial.s_theta).partialPivLu().inverse();
  sensitivity.dp += (partial.p_theta.leftCols(n) * through).eval() * partial.s_x.topRows(n);
  if (with_turn) {
    sensitivity.dr += (partial.r_theta.leftCols(n) * through).eval() * partial.s_x.topRows(n);
  }
  AddClosedForms(arm, theta, influence, wanted, ingredients, sensitivity);
  return true;
}

bool SensitivityAt(const LoadedArm& arm, const model::JointVector& q, const loads::Payload& payload,
                   const effects::Influence<double>& influence,
                   const model::JointVector& measured_tau, Sensitivity& sensitivity) {
  return SensitivityAt(arm, q, payload, influence, measured_tau, InfluenceSet{}.set(), sensitivity);
}

}  // namespace plumbline::deflection
