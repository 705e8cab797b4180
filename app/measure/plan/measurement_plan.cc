#include "app/measure/plan/measurement_plan.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>

#include "app/measure/diagnosis/linear/candidates.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/linearisation.h"
#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "app/measure/plan/visit_order.h"
#include "firmware-like/loads/numbered_load.h"
#include "firmware-like/statistics/random_sequence.h"

namespace plumbline::measure {
namespace {

constexpr double kWorthExchange = 1e-6;

/// Gain in log det by adding a row: log det(1 + X H^-1 X^T).
double GainOf(const Eigen::MatrixXd& X, const Eigen::MatrixXd& inverse) {
  const Eigen::MatrixXd S =
      Eigen::MatrixXd::Identity(X.rows(), X.rows()) + X * inverse * X.transpose();
  return LogDeterminant(S);
}

Eigen::MatrixXd Inverted(const Eigen::MatrixXd& H) {
  return H.ldlt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols()));
}

/// The unused row with the largest gain.
int BestRow(const std::vector<Eigen::MatrixXd>& rows, const std::vector<bool>& used,
            const Eigen::MatrixXd& inverse, double& gain) {
  int best = -1;
  gain = -1;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (used[i]) continue;
    const double of_row = GainOf(rows[i], inverse);
    if (of_row > gain) gain = of_row, best = static_cast<int>(i);
  }
  return best;
}

}  // namespace

double LogDeterminant(const Eigen::MatrixXd& matrix) {
  return 2 * Eigen::MatrixXd(matrix.llt().matrixL()).diagonal().array().log().sum();
}

Eigen::MatrixXd Information(const std::vector<Eigen::MatrixXd>& rows,
                            const std::vector<int>& selected) {
  const Eigen::Index size = rows.empty() ? 0 : rows.front().cols();
  Eigen::MatrixXd H = Eigen::MatrixXd::Identity(size, size);
  for (const int i : selected) {
    const Eigen::MatrixXd& X = rows[i];
    H += X.transpose() * X;
  }
  return H;
}

std::vector<int> DOptimalRows(const std::vector<Eigen::MatrixXd>& rows, int count, int passes) {
  std::vector<bool> used(rows.size(), false);
  std::vector<int> selected;
  double gain = 0;
  while (static_cast<int>(selected.size()) < std::min(count, static_cast<int>(rows.size()))) {
    const int best = BestRow(rows, used, Inverted(Information(rows, selected)), gain);
    used[best] = true;
    selected.push_back(best);
  }
  for (int pass = 0; pass < passes; ++pass) {
    bool exchanged = false;
    for (int& row : selected) {
      const Eigen::MatrixXd& X = rows[row];
      const Eigen::MatrixXd inverse = Inverted(Information(rows, selected) - X.transpose() * X);
      const double kept = GainOf(X, inverse);
      const int best = BestRow(rows, used, inverse, gain);
      if (best < 0 || gain < kept + kWorthExchange) continue;
      used[row] = false;
      used[best] = true;
      row = best;
      exchanged = true;
    }
    if (!exchanged) break;
  }
  return selected;
}

namespace {

constexpr int kTriesPerCandidate = 60;
constexpr int kExchangePasses = 4;
constexpr double kLargestScale = 1e6;  // sizes without a plausible range are not planned for

/// Draws safe postures, on the artefacts in turn or anywhere.
class CandidatePostures {
 public:
  CandidatePostures(const model::CellModel& cell, const PlanTask& task, const PostureCheck& check)
      : cell_(cell), task_(task), check_(check) {}

  std::vector<PlannedRow> Draw() {
    std::vector<PlannedRow> rows;
    for (int tries = task_.candidates * kTriesPerCandidate; tries > 0; --tries) {
      if (static_cast<int>(rows.size()) >= task_.candidates) break;
      PlannedRow row;
      row.q = RandomPosture();
      if (!task_.artefacts.empty()) {
        row.artefact = task_.artefacts[rows.size() % task_.artefacts.size()];
        if (!Touch(row)) continue;
      } else if (!check_.IsSafe(row.q)) {
        continue;
      }
      if (!task_.payloads_kg.empty()) {
        row.payload_kg = task_.payloads_kg[random_.Below(task_.payloads_kg.size())];
      }
      if (!cell_.payload_items.empty()) {
        const std::vector<int>& items = task_.payload_items;
        row.payload_item = items.empty() ? 0 : items[random_.Below(items.size())];
      }
      row.tool_number = cell_.tool.number;
      row.X_WT = cell_.robot.X_WB * check_.arm().UnloadedTip(row.q);
      rows.push_back(std::move(row));
    }
    return rows;
  }

