#include "app/diagnosis/wrong_tip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/diagnosis/diagnosis_text.h"
#include "app/diagnosis/explanation_checks.h"
#include "app/diagnosis/support_fit.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline::diagnosis {
namespace {

using I = effects::Influence<double>;

constexpr int kTipAxes = 3;
/// Standard deviation of the prior of each component. A judgement: larger errors of a tip are found
/// as gross errors.
constexpr double kTipDeviation_m = 0.01;
constexpr double kAbsorbedTip = 1e-3;  // share of a column that the nuisances must leave

/// Whitened and projected columns of the tip of one tool, scaled to unit length.
struct TipColumns {
  Eigen::MatrixXd columns;
  Vec3 length;
};

/// @return  nullopt if the tool has none of the rows or all of them, or if the nuisances absorb its
///          tip
std::optional<TipColumns> TipColumnsOf(const LinearProblem& problem, int tool) {
  Eigen::MatrixXd of_tool(static_cast<Eigen::Index>(problem.rows().size()), 1);
  Eigen::Index at = 0;
  for (const RowIndex row : problem.rows()) {
    of_tool(at++, 0) = problem.data().payloads[row].tool == tool ? 1 : 0;
  }
  if (of_tool.maxCoeff() == 0 || of_tool.minCoeff() == 1) return std::nullopt;
  TipColumns tip;
  tip.columns = problem.Carried({I::kTip, I::kTip + 1, I::kTip + 2}, of_tool);
  const Vec3 before = tip.columns.colwise().norm();
  problem.Project(tip.columns);
  tip.length = tip.columns.colwise().norm();
  for (int axis = 0; axis < kTipAxes; ++axis) {
    if (!(tip.length[axis] > kAbsorbedTip * before[axis])) return std::nullopt;
    tip.columns.col(axis) /= tip.length[axis];
  }
  return tip;
}

/// Precision of the prior of a column scaled to unit length.
double PrecisionOf(const CandidateSet& candidate_set, ColumnIndex column) {
  const Block& block = candidate_set.blocks()[candidate_set.BlockOfColumn(column)];
  const double deviation = candidate_set.Displacement(column, 1).norm() *
                           block.columns[candidate_set.WithinBlock(column)].Largest();
  return deviation > 0 ? 1 / (deviation * deviation) : 0;
}

/// The units of an explanation. The cost of a block and its effect is divided among its units.
std::vector<SupportFit::Unit> UnitsOf(const CandidateSet& candidate_set,
                                      const std::vector<ColumnIndex>& columns, double lenience) {
  std::vector<SupportFit::Unit> units;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const BlockIndex block = candidate_set.BlockOfColumn(columns[k]);
    const int number = candidate_set.UnitOfColumn(columns[k]);
    const auto same = std::find_if(units.begin(), units.end(), [&](const SupportFit::Unit& unit) {
      return unit.block == block && unit.number == number;
    });
    const int place = static_cast<int>(k);
    if (same == units.end()) {
      units.push_back({block, number, {place}, candidate_set.UnitCost(block, number) + lenience});
    } else {
      same->places.push_back(place);
    }
  }
  for (SupportFit::Unit& unit : units) {
    const auto of_block = std::count_if(
        units.begin(), units.end(), [&](const auto& other) { return other.block == unit.block; });
    unit.cost += (candidate_set.BlockCost(unit.block) +
                  candidate_set.EffectCost() * candidate_set.Inflation(unit.block)) /
                 static_cast<double>(of_block);
  }
  return units;
}

/// Fit of a tip beside those columns of the answer that are worth their cost.
struct TipFit {
  std::vector<ColumnIndex> kept;
  Vec3 offset_F;
  double minimum = 0;  ///< chi2 plus the prior
};

