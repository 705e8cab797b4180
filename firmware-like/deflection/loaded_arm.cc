#include "firmware-like/deflection/loaded_arm.h"

#include <algorithm>

#include "firmware-like/deflection/equations.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::deflection {
namespace {

constexpr double kSettled_rad = 1e-12;
constexpr int kMostPasses = 50;

}  // namespace

template void LoadedArm::Equations<double>(const model::JointVector&, const loads::Payload&,
                                           const effects::Influence<double>*,
                                           const model::JointVector&, LoadedStateOf<double>&) const;
template void LoadedArm::Equations<effects::Dual>(const model::JointVectorOf<effects::Dual>&,
                                                  const loads::PayloadOf<effects::Dual>&,
                                                  const effects::Influence<effects::Dual>*,
                                                  const model::JointVector&,
                                                  LoadedStateOf<effects::Dual>&) const;

LoadedArm::ToolModel::ToolModel(const model::Tool& tool)
    : compliance(beam::TipComplianceOf(tool)),
      X_FT{Mat3::Identity(), tool.tcp_F},
      beam_tip_F(0, 0, tool.Length()),
      bends(!tool.rigid) {
  for (const model::ToolSegment& segment : tool.segments) {
    shear_m_per_N += segment.length_m / (segment.material.ShearModulus() * segment.section.area_m2);
  }
}

const Vec3& FarthestTip_F(const model::CellModel& cell) {
  int farthest = 0;
  for (int k = 1; k < cell.tools(); ++k) {
    if (cell.ToolAt(k).tcp_F.norm() > cell.ToolAt(farthest).tcp_F.norm()) farthest = k;
  }
  return cell.ToolAt(farthest).tcp_F;
}

LoadedArm::LoadedArm(const model::CellModel& cell)
    : chain_(cell.robot),
      loads_(cell),
      X_WB_(cell.robot.X_WB),
      base_rpy_(RollPitchYawFromRotation(cell.robot.X_WB.R)),
      g_W_(cell.robot.g_W),
      g_B_(cell.robot.X_WB.R.transpose() * cell.robot.g_W),
      compliance_(chain_.size()),
      effects_(effects::ActiveEffectsOf(cell)),
      growth_(chain_, FarthestTip_F(cell), cell),
      ranges_(cell.measurement.kind == model::MeasurementKind::kRange) {
  for (int k = 0; k < cell.tools(); ++k) tools_.emplace_back(cell.ToolAt(k));
  for (int i = 0; i < chain_.size(); ++i) {
    compliance_[i] = cell.robot.joints[i].compliance_rad_per_Nm.value_or(0.0);
    if (compliance_[i] == 0) continue;
    torques_missing_ = torques_missing_ || !loads_.known(i);
    centres_guessed_ = centres_guessed_ || loads_.guessed(i);
  }
  for (const effects::ActiveEffect& effect : effects_) {
    const effects::EffectTraits& traits = effect.term.effect->traits();
    const bool by_weight = traits.Needs(effects::Signal::kWeight, effect.term.word);
    if (!by_weight && !traits.Needs(effects::Signal::kTorques, effect.term.word)) continue;
    for (const effects::TermParameter& parameter : effect.term.parameters) {
      const int joint = std::max(0, parameter.joint);  // no joint: weight of the whole arm
      bool& missing = by_weight ? torques_missing_ : effect_torques_missing_;
      missing = missing || !loads_.known(joint);
      centres_guessed_ = centres_guessed_ || loads_.guessed(joint);
    }
  }
  X_WC_ = cell.measurement.X_WC;
  declared_ = effects::DeclaredConditions(cell);
  needed_columns_ = effects::NeededColumns(effects_, cell);
}

bool LoadedArm::LacksColumn(const effects::Conditions& conditions) const {
  return std::ranges::any_of(needed_columns_, [&](const effects::NeededColumn& needed) {
    return needed.MissingFrom(conditions);
  });
}

OperatingPoint LoadedArm::PointAt(const model::JointVector& q, const loads::Payload& payload,
                                  const effects::Conditions& conditions) const {
  OperatingPoint point{
      .q = q,
      .payload_kg = conditions.payload_kg != 0 ? conditions.payload_kg : payload.mass_kg,
      .temp_C = conditions.temp_C,
      .t_s = conditions.t_s,
      .tool = payload.tool,
      .item = payload.item};
  kinematics::Posture posture;
  chain_.Evaluate(q, posture);
  loads_.Torques(posture, g_B_, payload, point.tau);
  return point;
}

effects::Influence<double> LoadedArm::EffectsAt(const effects::Conditions& moment,
                                                const loads::Payload& payload) const {
  effects::Influence<double> influence;
  if (effects_.empty()) return influence;
  effects::AddEffects(effects_, moment, influence);
  if (!growth_.fades()) return influence;
  const double share = growth_.Share(PointAt(moment.Reported(moment.q), payload, moment));
  if (share < 1) influence.Scale(share);
  return influence;
}

