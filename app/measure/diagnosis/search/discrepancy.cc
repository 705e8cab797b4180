#include "app/measure/diagnosis/search/discrepancy.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/candidates.h"
#include "app/measure/diagnosis/linear/empirical_columns.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr int kMaxSteps = 60;
constexpr double kConverged = 0.05;  // change of 2 ln L
constexpr double kMinEffectiveParameters =
    1e-3;  // below it, the variance of a group is set to zero

/// Initial ratios, at which every group contributes a tenth of the square of y.
Eigen::VectorXd InitialRatios(const NormalEquations& equations, const std::vector<int>& group,
                              int groups) {
  Eigen::VectorXd trace = Eigen::VectorXd::Zero(groups);
  for (std::size_t k = 0; k < group.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    trace[group[k]] += equations.gram(at, at);
  }
  return trace.unaryExpr([&](double sum) { return sum > 0 ? 0.1 * equations.freedom / sum : 0; });
}

/// Upper limit of the ratio of each group.
Eigen::VectorXd RatioLimits(const NormalEquations& equations, const std::vector<int>& group,
                            int groups, double noise) {
  Eigen::VectorXd most = Eigen::VectorXd::Constant(groups, HUGE_VAL);
  if (equations.most_variance.size() == 0) return most;
  for (std::size_t k = 0; k < group.size(); ++k) {
    double& of_group = most[group[k]];
    of_group = std::min(of_group, equations.most_variance[static_cast<Eigen::Index>(k)] / noise);
  }
  return most;
}

/// Inverts a lower triangular matrix in place; its upper part is zero and stays so. By halves, a
/// third of the operations of solving for the identity.
void InvertLower(Eigen::Ref<Eigen::MatrixXd> L) {
  constexpr Eigen::Index kSmall = 32;
  const Eigen::Index n = L.rows(), half = n / 2, rest = n - half;
  if (n <= kSmall) {
    L = L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(n, n)).eval();
    return;
  }
  InvertLower(L.topLeftCorner(half, half));
  InvertLower(L.bottomRightCorner(rest, rest));
  const Eigen::MatrixXd left = L.bottomRightCorner(rest, rest).triangularView<Eigen::Lower>() *
                               L.bottomLeftCorner(rest, half);
  L.bottomLeftCorner(rest, half).noalias() =
      -(left * L.topLeftCorner(half, half).triangularView<Eigen::Lower>());
}

}  // namespace

ShrunkenFit Shrink(const NormalEquations& equations, const std::vector<int>& group,
                   const Eigen::VectorXd& start, bool with_covariance) {
  const auto n = static_cast<Eigen::Index>(group.size());
  const int groups = n > 0 ? *std::ranges::max_element(group) + 1 : 0;
  ShrunkenFit fit;
  fit.values = Eigen::VectorXd::Zero(n);
  fit.ratio = start.size() == groups ? start : InitialRatios(equations, group, groups);
  fit.effective_parameters = Eigen::VectorXd::Zero(groups);
  fit.noise = equations.square / std::max(1.0, equations.freedom);
  if (fit.noise > 0)
    fit.ratio = fit.ratio.cwiseMin(RatioLimits(equations, group, groups, fit.noise));
  if (n == 0 || equations.square <= 0) return fit;
  double previous_gain = -1e300;
  for (int step = 0; step < kMaxSteps; ++step) {
    // Columns of groups whose variance is zero are zero; they are left out.
    std::vector<Eigen::Index> active;
    for (Eigen::Index k = 0; k < n; ++k) {
      if (fit.ratio[group[k]] > 0) active.push_back(k);
    }
    const auto count = static_cast<Eigen::Index>(active.size());
    Eigen::VectorXd root(count);
    for (Eigen::Index k = 0; k < count; ++k) {
      root[k] = std::sqrt(fit.ratio[group[active[k]]]);
    }
    Eigen::MatrixXd A = root.asDiagonal() * equations.gram(active, active) * root.asDiagonal();
    A.diagonal().array() += 1;
    const Eigen::LLT<Eigen::MatrixXd> cholesky(A);
    const Eigen::VectorXd moment = equations.moment(active);
    fit.values.setZero();
    fit.values(active) = root.cwiseProduct(cholesky.solve(root.cwiseProduct(moment)));
    // Residual sum of squares including the penalty; kept positive despite rounding.
    const double residual =
        std::max(equations.square - fit.values.dot(equations.moment), 1e-12 * equations.square);
    fit.noise = residual / equations.freedom;
    Eigen::MatrixXd inverse = cholesky.matrixL();  // becomes that of L
    fit.gain = equations.freedom * std::log(equations.square / residual) -
               2 * inverse.diagonal().array().log().sum();
    InvertLower(inverse);
    Eigen::VectorXd square = Eigen::VectorXd::Zero(groups);
    fit.effective_parameters.setZero();
    for (Eigen::Index k = 0; k < count; ++k) {
      const int g = group[active[k]];
      fit.effective_parameters[g] += 1 - inverse.col(k).tail(count - k).squaredNorm();
      const double value = fit.values[active[k]];
      square[g] += value * value;
    }
    const bool converged = std::abs(fit.gain - previous_gain) < kConverged;
    if (converged || step + 1 == kMaxSteps) {
      if (with_covariance) {
        const Eigen::MatrixXd scaled = inverse * root.asDiagonal();
        fit.covariance = Eigen::MatrixXd::Zero(n, n);
        fit.covariance(active, active) = fit.noise * (scaled.transpose() * scaled);
      }
      break;
    }
    previous_gain = fit.gain;
    const Eigen::VectorXd most = RatioLimits(equations, group, groups, fit.noise);
    for (int g = 0; g < groups; ++g) {
      fit.ratio[g] = fit.effective_parameters[g] > kMinEffectiveParameters
                         ? std::min(most[g], square[g] / (fit.effective_parameters[g] * fit.noise))
                         : 0;
    }
  }
  return fit;
}

