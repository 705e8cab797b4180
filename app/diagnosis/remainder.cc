#include "app/diagnosis/remainder.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware-like/chi_square.h"

namespace plumbline {
namespace {

using I = Influence<double>;
constexpr double kMargin = 10;          // of 2 ln L, as an empirical term must beat the catalogue
constexpr int kMostCycles = 64;         // of a joint's curve
constexpr int kClustersPerCycle = 8;    // four for each of sine and cosine
constexpr int kMostDegree = 3;          // along a recorded signal
constexpr double kBandRatio = 1.4;      // neighbouring cycles share one prior variance
constexpr double kHoldsAnything = 0.5;  // of a parameter

/// A named curve of a joint along its own angle.
bool IsJointCurve(const Block& block) {
  return block.empirical() &&
         std::all_of(block.columns.begin(), block.columns.end(), [&](const BlockColumn& column) {
           return column.entry < kMaxJoints && block.term.drivers.front() == AngleOf(column.entry);
         });
}

/// What is fitted: blocks' columns, then curve terms, with their groups.
struct Design {
  Remainder of;
  std::vector<int> group;
  int groups = 0;
};

int BandOf(double cycles) {
  return static_cast<int>(std::log(std::max(1.0, cycles)) / std::log(kBandRatio));
}

int SignalOfJoint(const Dataset& data, int joint) {
  const std::string column = AngleOf(joint);
  for (std::size_t s = 0; s < data.signals.size(); ++s) {
    if (data.signals[s].column == column) return static_cast<int>(s);
  }
  return -1;
}

void AddBlocks(const Candidates& candidates, Design& design) {
  for (const Block& block : candidates.blocks) {
    if (Stays(block)) continue;
    std::map<std::string_view, int> of_unit;  // metres and radians are not of one size
    const auto& specs = block.term.effect->traits().parameters;
    for (std::size_t c = 0; c < block.columns.size(); ++c) {
      const int parameter = block.columns[c].parameter;
      const auto spec =
          static_cast<std::size_t>(block.term.parameters[static_cast<std::size_t>(parameter)].spec);
      const auto [group, fresh] = of_unit.emplace(specs[spec].unit, design.groups);
      if (fresh) ++design.groups;
      design.group.push_back(group->second);
      design.of.size_columns.emplace_back(static_cast<int>(design.of.blocks.size()),
                                          static_cast<int>(c));
    }
    design.of.blocks.push_back(block);
  }
}

void AddJointCurves(const Pool& pool, const Explanation& named, Design& design) {
  const LinearProblem& problem = pool.problem();
  const Dataset& data = problem.data();
  const int cycles = std::min(kMostCycles, problem.clusters() / kClustersPerCycle);
  std::map<int, int> of_band;
  const auto add = [&](int joint, double of) {
    const int signal = SignalOfJoint(data, joint);
    if (signal < 0) return;
    const auto [group, fresh] = of_band.emplace(BandOf(of), design.groups);
    if (fresh) ++design.groups;
    for (const bool cosine : {false, true}) {
      design.of.curves.push_back({joint, signal, 0, of, cosine, 0});
      design.group.push_back(group->second);
    }
  };
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    for (int k = 1; k <= cycles; ++k) add(joint, k);
  }
  for (const int index : named.blocks) {  // lines between whole cycles
    const Block& block = pool.blocks()[static_cast<std::size_t>(index)];
    if (block.id != "gear_periodic") continue;
    const double of = block.columns.front().values[1];
    if (of != std::round(of) || of > cycles) add(block.term.parameters.front().joint, of);
  }
}

void AddSignalCurves(const Dataset& data, Design& design) {
  for (int s = 0; s < static_cast<int>(data.signals.size()); ++s) {
    const RecordedSignal& signal = data.signals[static_cast<std::size_t>(s)];
    // A place in one file says nothing about another file's rows.
    if (signal.of_joint || signal.column == "row") continue;
    const int degree = std::min(kMostDegree, (signal.distinct - 1) / 2);
    if (degree < 1) continue;
    const auto add = [&](int entry) {
      for (int k = 1; k <= degree; ++k) {
        design.of.curves.push_back({entry, s, k, 0, false, 0});
        design.group.push_back(design.groups);
      }
    };
    for (int axis = 0; axis < 3; ++axis) add(I::kBase + axis);
    ++design.groups;
    for (int joint = 0; joint < data.cell.robot.size(); ++joint) add(joint);
    ++design.groups;
  }
}

double SignalAt(const Dataset& data, const CurveTerm& term, int row) {
  return data.signals[static_cast<std::size_t>(term.signal)].values[static_cast<std::size_t>(row)];
}

Eigen::MatrixXd ColumnsOf(const LinearProblem& problem, const Design& design) {
  Eigen::MatrixXd columns(problem.response().size(), static_cast<int>(design.group.size()));
  int at = 0;
  for (const Block& block : design.of.blocks) {
    const auto width = static_cast<int>(block.columns.size());
    columns.middleCols(at, width) = problem.Columns(block, false);
    at += width;
  }
  Eigen::MatrixXd factor(static_cast<int>(problem.rows().size()), 1);
  for (const CurveTerm& term : design.of.curves) {
    for (int j = 0; j < factor.rows(); ++j) {
      const int row = problem.rows()[static_cast<std::size_t>(j)];
      factor(j, 0) = FactorAt(problem.data(), term, SignalAt(problem.data(), term, row));
    }
    columns.col(at++) = problem.Carried({term.entry}, factor);
  }
  return columns;
}

/// Sum over the rows of the variances that the written effects have, each by itself.
double VarianceApart(const Design& design, const Eigen::MatrixXd& raw,
                     const Eigen::MatrixXd& covariance) {
  std::map<std::pair<int, int>, std::vector<int>> effects;  // blocks; then signal and influence
  int at = 0;
  for (const auto& [block, column] : design.of.size_columns) effects[{-1, block}].push_back(at++);
  for (const CurveTerm& term : design.of.curves) {
    effects[{term.signal, term.entry}].push_back(at++);
  }
  double sum = 0;
  for (const auto& [effect, columns] : effects) {
    const Eigen::MatrixXd own = raw(Eigen::all, columns);
    sum += (own * covariance(columns, columns)).cwiseProduct(own).sum();
  }
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

/// Columns of named effects alone, in the groups of the whole.
std::vector<int> NamedColumns(const Pool& pool, const Explanation& named, const Design& design) {
  std::vector<int> chosen;
  const Coefficients of_named = pool.CoefficientsOf(named);
  const auto holds = [&](const auto& alike) {
    return std::any_of(of_named.begin(), of_named.end(), [&](const auto& size) {
      const Block& block = pool.blocks()[static_cast<std::size_t>(size.first.first)];
      return alike(block, size.first.second);
    });
  };
  int at = 0;
  for (const auto& [index, column] : design.of.size_columns) {
    const Block& own = design.of.blocks[static_cast<std::size_t>(index)];
    const bool is_named = holds([&, c = column](const Block& block, int other) {
      return block.id == own.id && block.term.word == own.term.word && c == other;
    });
    if (is_named) chosen.push_back(at);
    ++at;
  }
  for (const CurveTerm& term : design.of.curves) {
    const bool is_named = holds([&](const Block& block, int) {
      return block.id == "gear_periodic" && term.degree == 0 &&
             block.term.parameters.front().joint == term.entry &&
             block.columns.front().values[1] == term.cycles;
    });
    if (is_named) chosen.push_back(at);
    ++at;
  }
  return chosen;
}

NormalEquations Part(const NormalEquations& equations, const std::vector<int>& columns) {
  NormalEquations part = equations;
  part.gram = equations.gram(columns, columns);
  part.moment = equations.moment(columns);
  return part;
}

/// Group numbers without gaps.
std::vector<int> Renumbered(const std::vector<int>& group, const std::vector<int>& columns) {
  std::map<int, int> numbers;
  std::vector<int> renumbered;
  for (const int column : columns) {
    const int own = group[static_cast<std::size_t>(column)];
    renumbered.push_back(numbers.emplace(own, static_cast<int>(numbers.size())).first->second);
  }
  return renumbered;
}

/// Of a fit's variances: each costs the logarithm of its group's columns, if it holds anything.
double VarianceCost(const ShrunkenFit& fit, const std::vector<int>& group) {
  double cost = 0;
  for (int g = 0; g < fit.held.size(); ++g) {
    if (fit.held[g] < kHoldsAnything) continue;
    cost += std::log(static_cast<double>(1 + std::count(group.begin(), group.end(), g)));
  }
  return cost;
}

/// True where the named effects leave no more than the noise that the cell declares, or repeats
/// show: then nothing is left to correct. Unknown noise leaves the question to the likelihood.
bool WithinNoise(const LinearProblem& problem, const Explanation& named) {
  constexpr double kChance = 0.01;  // of that much by noise alone
  const double told = problem.data().sigma_m;
  if (told <= 0) return false;
  const double freedom =
      std::max(1.0, problem.freedom() - static_cast<double>(named.columns.size()));
  const double ratio = problem.sigma_m() / told;
  return ChiSquareTail(named.chi2 * ratio * ratio, freedom) > kChance;
}

/// What choosing the named effects among all, and their shapes, costs.
double ChoiceCost(const Pool& pool, const Explanation& named) {
  double cost = pool.EffectCost() * static_cast<double>(EffectIds(pool, named).size());
  for (const int block : named.blocks) cost += pool.BlockCost(block);
  for (const int column : named.columns) {
    const auto index = static_cast<std::size_t>(pool.BlockOfColumn(column));
    const double clusters = pool.problem().clusters();
    if (IsJointCurve(pool.blocks()[index])) cost += std::log(clusters);
  }
  return cost;
}

}  // namespace

Vec3 DisplacementBy(const Remainder& remainder, const Dataset& data, const Linearisation& linear,
                    int row) {
  Vec3 sum = Vec3::Zero();
  Eigen::MatrixXd columns;
  for (std::size_t b = 0; b < remainder.blocks.size(); ++b) {
    const Block& block = remainder.blocks[b];
    columns.resize(3, static_cast<int>(block.columns.size()));
    ColumnsAt(data, linear, block, row, columns);
    for (int c = 0; c < columns.cols(); ++c) {
      sum += remainder.sizes.at({static_cast<int>(b), c}) * columns.col(c);
    }
  }
  const LinearRow& at = linear.rows[static_cast<std::size_t>(row)];
  for (const CurveTerm& term : remainder.curves) {
    if (term.value == 0) continue;
    sum += term.value * FactorAt(data, term, SignalAt(data, term, row)) * at.dp.col(term.entry);
  }
  return sum;
}

std::string AngleOf(int joint) {
  return "q" + std::to_string(joint + 1) + "_deg";
}

double FactorAt(const Dataset& data, const CurveTerm& term, double value) {
  const RecordedSignal& signal = data.signals[static_cast<std::size_t>(term.signal)];
  if (term.degree > 0) return Legendre(term.degree, Scaled(signal, value));
  const double angle = term.cycles * value * std::numbers::pi / 180;
  return term.cosine ? std::cos(angle) : std::sin(angle);
}

bool Stays(const Block& block) {
  static constexpr std::string_view kShaped[] = {"counterbalance", "tool_stiffness", "tool_shear",
                                                 "thermal_drift",  "step_event",     "empirical"};
  if (std::find(std::begin(kShaped), std::end(kShaped), block.id) == std::end(kShaped))
    return false;
  return !IsJointCurve(block);
}

std::optional<Remainder> RemainderOf(const Pool& pool, const Explanation& named,
                                     const Candidates& candidates, const Eigen::VectorXd& start) {
  const LinearProblem& problem = pool.problem();
  if (WithinNoise(problem, named)) return std::nullopt;
  Design design;
  AddBlocks(candidates, design);
  AddJointCurves(pool, named, design);
  AddSignalCurves(problem.data(), design);
  // What stays as it was named is taken out of the response.
  Explanation stays = named, curves = named;
  for (std::size_t k = 0; k < named.columns.size(); ++k) {
    const auto index = static_cast<std::size_t>(pool.BlockOfColumn(named.columns[k]));
    const Block& block = pool.blocks()[index];
    if (!Stays(block)) stays.values[static_cast<int>(k)] = 0;
    if (!Stays(block) && !block.empirical()) curves.values[static_cast<int>(k)] = 0;
  }
  const Eigen::VectorXd response = pool.Residual(stays);
  const Eigen::MatrixXd raw = ColumnsOf(problem, design);
  Eigen::MatrixXd columns = raw;
  problem.Project(columns);
  const NormalEquations equations = EquationsOf(columns, response, problem.freedom());
  const std::vector<int> own = NamedColumns(pool, named, design);
  // The named ones by themselves keep their curves, whose columns the search has charged.
  NormalEquations of_named = Part(equations, own);
  const Eigen::VectorXd left = pool.Residual(curves);
  of_named.moment = columns(Eigen::all, own).transpose() * left;
  of_named.square = left.squaredNorm();
  const std::vector<int> named_group = Renumbered(design.group, own);
  const ShrunkenFit alone = Shrink(of_named, named_group, {}, false);
  const ShrunkenFit whole = Shrink(equations, design.group, start, true);
  const double by_curves = problem.freedom() * std::log(equations.square / of_named.square);
  // A fit of everything makes no choice, but has more variances, each told by its group's columns.
  const double gain =
      whole.gain - VarianceCost(whole, design.group) -
      (alone.gain + by_curves - VarianceCost(alone, named_group) - ChoiceCost(pool, named));
  if (gain < kMargin) return std::nullopt;
  // Written effects count as independent; together they shall have the whole's variance at the
  // rows.
  const double jointly = whole.covariance.cwiseProduct(equations.gram).sum();
  const double apart = VarianceApart(design, raw, whole.covariance);
  Remainder remainder = std::move(design.of);
  int at = 0;
  for (const auto& column : remainder.size_columns) remainder.sizes[column] = whole.values[at++];
  for (CurveTerm& term : remainder.curves) term.value = whole.values[at++];
  remainder.covariance = whole.covariance * (apart > 0 ? jointly / apart : 0);
  remainder.ratio = whole.ratio;
  remainder.held = whole.held.sum();
  remainder.gain = gain;
  return remainder;
}

}  // namespace plumbline
