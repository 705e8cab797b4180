#include "app/measure/diagnosis/design/pose_design.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/search/identify.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/loads/numbered_load.h"

namespace plumbline::measure {
namespace {

constexpr int kPoses = 300;
constexpr double kWidened = 0.25;   // of the measured joint range, on either side
constexpr double kMinTurn = 0.09;   // [rad], 5 degrees: far larger than any backlash
constexpr double kMinSlide = 0.05;  // [m]
constexpr double kMinMove = 1e-6;   // [rad] or [m]: smaller changes do not count as a move
constexpr double kMinute_s = 60;
constexpr double kLongestWait_s = 8 * 60 * kMinute_s;  // a shift

void SetRange(const Dataset& data, DesignSpace& space) {
  space.low = space.high = data.table.rows.front().q;
  for (const MeasuredRow& row : data.table.rows) {
    space.low = space.low.cwiseMin(row.q);
    space.high = space.high.cwiseMax(row.q);
  }
  space.reach.resize(space.low.size());
  for (int i = 0; i < data.cell.robot.size(); ++i) {
    const model::Joint& joint = data.cell.robot.joints[i];
    const double least = joint.type == model::JointType::kPrismatic ? kMinSlide : kMinTurn;
    const double more = std::max(least, kWidened * (space.high[i] - space.low[i]));
    // The range includes measured rows beyond the declared limits.
    space.low[i] = std::min(space.low[i], std::max(space.low[i] - more, joint.min));
    space.high[i] = std::max(space.high[i], std::min(space.high[i] + more, joint.max));
    space.reach[i] = least;
  }
}

bool Needs(const Block& block, effects::Signal signal) {
  return block.term.effect->traits().Needs(signal, block.term.word);
}

/// Joints of effects that depend on the order of moves, without joints that never moved.
std::vector<int> Approached(const Dataset& data, const std::vector<const Block*>& blocks) {
  std::set<int> joints;
  for (const Block* block : blocks) {
    if (!Needs(*block, effects::Signal::kOrder)) continue;
    for (const effects::TermParameter& parameter : block->term.parameters) {
      if (parameter.joint >= 0) joints.insert(parameter.joint);
    }
  }
  for (const int still : data.still_joints) joints.erase(still);
  return {joints.begin(), joints.end()};
}

/// Waits [s]: none, a quarter and all of the time span of the rows, in whole minutes.
std::vector<double> Waits(const Dataset& data, const std::vector<const Block*>& blocks) {
  const auto follows_time = [](const Block* block) {
    return Needs(*block, effects::Signal::kTime);
  };
  if (!data.table.recorded.time || std::ranges::none_of(blocks, follows_time)) {
    return {0};
  }
  double first_s = *data.table.rows.front().t_s, last_s = first_s;
  for (const MeasuredRow& row : data.table.rows) {
    first_s = std::min(first_s, *row.t_s);
    last_s = std::max(last_s, *row.t_s);
  }
  std::set<double> waits = {0};
  for (const double share : {0.25, 1.0}) {
    const double wait_s = std::min(kLongestWait_s, share * (last_s - first_s));
    waits.insert(kMinute_s * std::ceil(wait_s / kMinute_s));
  }
  return {waits.begin(), waits.end()};
}

/// At rest, and as in the rows of median and largest speed.
std::vector<Motion> Motions(const Dataset& data, const std::vector<const Block*>& blocks) {
  const RecordedColumns& recorded = data.table.recorded;
  const bool follows = std::ranges::any_of(blocks, [&](const Block* block) {
    return (recorded.qd && Needs(*block, effects::Signal::kVelocity)) ||
           (recorded.qdd && Needs(*block, effects::Signal::kAcceleration));
  });
  if (!follows) return {};
  std::vector<const MeasuredRow*> moving;
  for (const MeasuredRow& row : data.table.rows) moving.push_back(&row);
  const auto size = [&](const MeasuredRow* row) {
    return recorded.qd ? row->qd.norm() : row->qdd.norm();
  };
  std::ranges::stable_sort(
      moving, [&](const MeasuredRow* a, const MeasuredRow* b) { return size(a) < size(b); });
  if (!(size(moving.back()) > 0)) return {};
  const model::JointVector at_rest = model::JointVector::Zero(data.table.rows.front().q.size());
  std::vector<Motion> motions = {{recorded.qd ? at_rest : model::JointVector(),
                                  recorded.qdd ? at_rest : model::JointVector()}};
  for (const MeasuredRow* row : {moving[moving.size() / 2], moving.back()}) {
    motions.push_back({row->qd, row->qdd});
  }
  return motions;
}

/// Possible approaches: directly, all joints from one side, one joint from one side.
std::vector<model::JointVector> Sides(const DesignSpace& space) {
  const model::JointVector none = model::JointVector::Zero(space.low.size());
  std::vector<model::JointVector> sides = {none};
  for (const double sign : {-1.0, 1.0}) {
    model::JointVector all = none;
    for (const int joint : space.approached) all[joint] = sign;
    if (space.approached.size() > 1) sides.push_back(all);
    for (const int joint : space.approached) {
      sides.push_back(none);
      sides.back()[joint] = sign;
    }
  }
  return sides;
}

/// Updates the conditions by a move to the reported values `reported`. Drives that do not move keep
/// their side of approach.
void MoveTo(const model::Robot& robot, const model::JointVector& reported,
            effects::Conditions& moment) {
  const model::JointVector q = effects::OfDrives(robot, reported);
  moment.last_move = q - moment.q;
  moment.q = q;
  if (moment.approach.size() != q.size()) moment.approach = model::JointVector::Zero(q.size());
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    if (std::abs(moment.last_move[i]) > kMinMove) {
      moment.approach[i] = moment.last_move[i] > 0 ? 1.0 : -1.0;
    }
  }
}

constexpr double kMinGain = 0.1;      // sigma^2: minimum value of a pose
constexpr double kExtraCost = 0.1;    // share of the value, for each of via pose, wait and motion
constexpr double kFirstStep = 0.125;  // of a joint's range
constexpr double kLastStep = 0.02;
constexpr int kMaxRounds = 12;
constexpr double kMinRise = 1e-3;  // of the value
// Minimum distance between proposed poses: mean over the joints, relative to their ranges (about a
// third for random poses). Errors of the linear model are similar at neighbouring poses, so these
// would confirm each other.
constexpr double kMinDistance = 0.15;

/// Entries of the influence on which a block acts at any of these rows.
deflection::InfluenceSet EntriesOf(const Block& block, const Dataset& rows) {
  deflection::InfluenceSet entries;
  for (const BlockColumn& column : block.columns) {
    if (block.empirical()) {
      entries.set(static_cast<std::size_t>(column.entry));
      continue;
    }
    std::vector<effects::Dual> values;
    for (const double value : column.values) values.emplace_back(value);
    values[column.parameter].v[0] = 1;
    for (const effects::Conditions& moment : rows.conditions) {
      effects::Influence<effects::Dual> influence;
      block.term.effect->Add(block.term, std::span<const effects::Dual>(values), moment, influence);
      for (int entry = 0; entry < effects::Influence<double>::kSize; ++entry) {
        if (influence[entry].v[0] != 0) entries.set(static_cast<std::size_t>(entry));
      }
    }
  }
  return entries;
}

}  // namespace

