#include "app/measure/urdf/static_geometry.h"

#include "firmware-like/effects/written.h"
#include "firmware-like/statistics/random_sequence.h"

namespace plumbline::measure {
namespace {

using Influence = effects::Influence<double>;

constexpr int kMoments = 24;

/// Conditions in which nothing recorded is constant.
effects::Conditions RandomMoment(const model::CellModel& cell, statistics::RandomSequence& random) {
  effects::Conditions moment = effects::DeclaredConditions(cell);
  const auto vector = [&](double size) {
    model::JointVector v(cell.robot.size());
    for (double& value : v) value = size * (2 * random.Uniform() - 1);
    return v;
  };
  moment.q = vector(2);
  moment.qd = vector(1);
  moment.qdd = vector(1);
  moment.last_move = vector(1);
  moment.approach = vector(1).cwiseSign();
  moment.tau = vector(100);
  moment.payload_kg = 50 * random.Uniform();
  moment.t_s = 1e4 * random.Uniform();
  moment.temp_C = 15 + 20 * random.Uniform();
  moment.row = 1 + 1e4 * random.Uniform();
  return moment;
}

bool IsOfTable(int entry) {
  const int kind = entry / model::kMaxJoints;
  return entry < Influence::kFirst &&
         (kind == Influence::kTurn || kind == Influence::kLengthA || kind == Influence::kOffsetD ||
          kind == Influence::kTwistAlpha || kind == Influence::kTwistBeta);
}

/// True if two influences are equal and act on the table only.
bool SameTable(const Influence& a, const Influence& b) {
  for (int entry = 0; entry < Influence::kSize; ++entry) {
    if (a[entry] != b[entry] || (a[entry] != 0 && !IsOfTable(entry))) return false;
  }
  return true;
}

void AddToTable(const Influence& influence, model::Robot& robot) {
  for (int i = 0; i < robot.size(); ++i) {
    model::Joint& row = robot.joints[i];
    const double moved = row.sign * influence.Joint(Influence::kTurn, i);
    (row.type == model::JointType::kRevolute ? row.theta_offset_rad : row.d_m) += moved;
    row.a_m += influence.Joint(Influence::kLengthA, i);
    row.d_m += influence.Joint(Influence::kOffsetD, i);
    row.alpha_rad += influence.Joint(Influence::kTwistAlpha, i);
    row.beta_rad += influence.Joint(Influence::kTwistBeta, i);
  }
}

}  // namespace

StaticGeometry StaticGeometryOf(const model::CellModel& cell) {
  StaticGeometry geometry{cell.robot, {}, {}};
  const double applied_share = cell.domain ? cell.domain->applied_share : 1;
  std::vector<effects::Conditions> moments;
  statistics::RandomSequence random(1);
  for (int k = 0; k < kMoments; ++k) moments.push_back(RandomMoment(cell, random));
  for (const effects::ActiveEffect& effect : effects::ActiveEffectsOf(cell)) {
    const std::string id(effect.term.effect->traits().id);
    std::vector<Influence> at;
    for (const effects::Conditions& moment : moments) {
      effects::AddEffects({&effect, 1}, moment, at.emplace_back());
    }
    bool constant = true;
    for (const Influence& other : at) constant = constant && SameTable(at.front(), other);
    (constant ? geometry.included : geometry.left_out).push_back(id);
    if (!constant) continue;
    at.front().Scale(applied_share);
    AddToTable(at.front(), geometry.robot);
  }
  return geometry;
}

}  // namespace plumbline::measure