 private:
  model::JointVector RandomPosture() {
    model::JointVector u(cell_.robot.size());
    for (double& value : u) value = random_.Uniform();
    return check_.FromUnit(u);
  }

  /// Moves the tip onto the artefact of the row.
  bool Touch(PlannedRow& row) const {
    const auto artefact = std::ranges::find_if(
        cell_.artefacts, [&](const model::Artefact& one) { return one.name == row.artefact; });
    const Pose X_WA = artefact->in_base ? cell_.robot.X_WB : Pose();
    const Vec3 place = X_WA * *artefact->place;
    if (artefact->kind == model::ArtefactKind::kPlane) {
      return check_.MoveTipTo(place, X_WA.R * *artefact->direction, row.q);
    }
    Vec3 target = place;
    if (artefact->kind == model::ArtefactKind::kSphere) {
      // The point of the sphere towards the tip of the random posture.
      const Vec3 tip = cell_.robot.X_WB * check_.arm().UnloadedTip(row.q).p;
      target += artefact->radius_m.value_or(0) * (tip - place).normalized();
    }
    return check_.MoveTipTo(target, Mat3::Identity(), row.q);
  }

  const model::CellModel& cell_;
  const PlanTask& task_;
  const PostureCheck& check_;
  statistics::RandomSequence random_{1};
};

/// The tool and the payload items of the task are declared.
std::optional<Error> LoadProblem(const model::CellModel& cell, const PlanTask& task) {
  const auto no_such = [](const char* table, int number, const char* option) {
    return Error{fmt::format("has no [[{}]] with number = {}; declare it or correct {}", table,
                             number, option)};
  };
  if (task.tool_number) {
    bool found = false;
    for (int k = 0; k < cell.tools(); ++k) {
      found = found || cell.ToolAt(k).number == task.tool_number;
    }
    if (!found) return no_such("tool", *task.tool_number, "--tool");
  }
  for (const int item : task.payload_items) {
    if (item != 0 && loads::ItemOf(cell, item) == nullptr) {
      return no_such("payload.item", item, "--payload-items");
    }
  }
  return std::nullopt;
}

/// The cell with the tool of that number as its first.
model::CellModel WithToolFirst(model::CellModel cell, std::optional<int> number) {
  for (model::Tool& other : cell.further_tools) {
    if (number && other.number == number) std::swap(cell.tool, other);
  }
  return cell;
}

/// The artefacts of the task exist and can be reached for.
std::optional<Error> ArtefactProblem(const model::CellModel& cell, const PlanTask& task) {
  for (const std::string& name : task.artefacts) {
    const auto found = std::ranges::find_if(
        cell.artefacts, [&](const model::Artefact& one) { return one.name == name; });
    if (found == cell.artefacts.end()) {
      return Error{
          fmt::format("has no [[artefact]] \"{}\"; declare it or correct --artefacts", name)};
    }
    if (!found->place || (found->kind == model::ArtefactKind::kPlane && !found->direction)) {
      return Error{fmt::format(
          "artefact \"{}\": its place is unknown, so no posture can be planned on it; give its "
          "approximate xyz_mm (a plane: and normal) with sd_mm",
          name)};
    }
  }
  return std::nullopt;
}

MeasuredTable TableOf(const model::CellModel& cell, const std::vector<PlannedRow>& rows,
                      const PlanTask& task) {
  MeasuredTable table;
  table.recorded.position = task.artefacts.empty();
  table.recorded.artefact = !task.artefacts.empty();
  table.recorded.payload = !task.payloads_kg.empty();
  table.recorded.tool = cell.tools() > 1;
  table.recorded.item = !cell.payload_items.empty();
  table.recorded.order = false;  // the order of a plan is chosen afterwards
  for (std::size_t i = 0; i < rows.size(); ++i) {
    MeasuredRow& row = table.rows.emplace_back();
    row.line = static_cast<int>(i) + 2;
    row.q = rows[i].q;
    row.tool_number = rows[i].tool_number;
    row.payload_item = rows[i].payload_item;
    if (table.recorded.payload) row.payload_kg = rows[i].payload_kg;
    if (table.recorded.position) row.measured_W = rows[i].X_WT.p;
    row.artefact = rows[i].artefact;
    const bool gauge = std::ranges::any_of(cell.artefacts, [&](const model::Artefact& one) {
      return one.name == row.artefact && one.kind == model::ArtefactKind::kGauge;
    });
    if (!gauge) continue;
    row.gauge_m = 0;  // any reading: a plan depends on the derivatives only
    table.recorded.gauge = true;
  }
  return table;
}

/// One parameter of an effect, and the size by which its column is scaled.
struct PlannedParameter {
  std::size_t block = 0;
  double scale = 0;
};

/// The whitened columns of every candidate: parameters of the effects, then nuisances.
struct Columns {
  std::vector<Block> blocks;
  std::vector<PlannedParameter> parameters;
  std::vector<Eigen::MatrixXd> rows;
};

Columns ColumnsOf(const Dataset& data, const Linearisation& linear, double sigma_m) {
  Columns columns;
  columns.blocks = CandidatesFor(data).blocks;
  std::vector<double> scales;
  for (std::size_t b = 0; b < columns.blocks.size(); ++b) {
    for (const BlockColumn& column : columns.blocks[b].columns) {
      const double scale = column.Largest() < kLargestScale ? column.Largest() : 0;
      columns.parameters.push_back({b, scale});
      scales.push_back(scale);
    }
  }
  const Eigen::VectorXd scale =
      Eigen::Map<const Eigen::VectorXd>(scales.data(), static_cast<Eigen::Index>(scales.size()));
  const Nuisances nuisances(data);
  for (const RowIndex row : data.row_indices()) {
    const int count = linear.layout.count(row);
    Eigen::MatrixXd X = Eigen::MatrixXd::Zero(count, scale.size() + nuisances.size());
    Eigen::Index at = 0;
    for (const Block& block : columns.blocks) {
      Eigen::MatrixXd own(count, block.columns.count());
      ColumnsAt(data, linear, block, row, own);
      X.middleCols(at, own.cols()) = own;
      at += own.cols();
    }
    X.leftCols(scale.size()) *= scale.asDiagonal();
    nuisances.Fill(linear.rows[row], row, X.rightCols(nuisances.size()));
    const RowWhitening whitening(data.numbers[row], 1 / sigma_m);
    whitening.Apply(X.eval(), X);
    columns.rows.push_back(std::move(X));
  }
  return columns;
}

/// Standard deviations of all parameters after the selected rows; before them they are 1.
Eigen::VectorXd DeviationsAfter(const Columns& columns, const std::vector<int>& selected) {
  const Eigen::MatrixXd H = Information(columns.rows, selected);
  return H.ldlt().solve(Eigen::MatrixXd::Identity(H.rows(), H.cols())).diagonal().cwiseSqrt();
}

double MedianOf(std::vector<double> values) {
  if (values.empty()) return 1;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

std::vector<EffectDetermination> Determinations(const Columns& columns,
                                                const std::vector<int>& planned,
                                                const std::vector<int>& random) {
  const Eigen::VectorXd of_plan = DeviationsAfter(columns, planned);
  const Eigen::VectorXd of_random = DeviationsAfter(columns, random);
  std::vector<EffectDetermination> all;
  for (std::size_t b = 0; b < columns.blocks.size(); ++b) {
    std::vector<double> after_plan, after_random;
    for (std::size_t k = 0; k < columns.parameters.size(); ++k) {
      const PlannedParameter& parameter = columns.parameters[k];
      if (parameter.block != b || parameter.scale == 0) continue;
      after_plan.push_back(of_plan[static_cast<Eigen::Index>(k)]);
      after_random.push_back(of_random[static_cast<Eigen::Index>(k)]);
    }
    if (after_plan.empty()) continue;
    all.push_back({columns.blocks[b].id, static_cast<int>(after_plan.size()), MedianOf(after_plan),
                   MedianOf(after_random)});
  }
  return all;
}

/// Indices of the rows with the same payload, tool and item, in the order of these numbers: what is
/// carried is changed as seldom as possible.
std::vector<std::vector<std::size_t>> RowsByLoad(const std::vector<PlannedRow>& rows) {
  using Load = std::tuple<std::optional<double>, std::optional<int>, std::optional<int>>;
  std::map<Load, std::vector<std::size_t>> by_load;
  for (std::size_t k = 0; k < rows.size(); ++k)
    by_load[{rows[k].payload_kg, rows[k].tool_number, rows[k].payload_item}].push_back(k);
  std::vector<std::vector<std::size_t>> groups;
  groups.reserve(by_load.size());
  for (auto& [load, indices] : by_load) groups.push_back(std::move(indices));
  return groups;
}

/// Orders the rows of a plan by load, and for short moves with each load; states how long the moves
/// take.
void Order(const PostureCheck& check, const model::JointVector& speeds, MeasurementPlan& plan) {
  std::vector<model::JointVector> postures;
  postures.reserve(plan.rows.size());
  for (const PlannedRow& row : plan.rows) postures.push_back(row.q);
  const std::vector<std::vector<std::size_t>> groups = RowsByLoad(plan.rows);
  plan.load_changes = std::max(0, static_cast<int>(groups.size()) - 1);
  std::vector<std::size_t> order;
  for (const std::vector<std::size_t>& group : groups) {
    std::vector<model::JointVector> of_group;
    of_group.reserve(group.size());
    for (const std::size_t k : group) of_group.push_back(postures[k]);
    const auto is_free = [&](std::size_t from, std::size_t to) {
      return check.IsMoveFree(of_group[from], of_group[to]);
    };
    for (const std::size_t k : VisitOrder(of_group, speeds, is_free)) order.push_back(group[k]);
  }
  std::vector<std::size_t> as_chosen(order.size());
  std::iota(as_chosen.begin(), as_chosen.end(), std::size_t{0});
  const double unordered = PathCost(postures, as_chosen, speeds);
  const double ordered = PathCost(postures, order, speeds);
  if (unordered > 0) plan.path_share = ordered / unordered;
  if (speeds.size() > 0) plan.moves_s = ordered;
  std::vector<PlannedRow> rows;
  for (const std::size_t k : order) {
    rows.push_back(plan.rows[k]);
    const std::size_t count = rows.size();
    rows.back().move_checked = count > 1 && check.IsMoveFree(rows[count - 2].q, rows.back().q);
  }
  plan.rows = std::move(rows);
}

}  // namespace

Result<MeasurementPlan> PlanMeasurements(const model::CellModel& declared, const PlanTask& task) {
  if (const auto problem = ArtefactProblem(declared, task)) return *problem;
  if (const auto problem = LoadProblem(declared, task)) return *problem;
  model::CellModel cell = WithToolFirst(declared, task.tool_number);
  if (!cell.measurement.sigma_m) cell.measurement.sigma_m = task.sigma_m;
  const PostureCheck check(cell, task.rules);
  PlanTask enough = task;
  enough.candidates = std::max(task.candidates, 4 * task.rows);
  const std::vector<PlannedRow> candidates = CandidatePostures(cell, enough, check).Draw();
  if (static_cast<int>(candidates.size()) < 2 * task.rows) {
    return Error{fmt::format(
        "only {} safe postures were found for {} rows; relax the floor, the link radius or the "
        "joint limits, or move the artefacts into reach",
        candidates.size(), task.rows)};
  }
  const Result<Dataset> data = DatasetFrom(cell, TableOf(cell, candidates, task));
  if (!data) return data.failure();
  const auto linear = Linearise(*data, Model::Declared(*data), true, task.threads);
  if (!linear) return linear.failure();
  const Columns columns = ColumnsOf(*data, *linear, *cell.measurement.sigma_m);
  const std::vector<int> selected = DOptimalRows(columns.rows, task.rows, kExchangePasses);
  std::vector<int> random(static_cast<std::size_t>(task.rows));  // candidates are in random order
  std::iota(random.begin(), random.end(), 0);

  MeasurementPlan plan;
  plan.candidates = static_cast<int>(candidates.size());
  for (const int i : selected) plan.rows.push_back(candidates[i]);
  Order(check, task.joint_speeds, plan);
  plan.effects = Determinations(columns, selected, random);
  const double gained = LogDeterminant(Information(columns.rows, selected)) -
                        LogDeterminant(Information(columns.rows, random));
  plan.efficiency = std::exp(gained / static_cast<double>(columns.rows.front().cols()));
  for (const ExcludedCandidate& one : CandidatesFor(*data).excluded) {
    plan.excluded.push_back(one.id + ": " + one.reason);
  }
  return plan;
}

}  // namespace plumbline::measure