int DesignPoint::Extras() const {
  return (side.isZero() ? 0 : 1) + (wait_s > 0 ? 1 : 0) + (motion > 0 ? 1 : 0);
}

std::vector<double> PayloadsSeen(const Dataset& data) {
  std::set<double> distinct;
  for (const MeasuredRow& row : data.table.rows) {
    distinct.insert(row.payload_kg.value_or(0));
  }
  std::vector<double> all(distinct.begin(), distinct.end());
  if (all.size() <= 3) return all;
  return {all.front(), all[all.size() / 2], all.back()};
}

DesignSpace DesignSpaceOf(const Dataset& data, const std::vector<const Block*>& blocks) {
  DesignSpace space;
  SetRange(data, space);
  space.payloads_kg = PayloadsSeen(data);
  space.approached = Approached(data, blocks);
  space.waits_s = Waits(data, blocks);
  space.motions = Motions(data, blocks);
  return space;
}

std::vector<DesignPoint> RandomPoints(const DesignSpace& space) {
  const std::vector<model::JointVector> sides = Sides(space);
  const std::size_t motions = std::max<std::size_t>(1, space.motions.size());
  const bool more = sides.size() > 1 || space.waits_s.size() > 1 || motions > 1;
  Random random(4242);
  const auto drawn = [&](std::size_t count) {
    return static_cast<std::size_t>(random.Below(static_cast<int>(count)));
  };
  std::vector<DesignPoint> points;
  for (int k = 0; k < kPoses; ++k) {
    DesignPoint point;
    point.q.resize(space.low.size());
    for (Eigen::Index i = 0; i < point.q.size(); ++i) {
      point.q[i] = space.low[i] + random.Uniform() * (space.high[i] - space.low[i]);
    }
    point.side = sides.front();
    for (const double payload_kg : space.payloads_kg) {
      point.payload_kg = payload_kg;
      points.push_back(point);
    }
    if (!more || k % 2 != 0) continue;
    for (const double payload_kg : space.payloads_kg) {
      DesignPoint other = point;
      other.payload_kg = payload_kg;
      other.side = sides[drawn(sides.size())];
      other.wait_s = space.waits_s[drawn(space.waits_s.size())];
      other.motion = drawn(motions);
      if (Within(space, other)) points.push_back(other);
    }
  }
  return points;
}