namespace {

// Columns of a discrepancy model and their grouping by prior variance.

/// Columns to fit: those of blocks, then curve terms, each assigned to a group.
struct DiscrepancyDesign {
  DiscrepancyModel model;
  std::vector<int> group;
  int groups = 0;
};

using I = effects::Influence<double>;
constexpr int kMaxCycles = 64;        // of a joint's curve
constexpr int kClustersPerCycle = 8;  // four each for sine and cosine
constexpr int kMaxDegree = 3;         // along a recorded signal
constexpr double kBandRatio = 1.4;    // cycles within this ratio share one prior variance

int BandOf(double cycles) {
  return static_cast<int>(std::log(std::max(1.0, cycles)) / std::log(kBandRatio));
}

std::optional<SignalIndex> SignalOfJoint(const Dataset& data, int joint) {
  const std::string column = AngleColumn(joint);
  for (const SignalIndex s : data.signals.indices()) {
    if (data.signals[s].column == column) return s;
  }
  return std::nullopt;
}

void AddBlocks(const Candidates& candidates, DiscrepancyDesign& design) {
  for (const Block& block : candidates.blocks) {
    if (IsExemptFromShrinkage(block)) continue;
    std::map<std::string_view, int> of_unit;  // metres and radians need variances of their own
    const auto& specs = block.term.effect->traits().parameters;
    for (const BlockColumnIndex c : block.columns.indices()) {
      const int parameter = block.columns[c].parameter;
      const auto spec =
          static_cast<std::size_t>(block.term.parameters[static_cast<std::size_t>(parameter)].spec);
      const auto [group, inserted] = of_unit.emplace(specs[spec].unit, design.groups);
      if (inserted) ++design.groups;
      design.group.push_back(group->second);
      design.model.size_columns.emplace_back(BlockIndex(design.model.blocks.size()), c);
    }
    design.model.blocks.push_back(block);
  }
}

void AddJointCurves(const CandidateSet& candidate_set, const Explanation& named,
                    DiscrepancyDesign& design) {
  const LinearProblem& problem = candidate_set.problem();
  const Dataset& data = problem.data();
  const int cycles = std::min(kMaxCycles, problem.clusters() / kClustersPerCycle);
  std::map<int, int> of_band;
  const auto add = [&](int joint, double cycles_per_turn) {
    const std::optional<SignalIndex> signal = SignalOfJoint(data, joint);
    if (!signal) return;
    const auto [group, inserted] = of_band.emplace(BandOf(cycles_per_turn), design.groups);
    if (inserted) ++design.groups;
    for (const bool cosine : {false, true}) {
      design.model.curves.push_back({joint, *signal, 0, cycles_per_turn, cosine, 0});
      design.group.push_back(group->second);
    }
  };
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    for (int k = 1; k <= cycles; ++k) add(joint, k);
  }
  for (const BlockIndex index : named.blocks) {  // named lines at other cycles
    const std::optional<PeriodicLine> line = LineOf(candidate_set.blocks()[index]);
    if (!line) continue;
    const double own = line->cycles_per_turn;
    if (own != std::round(own) || own > cycles) add(line->joint, own);
  }
}