void LoadedArm::AtActual(const model::JointVector& theta, const loads::Payload& payload,
                         const effects::Conditions& conditions, LoadedState& state) const {
  if (effects_.empty()) {
    Equations<double>(theta, payload, nullptr, conditions.tau, state);
    state.X_BT = X_WB_.Inverse() * state.X_WT;
    return;
  }
  // Effects depend on the command q = theta - s, which depends on the effects: iterate.
  effects::Conditions moment = ConditionsAt(theta, conditions);
  for (int pass = 0; pass < 6; ++pass) {
    const effects::Influence<double> influence = EffectsAt(moment, payload);
    Equations<double>(theta, payload, &influence, conditions.tau, state);
    const model::JointVector drives = model::DrivePositions(chain_.couplings(), theta - state.sag);
    const double change = (drives - moment.q).cwiseAbs().maxCoeff();
    moment.q = drives;
    if (change < kSettled_rad) break;
  }
  state.X_BT = X_WB_.Inverse() * state.X_WT;
}

bool LoadedArm::AtCommanded(const model::JointVector& q, const loads::Payload& payload,
                            const effects::Conditions& conditions, LoadedState& state) const {
  bool settled = false;
  if (effects_.empty()) {
    settled = AtCommanded(q, payload, nullptr, conditions.tau, state);
  } else {
    const effects::Influence<double> influence = EffectsAt(ConditionsAt(q, conditions), payload);
    settled = AtCommanded(q, payload, &influence, conditions.tau, state);
  }
  state.X_BT = X_WB_.Inverse() * state.X_WT;
  return settled;
}

bool LoadedArm::AtCommanded(const model::JointVector& q, const loads::Payload& payload,
                            const effects::Influence<double>* influence,
                            const model::JointVector& measured_tau,
                            LoadedStateOf<double>& state) const {
  // The deflection jumps by the gap where the torque changes sign. If the load balances between
  // both sides of a gap, no posture satisfies the equations exactly, and the iteration stays within
  // the gap.
  double gap = 0;
  for (int i = 0; influence != nullptr && i < size(); ++i) {
    gap = std::max(gap, std::abs(influence->Joint(effects::Influence<double>::kLoadGap, i)));
  }
  model::JointVector theta = q;
  constexpr int kWholePasses = kMostPasses / 2;
  double change = 0;
  for (int pass = 0; pass < kMostPasses; ++pass) {
    Equations<double>(theta, payload, influence, measured_tau, state);
    change = (q + state.sag - theta).cwiseAbs().maxCoeff();
    if (change < kSettled_rad) return true;
    const double share = pass < kWholePasses ? 1.0 : 2.0 / (pass + 4 - kWholePasses);
    theta += share * (q + state.sag - theta);
  }
  return change < 2.5 * gap;
}

effects::Conditions LoadedArm::ConditionsAt(const model::JointVector& q,
                                            const effects::Conditions& conditions) const {
  effects::Conditions moment = conditions;
  moment.q = model::DrivePositions(chain_.couplings(), q);
  moment.robot = declared_.robot;
  moment.reference_temperature_C = declared_.reference_temperature_C;
  moment.camera = declared_.camera;
  return moment;
}

Pose LoadedArm::UnloadedTip(const model::JointVector& q, int tool) const {
  kinematics::Posture posture;
  chain_.Evaluate(q, posture);
  return posture.X_BF() * X_FT(tool);
}

void ApplyTips(const model::SessionFrames& session, model::CellModel& cell) {
  for (const model::SessionTip& tip : session.tips) {
    const auto index = tip.tool ? loads::ToolIndexOf(cell, tip.tool) : 0;
    if (index) cell.ToolAt(*index).tcp_F = tip.p_F;
  }
}

model::CellModel CellOfSession(const model::CellModel& cell, const std::string& id) {
  model::CellModel of_session = cell;
  if (cell.sessions.empty()) return of_session;
  const auto known = std::ranges::find_if(
      cell.sessions, [&](const model::SessionFrames& session) { return session.id == id; });
  const model::SessionFrames& frames = known == cell.sessions.end() ? cell.sessions.back() : *known;
  of_session.robot.X_WB = frames.X_WB;
  for (const model::SessionFrames& other : cell.sessions) ApplyTips(other, of_session);
  ApplyTips(frames, of_session);
  return of_session;
}

std::optional<int> SessionTipNumber(const model::CellModel& cell, int tool) {
  return cell.tools() > 1 ? cell.ToolAt(tool).number : std::nullopt;
}

model::CellModel CellOfPoints(const model::CellModel& cell) {
  model::CellModel of_points = cell;
  of_points.sessions.clear();
  if (cell.measurement.holds_points && !cell.sessions.empty()) {
    of_points.robot.X_WB = cell.sessions.back().X_WB;
  }
  return of_points;
}

}  // namespace plumbline::deflection
