#include "app/measure/diagnosis/discrepancy_design.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/measure/diagnosis/legendre.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

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
      design.of.size_columns.emplace_back(BlockIndex(design.of.blocks.size()), c);
    }
    design.of.blocks.push_back(block);
  }
}

void AddJointCurves(const CandidateSet& candidate_set, const Explanation& named,
                    DiscrepancyDesign& design) {
  const LinearProblem& problem = candidate_set.problem();
  const Dataset& data = problem.data();
  const int cycles = std::min(kMaxCycles, problem.clusters() / kClustersPerCycle);
  std::map<int, int> of_band;
  const auto add = [&](int joint, double of) {
    const std::optional<SignalIndex> signal = SignalOfJoint(data, joint);
    if (!signal) return;
    const auto [group, inserted] = of_band.emplace(BandOf(of), design.groups);
    if (inserted) ++design.groups;
    for (const bool cosine : {false, true}) {
      design.of.curves.push_back({joint, *signal, 0, of, cosine, 0});
      design.group.push_back(group->second);
    }
  };
  for (int joint = 0; joint < data.cell.robot.size(); ++joint) {
    for (int k = 1; k <= cycles; ++k) add(joint, k);
  }
  for (const BlockIndex index : named.blocks) {  // named lines at other cycles
    const std::optional<PeriodicLine> line = LineOf(candidate_set.blocks()[index]);
    if (!line) continue;
    const double of = line->cycles_per_turn;
    if (of != std::round(of) || of > cycles) add(line->joint, of);
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

}  // namespace

bool IsJointCurve(const Block& block) {
  return block.empirical() &&
         std::all_of(block.columns.begin(), block.columns.end(), [&](const BlockColumn& column) {
           return column.entry < model::kMaxJoints &&
                  block.term.drivers.front() == AngleColumn(column.entry);
         });
}

DiscrepancyDesign MakeDiscrepancyDesign(const CandidateSet& candidate_set, const Explanation& named,
                                        const Candidates& candidates) {
  DiscrepancyDesign design;
  AddBlocks(candidates, design);
  AddJointCurves(candidate_set, named, design);
  AddSignalCurves(candidate_set.problem().data(), design);
  return design;
}

double SignalAt(const Dataset& data, const CurveTerm& term, RowIndex row) {
  return data.signals[term.signal].values[row];
}

Eigen::MatrixXd ColumnsOf(const LinearProblem& problem, const DiscrepancyDesign& design) {
  Eigen::MatrixXd columns(problem.response().size(), static_cast<int>(design.group.size()));
  int at = 0;
  for (const Block& block : design.of.blocks) {
    const int width = block.columns.count();
    columns.middleCols(at, width) = problem.Columns(block, false);
    at += width;
  }
  Eigen::MatrixXd factor(problem.rows().count(), 1);
  for (const CurveTerm& term : design.of.curves) {
    for (const FitRowIndex j : problem.rows().indices()) {
      const double value = SignalAt(problem.data(), term, problem.rows()[j]);
      factor(j.value(), 0) = FactorAt(problem.data(), term, value);
    }
    columns.col(at++) = problem.Carried({term.entry}, factor);
  }
  return columns;
}

std::vector<int> NamedColumns(const CandidateSet& candidate_set, const Explanation& named,
                              const DiscrepancyDesign& design) {
  std::vector<int> chosen;
  const Coefficients of_named = candidate_set.CoefficientsOf(named);
  const auto holds = [&](const auto& alike) {
    return std::any_of(of_named.begin(), of_named.end(), [&](const auto& size) {
      const Block& block = candidate_set.blocks()[size.first.first];
      return alike(block, size.first.second);
    });
  };
  int at = 0;
  for (const auto& [index, column] : design.of.size_columns) {
    const Block& own = design.of.blocks[index];
    const bool is_named = holds([&, c = column](const Block& block, BlockColumnIndex other) {
      return block.id == own.id && block.term.word == own.term.word && c == other;
    });
    if (is_named) chosen.push_back(at);
    ++at;
  }
  for (const CurveTerm& term : design.of.curves) {
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

}  // namespace plumbline::measure