void AddSignalCurves(const Dataset& data, DiscrepancyDesign& design) {
  for (const SignalIndex s : data.signals.indices()) {
    const RecordedSignal& signal = data.signals[s];
    // The row number in one file has no meaning for another file.
    if (signal.of_joint || signal.column == "row") continue;
    const int degree = std::min(kMaxDegree, (signal.distinct - 1) / 2);
    if (degree < 1) continue;
    const auto add = [&](int entry) {
      for (int k = 1; k <= degree; ++k) {
        design.model.curves.push_back({entry, s, k, 0, false, 0});
        design.group.push_back(design.groups);
      }
    };
    for (int axis = 0; axis < 3; ++axis) add(I::kBase + axis);
    ++design.groups;
    for (int joint = 0; joint < data.cell.robot.size(); ++joint) add(joint);
    ++design.groups;
  }
}

/// True for an empirical curve of a joint along its own angle.
bool IsJointCurve(const Block& block) {
  return block.empirical() && std::ranges::all_of(block.columns, [&](const BlockColumn& column) {
           return column.entry < model::kMaxJoints &&
                  block.term.drivers.front() == AngleColumn(column.entry);
         });
}

/// Every catalogue column that is not exempt, a curve of each joint, and curves along each recorded
/// signal.
DiscrepancyDesign MakeDiscrepancyDesign(const CandidateSet& candidate_set, const Explanation& named,
                                        const Candidates& candidates) {
  DiscrepancyDesign design;
  AddBlocks(candidates, design);
  AddJointCurves(candidate_set, named, design);
  AddSignalCurves(candidate_set.problem().data(), design);
  return design;
}

/// Value of the signal of a curve term at a row.
double SignalAt(const Dataset& data, const CurveTerm& term, RowIndex row) {
  return data.signals[term.signal].values[row];
}

/// Whitened columns of the design at the rows of the problem, not yet projected.
Eigen::MatrixXd ColumnsOf(const LinearProblem& problem, const DiscrepancyDesign& design) {
  Eigen::MatrixXd columns(problem.response().size(), static_cast<int>(design.group.size()));
  int at = 0;
  for (const Block& block : design.model.blocks) {
    const int width = block.columns.count();
    columns.middleCols(at, width) = problem.Columns(block, false);
    at += width;
  }
  Eigen::MatrixXd factor(problem.rows().count(), 1);
  for (const CurveTerm& term : design.model.curves) {
    for (const FitRowIndex j : problem.rows().indices()) {
      const double value = SignalAt(problem.data(), term, problem.rows()[j]);
      factor(j.value(), 0) = FactorAt(problem.data(), term, value);
    }
    columns.col(at++) = problem.Carried({term.entry}, factor);
  }
  return columns;
}

/// Indices of the design columns that belong to named effects.
std::vector<int> NamedColumns(const CandidateSet& candidate_set, const Explanation& named,
                              const DiscrepancyDesign& design) {
  std::vector<int> chosen;
  const Coefficients of_named = candidate_set.CoefficientsOf(named);
  const auto holds = [&](const auto& alike) {
    return std::ranges::any_of(of_named, [&](const auto& size) {
      const Block& block = candidate_set.blocks()[size.first.first];
      return alike(block, size.first.second);
    });
  };
  int at = 0;
  for (const auto& [index, column] : design.model.size_columns) {
    const Block& own = design.model.blocks[index];
    const bool is_named = holds([&, c = column](const Block& block, BlockColumnIndex other) {
      return block.id == own.id && block.term.word == own.term.word && c == other;
    });
    if (is_named) chosen.push_back(at);
    ++at;
  }
  for (const CurveTerm& term : design.model.curves) {
    const bool is_named = holds([&](const Block& block, BlockColumnIndex) {
      const std::optional<PeriodicLine> line = LineOf(block);
      return line && term.degree == 0 && line->joint == term.entry &&
             line->cycles_per_turn == term.cycles;
    });
    if (is_named) chosen.push_back(at);
    ++at;
  }
  return chosen;
}

constexpr double kMinEffective = 0.5;  // effective parameters of a group with a variance