std::vector<DesignPoint> Neighbours(const DesignSpace& space, const DesignPoint& point,
                                    double step) {
  std::vector<DesignPoint> neighbours;
  const auto add = [&](const DesignPoint& other) {
    if (Within(space, other)) neighbours.push_back(other);
  };
  for (Eigen::Index i = 0; i < point.q.size(); ++i) {
    for (const double sign : {-1.0, 1.0}) {
      DesignPoint other = point;
      other.q[i] = std::clamp(point.q[i] + sign * step * (space.high[i] - space.low[i]),
                              space.low[i], space.high[i]);
      if (other.q[i] != point.q[i]) add(other);
    }
  }
  DesignPoint other = point;
  for (const double payload_kg : space.payloads_kg) {
    other.payload_kg = payload_kg;
    if (payload_kg != point.payload_kg) add(other);
  }
  other = point;
  for (const model::JointVector& side : Sides(space)) {
    other.side = side;
    if (side != point.side) add(other);
  }
  other = point;
  for (const double wait_s : space.waits_s) {
    other.wait_s = wait_s;
    if (wait_s != point.wait_s) add(other);
  }
  other = point;
  for (std::size_t motion = 0; motion < space.motions.size(); ++motion) {
    other.motion = motion;
    if (motion != point.motion) add(other);
  }
  return neighbours;
}

std::optional<model::JointVector> ViaPose(const DesignSpace& space, const DesignPoint& point) {
  if (point.side.isZero()) return std::nullopt;
  return model::JointVector(point.q - point.side.cwiseProduct(space.reach));
}

bool Within(const DesignSpace& space, const DesignPoint& point) {
  const auto inside = [&](const model::JointVector& q) {
    return (q.array() >= space.low.array()).all() && (q.array() <= space.high.array()).all();
  };
  const std::optional<model::JointVector> via = ViaPose(space, point);
  return inside(point.q) && (!via || inside(*via));
}

Dataset CandidateRows(const Dataset& data, const DesignSpace& space,
                      const std::vector<DesignPoint>& points, const effects::Conditions& previous) {
  Dataset rows = SelectRows(data, {});
  // New poses are measured as the last row that is not on an artefact was, or else as positions.
  std::optional<RowIndex> proposed;
  for (const RowIndex row : data.row_indices()) {
    if (!OnArtefact(data.observations[row].kind)) proposed = row;
  }
  for (const DesignPoint& point : points) {
    MeasuredRow row = proposed ? data.measured(*proposed) : data.table.rows.back();
    if (!proposed) row.measured_W = Vec3::Zero();  // its residual is not used
    row.q = point.q;
    if (row.payload_kg) row.payload_kg = point.payload_kg;
    rows.payloads.push_back(
        loads::LoadOf(data.cell, point.payload_kg, row.tool_number, row.payload_item));
    rows.observations.push_back(proposed ? data.observations[*proposed] : Observation{});
    rows.numbers.push_back(proposed ? data.numbers[*proposed] : RowNumbers{3, {}});
    rows.session_of.push_back(data.session_of.back());
    rows.cluster_of.emplace_back(rows.rows());
    rows.table.rows.push_back(row);
  }
  rows.clusters = rows.rows();
  rows.conditions.assign(points.size(),
                         proposed ? data.conditions[*proposed] : data.conditions.back());
  // Signals of empirical terms are those of an existing row.
  for (const SignalIndex s : data.signals.indices()) {
    rows.signals[s].values.assign(points.size(), data.signals[s].values.back());
  }
  SetApproach(previous, space, points, rows);
  return rows;
}

