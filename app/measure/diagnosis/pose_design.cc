#include "app/measure/diagnosis/pose_design.h"

#include <algorithm>

#include "app/measure/diagnosis/identify.h"
#include "firmware-like/kinematics/chain.h"

namespace plumbline::measure {
namespace {

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
    values[static_cast<std::size_t>(column.parameter)].v[0] = 1;
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
      const Block& of = task.candidate_set.blocks()[block];
      wanted_ |= EntriesOf(of, task.rows) | EntriesOf(of, moved);
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
  return std::any_of(proposed_.begin(), proposed_.end(), [&](const model::JointVector& other) {
    return ((q - other).array().abs() / range).mean() < kMinDistance;
  });
}

bool SequentialDesign::ViaIsAbove(const DesignPoint& point) const {
  const std::optional<model::JointVector> via = ViaPose(space_, point);
  if (!via) return true;
  kinematics::Posture posture;
  kinematics::Chain(task_.rows.cell.robot).Evaluate(*via, posture);
  const Model::Frames& frames = task_.model.frames.back();
  return (frames.X_WB * (posture.X_BF() * frames.tip_F)).z() >= task_.lowest_m;
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
    const auto highest = std::max_element(values.begin(), values.end());
    if (highest == values.end() || *highest <= (1 + kMinRise) * value) {
      step /= 2;
      continue;
    }
    value = *highest;
    best = neighbours[static_cast<std::size_t>(highest - values.begin())];
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
    const auto highest = std::max_element(values.begin(), values.end());
    if (highest == values.end() || *highest < kMinGain) break;
    DesignPoint chosen = points[static_cast<std::size_t>(highest - values.begin())];
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
