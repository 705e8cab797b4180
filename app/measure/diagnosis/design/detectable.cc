#include "app/measure/diagnosis/design/detectable.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <tuple>

#include "app/measure/diagnosis/linear/linear_problem.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/result/diagnosis.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/effects/parameter_name.h"

namespace plumbline::measure {
namespace {

// Frames and scale that rows on artefacts leave free.

using I = effects::Influence<double>;
constexpr double kAbsorbed = 1e-3;  // share of a column that the nuisances must leave

/// Whitened column of a common factor of all lengths of arm and tool.
Eigen::VectorXd ScaleColumn(const LinearProblem& problem) {
  const model::CellModel& cell = problem.data().cell;
  Eigen::VectorXd column = Eigen::VectorXd::Zero(problem.response().size());
  for (int joint = 0; joint < cell.robot.size(); ++joint) {
    const model::Joint& link = cell.robot.joints[joint];
    column += link.a_m * problem.Carrier(I::kLengthA * model::kMaxJoints + joint);
    column += link.d_m * problem.Carrier(I::kOffsetD * model::kMaxJoints + joint);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (cell.tools() == 1) {
      column += cell.tool.tcp_F[axis] * problem.Carrier(I::kTip + axis);
      continue;
    }
    Eigen::MatrixXd tips(static_cast<Eigen::Index>(problem.rows().size()), 1);  // by row
    Eigen::Index at = 0;
    for (const RowIndex row : problem.rows()) {
      tips(at++, 0) = cell.ToolAt(problem.data().payloads[row].tool).tcp_F[axis];
    }
    column += problem.Carried({I::kTip + axis}, tips).col(0);
  }
  return column;
}

bool Absorbed(const LinearProblem& problem, Eigen::MatrixXd columns) {
  const double before = columns.norm();
  problem.Project(columns);
  return columns.norm() <= kAbsorbed * before;
}

/// The frames and the scale that rows on artefacts leave free:
///   base_frame  no instrument and no artefact of known position relates the robot's base to W
///   scale       all lengths of the arm change in proportion, and unknown positions with them
std::vector<NotObservable> FreeOfArtefacts(const LinearProblem& problem) {
  std::vector<NotObservable> free;
  const Dataset& data = problem.data();
  if (data.instrument_used()) return free;
  Eigen::MatrixXd base(problem.response().size(), 3);
  for (int axis = 0; axis < 3; ++axis) base.col(axis) = problem.Carrier(I::kBase + axis);
  if (data.frames_free() && Absorbed(problem, base)) {  // otherwise it is an effect like any other
    free.push_back(
        {"base_frame",
         {},
         {},
         "no row relates the robot's base to the measurement frame: it stays as declared. Give the "
         "place of three artefacts, or measure with an instrument"});
  }
  if (Absorbed(problem, ScaleColumn(problem))) {
    free.push_back(
        {"scale",
         {},
         {},
         "if all lengths of the arm change in proportion, unknown places change with them: give a "
         "[[distance]] between two artefacts, or the places of two"});
  }
  return free;
}

/// Joint, parameter spec and second joint of a size.
using SizeName = std::tuple<int, int, int>;

/// Detection limit of one effect over all its blocks.
struct Detectability {
  double limit_m = 0;               ///< largest over its detectable sizes; 0: none is detectable
  std::set<SizeName> undetectable;  ///< in at least one block
  std::set<SizeName> detectable;    ///< in at least one block
};

void Add(const CandidateSet& candidate_set, BlockIndex block, double cost, Detectability& found) {
  const Block& shown = candidate_set.blocks()[block];
  const Indexed<BlockColumnIndex, double> limits_m = candidate_set.MinimumDetectable(block, cost);
  for (const BlockColumnIndex k : limits_m.indices()) {
    const effects::TermParameter& parameter = shown.term.parameters[shown.columns[k].parameter];
    const SizeName name(parameter.joint, parameter.spec, parameter.of);
    (limits_m[k] > 0 ? found.detectable : found.undetectable).insert(name);
    found.limit_m = std::max(found.limit_m, limits_m[k]);
  }
}

/// The undetectable sizes of an effect; nullopt if it has none.
std::optional<NotObservable> UndetectableSizes(const std::string& id, const Detectability& found) {
  const effects::EffectTraits& traits = effects::FindEffect(id)->traits();
  NotObservable sizes{id, {}, {}, {}};
  std::set<int> joints;
  for (const auto& [joint, spec, other] : found.undetectable) {
    if (found.detectable.contains({joint, spec, other})) continue;
    sizes.parameters.push_back(effects::NameFromParameter(traits, {spec, joint, 1, other}));
    if (joint >= 0) joints.insert(joint);
  }
  if (sizes.parameters.empty()) return std::nullopt;
  for (const int joint : joints) sizes.scope.push_back(fmt::format("q{}", joint + 1));
  sizes.reason =
      "no size that is plausible for a healthy machine would be detected in these rows: free "
      "frames or places absorb it, its lever arms are short, or its joints hardly move";
  return sizes;
}

}  // namespace

DetectionLimits DetectionLimitsOf(const CandidateSet& candidate_set, const Candidates& candidates) {
  std::map<std::string, double> costs;
  for (const BlockIndex b : candidate_set.blocks().indices()) {
    double& cost = costs[candidate_set.blocks()[b].id];
    cost = std::max(cost, candidate_set.BlockCost(b));
  }
  std::map<std::string, Detectability> effects;
  for (const BlockIndex b : candidate_set.blocks().indices()) {
    const Block& block = candidate_set.blocks()[b];
    if (block.empirical()) continue;
    Add(candidate_set, b, costs[block.id], effects[block.id]);
  }
  // The candidate set contains only the shapes that followed the residual best.
  for (const effects::Effect* effect : candidates.searched) {
    const std::string id(effect->traits().id);
    if (!costs.contains(id)) continue;
    CandidateSet all_shapes(candidate_set.problem());
    for (const Block& block :
         ShapeSearchOf(*effect)->AllPlacements(candidate_set.problem().data())) {
      Add(all_shapes, all_shapes.Add(block), costs[id], effects[id]);
    }
  }
  DetectionLimits limits;
  limits.not_observable = FreeOfArtefacts(candidate_set.problem());
  for (const auto& [id, found] : effects) {
    if (found.limit_m > 0) limits.minimum_detectable_m[id] = found.limit_m;
    if (auto sizes = UndetectableSizes(id, found)) limits.not_observable.push_back(*sizes);
  }
  return limits;
}

}  // namespace plumbline::measure