void SetApproach(const effects::Conditions& previous, const DesignSpace& space,
                 const std::vector<DesignPoint>& points, Dataset& rows) {
  for (std::size_t k = 0; k < points.size(); ++k) {
    const DesignPoint& point = points[k];
    effects::Conditions& moment = rows.conditions[RowIndex(k)];
    moment.q = previous.q;
    moment.approach = previous.approach;
    const model::Robot& robot = rows.cell.robot;
    if (const auto via = ViaPose(space, point)) MoveTo(robot, *via, moment);
    MoveTo(robot, point.q, moment);
    moment.tau.resize(0);
    const std::optional<int>& item = rows.measured(RowIndex(k)).payload_item;
    moment.payload_kg = point.payload_kg + loads::ItemMass_kg(rows.cell, item);
    if (previous.t_s) moment.t_s = *previous.t_s + point.wait_s;
    if (space.motions.empty()) continue;
    moment.qd = effects::OfDrives(robot, space.motions[point.motion].qd);
    moment.qdd = effects::OfDrives(robot, space.motions[point.motion].qdd);
  }
}

SequentialDesign::SequentialDesign(const DesignTask& task, const DesignSpace& space)
    : task_(task),
      space_(space),
      discrimination_(task.candidate_set, task.explanations),
      previous_(task.rows.conditions.back()) {
  // Include a point with all design variables chosen: an effect may not act at any measured row.
  DesignPoint point{task.rows.table.rows.back().q, 0, model::JointVector::Zero(space.low.size())};
  for (const int joint : space.approached) point.side[joint] = 1;
  point.motion = space.motions.empty() ? 0 : space.motions.size() - 1;
  const Dataset moved = CandidateRows(task.rows, space, {point}, previous_);
  for (const Explanation& explanation : task.explanations) {
    for (const BlockIndex block : explanation.blocks) {
      const Block& block_of_answer = task.candidate_set.blocks()[block];
      wanted_ |= EntriesOf(block_of_answer, task.rows) | EntriesOf(block_of_answer, moved);
    }
  }
}

std::optional<SequentialDesign::Batch> SequentialDesign::Linearised(
    const std::vector<DesignPoint>& points) const {
  if (wanted_.none()) return std::nullopt;
  Dataset rows = CandidateRows(task_.rows, space_, points, previous_);
  Model bare = task_.model;
  bare.effects.clear();
  const Result<Linearisation> linear = Linearise(rows, bare, wanted_, task_.threads);
  if (!linear) return std::nullopt;
  Result<Linearisation> apart = LineariseApart(rows, task_.model, task_.threads, &*linear);
  if (!apart) return std::nullopt;
  return Batch{std::move(rows), std::move(apart).value()};
}

bool SequentialDesign::NearProposed(const model::JointVector& q) const {
  const auto range = (space_.high - space_.low).array();
  return std::ranges::any_of(proposed_, [&](const model::JointVector& other) {
    return ((q - other).array().abs() / range).mean() < kMinDistance;
  });
}

bool SequentialDesign::ViaIsAbove(const DesignPoint& point) const {
  const std::optional<model::JointVector> via = ViaPose(space_, point);
  if (!via) return true;
  kinematics::Posture posture;
  kinematics::Chain(task_.rows.cell.robot).Evaluate(*via, posture);
  const Model::Frames& frames = task_.model.frames.back();
  return std::ranges::all_of(frames.X_FT, [&](const Pose& X_FT) {
    return (frames.X_WB * (posture.X_BF() * X_FT.p)).z() >= task_.lowest_m;
  });
}