/// @param lenience  a unit is dropped if chi2 then rises by less than its cost plus this
TipFit FitTip(const CandidateSet& candidate_set, const std::vector<ColumnIndex>& columns,
              const TipColumns& tip, double lenience) {
  const auto count = static_cast<int>(columns.size());
  const Eigen::VectorXd& response = candidate_set.problem().response();
  Eigen::MatrixXd all(response.size(), count + kTipAxes);
  Eigen::VectorXd precision(count + kTipAxes);
  for (int k = 0; k < count; ++k) {
    const ColumnIndex column = columns[static_cast<std::size_t>(k)];
    all.col(k) = candidate_set.columns().col(column.value());
    precision[k] = PrecisionOf(candidate_set, column);
  }
  all.rightCols(kTipAxes) = tip.columns;
  precision.tail(kTipAxes) = (kTipDeviation_m * tip.length).array().square().inverse();
  Eigen::MatrixXd gram = all.transpose() * all;
  gram.diagonal() += precision;
  std::vector<SupportFit::Unit> units = UnitsOf(candidate_set, columns, lenience);
  // Without a cost, the tip is never dropped.
  units.push_back({BlockIndex(), -1, {count, count + 1, count + 2}, 0});
  SupportFit fit(gram, all.transpose() * response, response.squaredNorm(), std::move(units));
  fit.Eliminate();
  TipFit found;
  found.minimum = fit.minimum();
  for (const int place : fit.Places()) {
    if (place < count) found.kept.push_back(columns[static_cast<std::size_t>(place)]);
  }
  for (int axis = 0; axis < kTipAxes; ++axis) {
    found.offset_F[axis] = fit.Value(count + axis) / tip.length[axis];
  }
  return found;
}

/// Score of these columns, and the part of it that is cost.
struct ColumnScore {
  double score = 0, cost = 0;
};

ColumnScore ScoreOf(const CandidateSet& candidate_set, const std::vector<ColumnIndex>& columns) {
  if (columns.empty()) return {candidate_set.problem().response().squaredNorm(), 0};
  const Explanation fit = candidate_set.FitColumns(columns);
  return {fit.score, fit.score - fit.chi2 - fit.prior};
}

/// Cost of the tip: that of an effect with three parameters, and the choice among the tools.
double CostOfTip(const CandidateSet& candidate_set) {
  const LinearProblem& problem = candidate_set.problem();
  const double rho = problem.fit().row_correlation;
  const double inflation = (1 + rho) / (1 - rho);
  return inflation * (kTipAxes * std::log(static_cast<double>(problem.clusters())) +
                      candidate_set.EffectCost() +
                      2 * std::log(static_cast<double>(problem.data().cell.tools())));
}

std::vector<BlockIndex> BlocksOf(const CandidateSet& candidate_set,
                                 const std::vector<ColumnIndex>& columns) {
  std::set<BlockIndex> blocks;
  for (const ColumnIndex column : columns) blocks.insert(candidate_set.BlockOfColumn(column));
  return {blocks.begin(), blocks.end()};
}

/// @return  nullopt if the tip is neither certain nor a rival
std::optional<WrongTip> WrongTipFrom(const Identified& found, int tool, const TipFit& fit) {
  const CandidateSet& candidate_set = *found.candidate_set;
  const std::vector<ColumnIndex>& columns = found.best.columns;
  const ColumnScore kept = ScoreOf(candidate_set, fit.kept);
  const double score = fit.minimum + kept.cost + CostOfTip(candidate_set);
  const Dataset& data = found.fit.data;
  WrongTip tip;
  tip.tool_number = data.cell.ToolAt(tool).number.value_or(0);
  tip.offset_F = fit.offset_F;
  tip.evidence_gap = score - ScoreOf(candidate_set, columns).score;
  tip.sigma_m = data.sigma_m;
  const double left_m =
      found.fit.sigma_m * std::sqrt(fit.minimum / std::max(1.0, candidate_set.problem().freedom()));
  tip.within_noise = left_m < kExcessNoiseRatio * data.sigma_m;
  std::vector<ColumnIndex> replaced;
  std::set_difference(columns.begin(), columns.end(), fit.kept.begin(), fit.kept.end(),
                      std::back_inserter(replaced));
  tip.beside = BlocksOf(candidate_set, fit.kept);
  tip.instead_of = BlocksOf(candidate_set, replaced);
  const bool needed = score < kept.score;
  const bool rival = tip.evidence_gap <= kRivalGap && !replaced.empty();
  if (!needed || !(tip.certain() || rival)) return std::nullopt;
  return tip;
}