/// Sum over the rows of the variances of the written effects, taken as independent.
double SumOfVariances(const DiscrepancyDesign& design, const Eigen::MatrixXd& raw,
                      const Eigen::MatrixXd& covariance) {
  std::map<BlockIndex, std::vector<int>> of_blocks;
  std::map<std::pair<SignalIndex, int>, std::vector<int>> of_curves;  // by signal and carrier
  int at = 0;
  for (const auto& [block, column] : design.model.size_columns) of_blocks[block].push_back(at++);
  for (const CurveTerm& term : design.model.curves) {
    of_curves[{term.signal, term.entry}].push_back(at++);
  }
  double sum = 0;
  const auto add = [&](const std::vector<int>& columns) {
    const Eigen::MatrixXd own = raw(Eigen::all, columns);
    sum += (own * covariance(columns, columns)).cwiseProduct(own).sum();
  };
  for (const auto& [block, columns] : of_blocks) add(columns);
  for (const auto& [curve, columns] : of_curves) add(columns);
  return sum;
}

NormalEquations EquationsOf(const Eigen::MatrixXd& columns, const Eigen::VectorXd& response,
                            double freedom) {
  NormalEquations equations;
  equations.gram = Eigen::MatrixXd::Zero(columns.cols(), columns.cols());
  equations.gram.selfadjointView<Eigen::Lower>().rankUpdate(columns.transpose());
  equations.gram = equations.gram.selfadjointView<Eigen::Lower>();
  equations.moment = columns.transpose() * response;
  equations.square = response.squaredNorm();
  equations.freedom = freedom;
  return equations;
}

NormalEquations Part(const NormalEquations& equations, const std::vector<int>& columns) {
  NormalEquations part = equations;
  part.gram = equations.gram(columns, columns);
  part.moment = equations.moment(columns);
  if (equations.most_variance.size() > 0) part.most_variance = equations.most_variance(columns);
  return part;
}

/// Groups of a subset of columns, renumbered without gaps.
std::vector<int> Renumbered(const std::vector<int>& group, const std::vector<int>& columns) {
  std::map<int, int> numbers;
  std::vector<int> renumbered;
  for (const int column : columns) {
    const int own = group[column];
    renumbered.push_back(numbers.emplace(own, static_cast<int>(numbers.size())).first->second);
  }
  return renumbered;
}

/// Cost of the estimated variances: ln(1 + columns) for each group with effective parameters.
double VarianceCost(const ShrunkenFit& fit, const std::vector<int>& group) {
  double cost = 0;
  for (int g = 0; g < fit.effective_parameters.size(); ++g) {
    if (fit.effective_parameters[g] < kMinEffective) continue;
    cost += std::log(static_cast<double>(1 + std::ranges::count(group, g)));
  }
  return cost;
}

/// True if the residual of the named effects is consistent with the declared noise, or that of the
/// replicates. If the noise is unknown, the marginal likelihood decides.
bool WithinNoise(const LinearProblem& problem, const Explanation& named) {
  const double sigma_m = problem.data().sigma_m;
  if (sigma_m <= 0) return false;
  const double freedom =
      std::max(1.0, problem.freedom() - static_cast<double>(named.columns.size()));
  const double ratio = problem.sigma_m() / sigma_m;
  return statistics::ChiSquareTail(named.chi2 * ratio * ratio, freedom) > kWithinNoiseSignificance;
}

/// Cost of selecting the named effects and their shapes among all.
double ChoiceCost(const CandidateSet& candidate_set, const Explanation& named) {
  double cost =
      candidate_set.EffectCost() * static_cast<double>(EffectIds(candidate_set, named).size());
  for (const BlockIndex block : named.blocks) cost += candidate_set.BlockCost(block);
  for (const ColumnIndex column : named.columns) {
    const double clusters = candidate_set.problem().clusters();
    if (IsJointCurve(candidate_set.blocks()[candidate_set.BlockOfColumn(column)]))
      cost += std::log(clusters);
  }
  return cost;
}

}  // namespace

std::string AngleColumn(int joint) {
  return model::JointColumnName(model::JointQuantity::kPosition, model::JointType::kRevolute,
                                joint);
}

double FactorAt(const Dataset& data, const CurveTerm& term, double value) {
  const RecordedSignal& signal = data.signals[term.signal];
  if (term.degree > 0) return Legendre(term.degree, Scaled(signal, value));
  const double angle = term.cycles * value * std::numbers::pi / 180;
  return term.cosine ? std::cos(angle) : std::sin(angle);
}