std::vector<double> SequentialDesign::Values(const std::vector<DesignPoint>& points,
                                             const Batch& batch) const {
  std::vector<double> values(points.size(), 0.0);
  InParallel(batch.rows.rows(), task_.threads, [&](int first, int last) {
    for (const RowIndex row : IndexRange(RowIndex(first), RowIndex(last))) {
      const DesignPoint& point = points[row.offset()];
      if (batch.linear.rows[row].p_W.z() < task_.lowest_m || NearProposed(point.q)) continue;
      if (!ViaIsAbove(point)) continue;
      values[row.offset()] =
          discrimination_.Gain(batch.rows, batch.linear, row) * (1 - kExtraCost * point.Extras());
    }
  });
  return values;
}

std::vector<double> SequentialDesign::Values(const std::vector<DesignPoint>& points) const {
  const std::optional<Batch> batch = Linearised(points);
  return batch ? Values(points, *batch) : std::vector<double>(points.size(), 0.0);
}

std::vector<RivalSeparation> SequentialDesign::SeparationsAt(
    const std::vector<DesignPoint>& points) const {
  std::vector<RivalSeparation> separations;
  const std::optional<Batch> batch = Linearised(points);
  if (!batch) return separations;
  for (const RowIndex row : batch->rows.row_indices()) {
    separations.push_back(
        {points[row.offset()].q, discrimination_.LargestDistance(batch->rows, batch->linear, row)});
  }
  return separations;
}

DesignPoint SequentialDesign::Improved(const DesignPoint& point) const {
  DesignPoint best = point;
  double value = Values({best}).front();
  double step = kFirstStep;
  for (int round = 0; round < kMaxRounds && step > kLastStep; ++round) {
    const std::vector<DesignPoint> neighbours = Neighbours(space_, best, step);
    const std::vector<double> values = Values(neighbours);
    const auto highest = std::ranges::max_element(values);
    if (highest == values.end() || *highest <= (1 + kMinRise) * value) {
      step /= 2;
      continue;
    }
    value = *highest;
    best = neighbours[highest - values.begin()];
  }
  return best;
}

void SequentialDesign::Propose(const DesignPoint& point, PoseDesign& design) {
  constexpr RowIndex kOnly(0);
  const std::optional<Batch> batch = Linearised({point});
  if (!batch) return;
  NextPose& pose = design.poses.emplace_back();
  pose.q = point.q;
  pose.payload_kg = point.payload_kg;
  pose.tool_number = batch->rows.measured(kOnly).tool_number;
  pose.payload_item = batch->rows.measured(kOnly).payload_item;
  pose.separation_m = discrimination_.LargestDistance(batch->rows, batch->linear, kOnly);
  if (const std::optional<model::JointVector> via = ViaPose(space_, point)) pose.via_q = *via;
  pose.wait_s = point.wait_s;
  if (!space_.motions.empty()) {
    pose.qd = space_.motions[point.motion].qd;
    pose.qdd = space_.motions[point.motion].qdd;
  }
  discrimination_.Measure(batch->rows, batch->linear, kOnly);
  previous_ = batch->rows.conditions.front();
  proposed_.push_back(point.q);
}

PoseDesign SequentialDesign::Run() {
  PoseDesign design;
  for (std::size_t j = 1; j < task_.explanations.size(); ++j) design.unseparated.insert(j);
  const std::vector<DesignPoint> points = RandomPoints(space_);
  std::optional<Batch> batch = Linearised(points);
  while (batch && static_cast<int>(design.poses.size()) < task_.poses) {
    SetApproach(previous_, space_, points, batch->rows);
    const std::vector<double> values = Values(points, *batch);
    const auto highest = std::ranges::max_element(values);
    if (highest == values.end() || *highest < kMinGain) break;
    DesignPoint chosen = points[highest - values.begin()];
    if (!design.unseparated.empty()) {
      chosen = Improved(chosen);
      design.gain += Values({chosen}).front();
    }
    const std::size_t before = design.poses.size();
    Propose(chosen, design);
    if (design.poses.size() == before) break;
    for (std::size_t j = 1; j < task_.explanations.size(); ++j) {
      if (discrimination_.Separated(j)) design.unseparated.erase(j);
    }
    if (discrimination_.AllSeparated()) discrimination_.Restart();
  }
  return design;
}

}  // namespace plumbline::measure