std::vector<std::string> NamesOfBlocks(const Identified& found,
                                       const std::vector<BlockIndex>& blocks) {
  std::vector<std::string> names;
  for (const BlockIndex block : blocks) {
    const std::string name = EffectName(found.candidate_set->blocks()[block].id);
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

std::string TipText(const WrongTip& tip) {
  const Vec3 mm = 1e3 * tip.offset_F;
  return fmt::format(
      "the tip of tool {} is ({:.2f}, {:.2f}, {:.2f}) mm from the declared one, in "
      "the flange frame",
      tip.tool_number, mm.x(), mm.y(), mm.z());
}

}  // namespace

bool WrongTip::certain() const {
  return within_noise && evidence_gap < -kMistakeMargin;
}

std::optional<WrongTip> WrongTipOf(const Identified& found) {
  const Dataset& data = found.fit.data;
  if (data.cell.tools() < 2 || data.tip_free()) return std::nullopt;
  std::optional<WrongTip> best;
  for (int tool = 0; tool < data.cell.tools(); ++tool) {
    const auto columns = TipColumnsOf(found.candidate_set->problem(), tool);
    if (!columns) continue;
    for (const double lenience : {0.0, kRivalGap}) {
      const TipFit fit = FitTip(*found.candidate_set, found.best.columns, *columns, lenience);
      const std::optional<WrongTip> tip = WrongTipFrom(found, tool, fit);
      if (tip && (!best || tip->evidence_gap < best->evidence_gap)) best = tip;
    }
  }
  return best;
}

std::string SentenceOf(const WrongTip& tip, const Identified& found) {
  const std::vector<std::string> beside = NamesOfBlocks(found, tip.beside);
  const std::vector<std::string> instead_of = NamesOfBlocks(found, tip.instead_of);
  const std::string subject = beside.empty()       ? "the declared cell leaves"
                              : beside.size() == 1 ? beside.front() + " leaves"
                                                   : Listed(beside) + " leave";
  std::string text = fmt::format(
      "{}: measure the TCP of this tool and correct its tcp_mm (or the tool's length). With this "
      "corrected, {} no more than the noise of {:.3g} mm on one axis",
      TipText(tip), subject, 1e3 * tip.sigma_m);
  if (instead_of.empty()) return text;
  return text + fmt::format("; as declared, the rows would need {}", Listed(instead_of));
}

void AddWrongTip(const WrongTip& tip, const Identified& found, Diagnosis& diagnosis) {
  const std::string advice = fmt::format("measure the TCP of tool {}", tip.tool_number);
  for (const Finding& finding : diagnosis.findings) {
    const bool replaced =
        std::any_of(tip.instead_of.begin(), tip.instead_of.end(), [&](BlockIndex block) {
          return KeyOf(found.candidate_set->blocks()[block]) == KeyOfFinding(finding);
        });
    if (!replaced) continue;
    diagnosis.doubts.push_back(
        {KeyOfFinding(finding).id, ScopeOf(finding.effect.term),
         fmt::format("these rows are explained as well if {}; {}", TipText(tip), advice)});
  }
  if (diagnosis.withheld.empty()) {
    diagnosis.withheld = fmt::format(
        "either {}, or the named effects act: {}, correct its tcp_mm "
        "if it is wrong, and diagnose again",
        TipText(tip), advice);
  }
}

}  // namespace plumbline::diagnosis