bool IsExemptFromShrinkage(const Block& block) {
  if (block.empirical()) return !IsJointCurve(block);
  return !LineOf(block) && !IsLinear(block.term);
}

RowResidual DisplacementBy(const DiscrepancyModel& discrepancy, const Dataset& data,
                           const Linearisation& linear, RowIndex row) {
  const Gradient& at = linear.gradients[row];
  RowResidual sum = RowResidual::Zero(at.rows());
  Eigen::MatrixXd columns;
  for (const BlockIndex b : discrepancy.blocks.indices()) {
    const Block& block = discrepancy.blocks[b];
    columns.resize(at.rows(), block.columns.count());
    ColumnsAt(data, linear, block, row, columns);
    for (const BlockColumnIndex c : block.columns.indices()) {
      sum += discrepancy.sizes.at({b, c}) * columns.col(c.value());
    }
  }
  for (const CurveTerm& term : discrepancy.curves) {
    if (term.value == 0) continue;
    sum += term.value * FactorAt(data, term, SignalAt(data, term, row)) * at.col(term.entry);
  }
  return sum;
}

std::optional<DiscrepancyModel> DiscrepancyModelOf(const CandidateSet& candidate_set,
                                                   const Explanation& named,
                                                   const Candidates& candidates) {
  const LinearProblem& problem = candidate_set.problem();
  if (WithinNoise(problem, named)) return std::nullopt;
  DiscrepancyDesign design = MakeDiscrepancyDesign(candidate_set, named, candidates);
  // Exempt named blocks are subtracted from the response.
  Explanation exempt = named, curves = named;
  for (std::size_t k = 0; k < named.columns.size(); ++k) {
    const Block& block = candidate_set.blocks()[candidate_set.BlockOfColumn(named.columns[k])];
    if (!IsExemptFromShrinkage(block)) exempt.values[static_cast<int>(k)] = 0;
    if (!IsExemptFromShrinkage(block) && !block.empirical()) curves.values[static_cast<int>(k)] = 0;
  }
  const Eigen::VectorXd response = candidate_set.Residual(exempt);
  const Eigen::MatrixXd raw = ColumnsOf(problem, design);
  Eigen::MatrixXd columns = raw;
  problem.Project(columns);
  NormalEquations equations = EquationsOf(columns, response, problem.freedom());
  // Limits each column to a displacement of the total residual. Columns that the free frames almost
  // reproduce would exceed it: they cancel at these rows and nowhere else.
  const double squares = candidate_set.chi2_null();
  equations.most_variance = raw.colwise().squaredNorm().transpose().unaryExpr(
      [squares](double square) { return square > 0 ? squares / square : 0.0; });
  const std::vector<int> own = NamedColumns(candidate_set, named, design);
  // The named effects alone include their curves; the search has already charged those columns.
  NormalEquations of_named = Part(equations, own);
  const Eigen::VectorXd left = candidate_set.Residual(curves);
  of_named.moment = columns(Eigen::all, own).transpose() * left;
  of_named.square = left.squaredNorm();
  const std::vector<int> named_group = Renumbered(design.group, own);
  const ShrunkenFit alone = Shrink(of_named, named_group, {}, false);
  const ShrunkenFit whole = Shrink(equations, design.group, {}, true);
  const double by_curves = problem.freedom() * std::log(equations.square / of_named.square);
  // The full fit pays for its variances, but not for a selection; the named effects pay for both.
  const double gain = whole.gain - VarianceCost(whole, design.group) -
                      (alone.gain + by_curves - VarianceCost(alone, named_group) -
                       ChoiceCost(candidate_set, named));
  if (gain < kDiscrepancyMargin) return std::nullopt;
  // Written effects are treated as independent. Scale their covariance so that their summed
  // variance at the rows equals the joint one.
  const double jointly = whole.covariance.cwiseProduct(equations.gram).sum();
  const double separately = SumOfVariances(design, raw, whole.covariance);
  DiscrepancyModel discrepancy = std::move(design.model);
  int at = 0;
  for (const auto& column : discrepancy.size_columns)
    discrepancy.sizes[column] = whole.values[at++];
  for (CurveTerm& term : discrepancy.curves) term.value = whole.values[at++];
  discrepancy.covariance = whole.covariance * (separately > 0 ? jointly / separately : 0);
  discrepancy.effective_parameters = whole.effective_parameters.sum();
  discrepancy.gain = gain;
  return discrepancy;
}

}  // namespace plumbline::measure
