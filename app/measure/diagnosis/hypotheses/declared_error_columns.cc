#include "app/measure/diagnosis/hypotheses/declared_error_columns.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <set>
#include <utility>

#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/linear/nuisances.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;

/// Standard deviation of the prior of each component. A judgement: larger errors are found as gross
/// errors.
constexpr double kShiftDeviation_m = 0.01;
constexpr double kTurnDeviation_rad = 0.1;       // likewise
constexpr double kLeftByNuisances = 1e-3;        // share of a column that the nuisances must leave
constexpr std::size_t kMinRowsBetweenMoves = 2;  // on an artefact, before and after a move

/// Projects and scales the columns.
/// @return  nullopt if the nuisances absorb one
std::optional<DeclaredErrorColumns> Scaled(const LinearProblem& problem, DeclaredErrorKind kind,
                                           Eigen::MatrixXd columns, double deviation) {
  const Eigen::VectorXd before = columns.colwise().norm();
  problem.Project(columns);
  const Eigen::VectorXd length = columns.colwise().norm();
  for (Eigen::Index axis = 0; axis < columns.cols(); ++axis) {
    if (!(length[axis] > kLeftByNuisances * before[axis])) return std::nullopt;
    columns.col(axis) /= length[axis];
  }
  return DeclaredErrorColumns{kind, std::move(columns), length, deviation};
}

/// A rotation of all measured orientations.
/// @return  nullopt if the rows hold none, or if the nuisances absorb it
std::optional<DeclaredErrorColumns> TurnColumns(const LinearProblem& problem) {
  const FitLayout& layout = problem.layout();
  const Whitener whitener(problem.fit());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(problem.response().size(), kErrorAxes);
  for (const FitRowIndex j : problem.rows().indices()) {
    if (layout.count(j) != kMaxResiduals) continue;
    whitener[j].Apply(problem.linear().rows[problem.rows()[j]].own, layout.PartOf(columns, j));
  }
  return Scaled(problem, {DeclaredErrorKind::What::kTurn}, std::move(columns), kTurnDeviation_rad);
}

/// @return  nullopt if the tool has none of the rows or all of them, or if the nuisances absorb its
///          tip
std::optional<DeclaredErrorColumns> TipColumns(const LinearProblem& problem, int tool) {
  Eigen::MatrixXd of_tool(static_cast<Eigen::Index>(problem.rows().size()), 1);
  Eigen::Index at = 0;
  for (const RowIndex row : problem.rows()) {
    of_tool(at++, 0) = problem.data().payloads[row].tool == tool ? 1 : 0;
  }
  if (of_tool.maxCoeff() == 0 || of_tool.minCoeff() == 1) return std::nullopt;
  DeclaredErrorKind kind{DeclaredErrorKind::What::kTip, tool};
  kind.choices = problem.data().cell.tools();
  return Scaled(problem, kind, problem.Carried({I::kTip, I::kTip + 1, I::kTip + 2}, of_tool),
                kShiftDeviation_m);
}

/// A row on an artefact: its place in the fit, and whitened derivatives by the artefact's place.
struct Touch {
  FitRowIndex row{};
  Eigen::MatrixXd slopes;  ///< shape (residuals of the row, 3)
};

Indexed<ArtefactIndex, std::vector<Touch>> TouchesOf(const LinearProblem& problem) {
  const Dataset& data = problem.data();
  const Whitener whitener(problem.fit());
  Indexed<ArtefactIndex, std::vector<Touch>> touches(data.used_artefacts.size());
  for (const FitRowIndex j : problem.rows().indices()) {
    const RowIndex row = problem.rows()[j];
    const Eigen::MatrixXd& own = problem.linear().rows[row].own;
    if (!IsAtUnknownPlace(data, row) || own.cols() < kErrorAxes) continue;
    Touch touch{j, Eigen::MatrixXd::Zero(problem.layout().count(j), kErrorAxes)};
    whitener[j].Apply(own.leftCols(kErrorAxes), touch.slopes);
    touches[data.observations[row].artefact].push_back(std::move(touch));
  }
  return touches;
}

/// The touch before which a move reduces chi2 most, and the reduction. The residual is orthogonal
/// to the place of the artefact, whose own columns are projected out of those of the move.
std::pair<std::size_t, double> BestMove(const LinearProblem& problem,
                                        const std::vector<Touch>& touches,
                                        const Eigen::VectorXd& residual) {
  Mat3 of_all = Mat3::Zero(), after = Mat3::Zero();
  for (const Touch& touch : touches) of_all += touch.slopes.transpose() * touch.slopes;
  const Mat3 inverse = of_all.inverse();
  Vec3 moment = Vec3::Zero();
  std::pair<std::size_t, double> best{0, 0};
  for (std::size_t k = touches.size(); k-- > kMinRowsBetweenMoves;) {
    after += touches[k].slopes.transpose() * touches[k].slopes;
    moment += touches[k].slopes.transpose() * problem.layout().PartOf(residual, touches[k].row);
    if (touches.size() - k < kMinRowsBetweenMoves) continue;
    const Eigen::LDLT<Mat3> gram(after - after * inverse * after);
    const double gain = moment.dot(gram.solve(moment));
    if (gram.isPositive() && std::isfinite(gain) && gain > best.second) best = {k, gain};
  }
  return best;
}

/// The rows with one item's mass increased.
Dataset WithHeavierItem(Dataset data, const model::PayloadItem& item, double by_kg) {
  for (const RowIndex row : data.row_indices()) {
    loads::Payload& payload = data.payloads[row];
    if (payload.item != item.number) continue;
    payload.cog_F =
        (payload.mass_kg * payload.cog_F + by_kg * item.cog_F) / (payload.mass_kg + by_kg);
    payload.mass_kg += by_kg;
    data.conditions[row].payload_kg += by_kg;
  }
  return data;
}

/// Standard deviation of the prior of an item's mass: half the mass, and at least this.
constexpr double kLeastMassDeviation_kg = 0.5;  // a judgement
constexpr double kMassStep = 0.01;              // of the deviation, for the derivative

/// @param declared  of the model with the declared masses
/// @return  nullopt if the item has none of the rows or all of them, or if the nuisances absorb its
///          mass
std::optional<DeclaredErrorColumns> ItemColumns(const LinearProblem& problem, const Model& model,
                                                const Linearisation& declared, int index,
                                                int threads) {
  const Dataset& data = problem.data();
  const model::PayloadItem& item = data.cell.payload_items[index];
  const auto carried = std::ranges::count_if(
      problem.rows(), [&](RowIndex row) { return data.payloads[row].item == item.number; });
  if (carried == 0 || static_cast<std::size_t>(carried) == problem.rows().size())
    return std::nullopt;
  const double deviation = std::max(kLeastMassDeviation_kg, item.mass_kg / 2);
  const double step_kg = kMassStep * deviation;
  const Result<Linearisation> heavier =
      Linearise(WithHeavierItem(data, item, step_kg), model, false, threads);
  if (!heavier) return std::nullopt;
  const FitLayout& layout = problem.layout();
  const Whitener whitener(problem.fit());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(problem.response().size(), 1);
  for (const FitRowIndex j : problem.rows().indices()) {
    const RowIndex row = problem.rows()[j];
    const Eigen::MatrixXd slope =
        (declared.rows[row].residual - heavier->rows[row].residual) / step_kg;
    whitener[j].Apply(slope, layout.PartOf(columns, j));
  }
  DeclaredErrorKind kind{DeclaredErrorKind::What::kItemMass};
  kind.item = index;
  kind.choices = static_cast<int>(data.cell.payload_items.size());
  return Scaled(problem, kind, std::move(columns), deviation);
}

}  // namespace

bool TestsItems(const Dataset& data) {
  std::set<int> items;
  for (const loads::Payload& payload : data.payloads) items.insert(payload.item);
  return items.size() > 1;
}

std::vector<DeclaredErrorColumns> ItemErrors(const LinearProblem& problem, const Model& model,
                                             int threads) {
  std::vector<DeclaredErrorColumns> errors;
  if (!TestsItems(problem.data())) return errors;
  const Result<Linearisation> declared = Linearise(problem.data(), model, false, threads);
  if (!declared) return errors;
  for (int k = 0; k < static_cast<int>(problem.data().cell.payload_items.size()); ++k) {
    if (auto columns = ItemColumns(problem, model, *declared, k, threads))
      errors.push_back(std::move(*columns));
  }
  return errors;
}

bool TestsTips(const Dataset& data) {
  std::set<int> tools;
  for (const MeasuredRow& row : data.table.rows) tools.insert(row.tool_number.value_or(0));
  const auto turned = std::ranges::find(data.turned_sessions, true);
  return !data.tip_free() && (tools.size() > 1 || turned != data.turned_sessions.end());
}

bool IsAtUnknownPlace(const Dataset& data, RowIndex row) {
  const Observation& observation = data.observations[row];
  return OnArtefact(observation.kind) &&
         FreedomOf(data.cell.artefacts[observation.artefact.offset()]).place == kErrorAxes;
}

bool TestsMoves(const Dataset& data) {
  Indexed<ArtefactIndex, std::size_t> rows(data.used_artefacts.size(), 0);
  for (const RowIndex row : data.row_indices()) {
    if (IsAtUnknownPlace(data, row)) ++rows[data.observations[row].artefact];
  }
  return std::ranges::any_of(rows, [](std::size_t n) { return n >= 2 * kMinRowsBetweenMoves; });
}

std::vector<DeclaredErrorColumns> TipErrors(const LinearProblem& problem) {
  std::vector<DeclaredErrorColumns> errors;
  if (!TestsTips(problem.data())) return errors;
  const auto add = [&](std::optional<DeclaredErrorColumns> columns) {
    if (columns) errors.push_back(std::move(*columns));
  };
  const int tools = problem.data().cell.tools();
  for (int tool = 0; tools > 1 && tool < tools; ++tool) add(TipColumns(problem, tool));
  add(TurnColumns(problem));
  return errors;
}

std::optional<DeclaredErrorColumns> LikeliestMove(const LinearProblem& problem,
                                                  const Eigen::VectorXd& residual) {
  const auto touches = TouchesOf(problem);
  DeclaredErrorKind kind{DeclaredErrorKind::What::kMove};
  std::pair<std::size_t, double> best{0, 0};
  kind.choices = 0;
  for (const ArtefactIndex artefact : touches.indices()) {
    const std::vector<Touch>& own = touches[artefact];
    if (own.size() < 2 * kMinRowsBetweenMoves) continue;
    kind.choices += static_cast<int>(own.size() - 2 * kMinRowsBetweenMoves + 1);
    const auto move = BestMove(problem, own, residual);
    if (move.second <= best.second) continue;
    best = move;
    kind.artefact = artefact;
  }
  if (best.second <= 0) return std::nullopt;
  const std::vector<Touch>& moved = touches[kind.artefact];
  kind.from = problem.rows()[moved[best.first].row];
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(problem.response().size(), kErrorAxes);
  for (std::size_t k = best.first; k < moved.size(); ++k) {
    problem.layout().PartOf(columns, moved[k].row) = moved[k].slopes;
  }
  return Scaled(problem, kind, std::move(columns), kShiftDeviation_m);
}

}  // namespace plumbline::measure
