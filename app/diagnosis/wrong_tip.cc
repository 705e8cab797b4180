#include "app/diagnosis/wrong_tip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "app/diagnosis/diagnosis_text.h"
#include "app/diagnosis/explanation_checks.h"
#include "app/diagnosis/support_fit.h"
#include "app/diagnosis/thresholds.h"
#include "firmware-like/geometry/angle.h"

namespace plumbline::diagnosis {
namespace {

using I = effects::Influence<double>;

constexpr int kTipAxes = 3;
/// Standard deviation of the prior of each component. A judgement: larger errors of a tip are found
/// as gross errors.
constexpr double kTipDeviation_m = 0.01;
constexpr double kTurnDeviation_rad = 0.1;  // likewise
constexpr double kAbsorbedTip = 1e-3;       // share of a column that the nuisances must leave

/// Whitened and projected columns of an error of a tool, scaled to unit length.
struct TipColumns {
  Eigen::MatrixXd columns;
  Vec3 length;
  double deviation = 0;  ///< of the prior of each component, [m] or [rad]
};

/// Projects and scales the columns.
/// @return  nullopt if the nuisances absorb one
std::optional<TipColumns> ScaledTip(const LinearProblem& problem, Eigen::MatrixXd columns,
                                    double deviation) {
  const Vec3 before = columns.colwise().norm();
  problem.Project(columns);
  const Vec3 length = columns.colwise().norm();
  for (int axis = 0; axis < kTipAxes; ++axis) {
    if (!(length[axis] > kAbsorbedTip * before[axis])) return std::nullopt;
    columns.col(axis) /= length[axis];
  }
  return TipColumns{std::move(columns), length, deviation};
}

/// Columns of a rotation of all measured orientations.
/// @return  nullopt if the rows hold none, or if the nuisances absorb it
std::optional<TipColumns> TurnColumnsOf(const LinearProblem& problem) {
  const FitLayout& layout = problem.layout();
  const Whitener whitener(problem.fit());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(problem.response().size(), kTipAxes);
  for (const FitRowIndex j : problem.rows().indices()) {
    if (layout.count(j) != kMaxResiduals) continue;
    whitener[j].Apply(problem.linear().rows[problem.rows()[j]].own, layout.PartOf(columns, j));
  }
  return ScaledTip(problem, std::move(columns), kTurnDeviation_rad);
}

/// @return  nullopt if the tool has none of the rows or all of them, or if the nuisances absorb its
///          tip
std::optional<TipColumns> TipColumnsOf(const LinearProblem& problem, int tool) {
  Eigen::MatrixXd of_tool(static_cast<Eigen::Index>(problem.rows().size()), 1);
  Eigen::Index at = 0;
  for (const RowIndex row : problem.rows()) {
    of_tool(at++, 0) = problem.data().payloads[row].tool == tool ? 1 : 0;
  }
  if (of_tool.maxCoeff() == 0 || of_tool.minCoeff() == 1) return std::nullopt;
  return ScaledTip(problem, problem.Carried({I::kTip, I::kTip + 1, I::kTip + 2}, of_tool),
                   kTipDeviation_m);
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
  precision.tail(kTipAxes) = (tip.deviation * tip.length).array().square().inverse();
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

/// Cost of the error: that of an effect with three parameters, and the choice among `choices`.
double CostOfTip(const CandidateSet& candidate_set, int choices) {
  const LinearProblem& problem = candidate_set.problem();
  const double rho = problem.fit().row_correlation;
  const double inflation = (1 + rho) / (1 - rho);
  return inflation * (kTipAxes * std::log(static_cast<double>(problem.clusters())) +
                      candidate_set.EffectCost() + 2 * std::log(static_cast<double>(choices)));
}

std::vector<BlockIndex> BlocksOf(const CandidateSet& candidate_set,
                                 const std::vector<ColumnIndex>& columns) {
  std::set<BlockIndex> blocks;
  for (const ColumnIndex column : columns) blocks.insert(candidate_set.BlockOfColumn(column));
  return {blocks.begin(), blocks.end()};
}

/// @param tool  index; nullopt: the orientation is turned
/// @return      nullopt if the error is neither certain nor a rival
std::optional<WrongTip> WrongTipFrom(const Identified& found, std::optional<int> tool,
                                     const TipFit& fit) {
  const CandidateSet& candidate_set = *found.candidate_set;
  const std::vector<ColumnIndex>& columns = found.best.columns;
  const Dataset& data = found.fit.data;
  const ColumnScore kept = ScoreOf(candidate_set, fit.kept);
  const double cost = CostOfTip(candidate_set, tool ? data.cell.tools() : 1);
  const double score = fit.minimum + kept.cost + cost;
  WrongTip tip;
  tip.turned = !tool;
  if (tool) tip.tool_number = data.cell.ToolAt(*tool).number.value_or(0);
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
  if (tip.turned) {
    const double angle = tip.offset_F.norm();
    const Vec3 axis = tip.offset_F / angle;
    return fmt::format(
        "the measured orientation is turned on the tool by {:.2f} deg about ({:.2f}, {:.2f}, "
        "{:.2f}) of the flange frame",
        angle / kRadPerDeg, axis.x(), axis.y(), axis.z());
  }
  const Vec3 mm = 1e3 * tip.offset_F;
  return fmt::format(
      "the tip of tool {} is ({:.2f}, {:.2f}, {:.2f}) mm from the declared one, in the flange "
      "frame",
      tip.tool_number, mm.x(), mm.y(), mm.z());
}

/// What to check, and what to correct if it is wrong.
std::string RemedyOf(const WrongTip& tip) {
  if (tip.turned) {
    return "check how the probe is mounted on the tool, and declare tool = \"unknown\" if it is "
           "turned";
  }
  return fmt::format(
      "measure the TCP of tool {} and correct its tcp_mm (or the tool's length) if it is wrong",
      tip.tool_number);
}

/// Doubts the findings that the offset would replace, and withholds the correction.
void AddDoubts(const WrongTip& tip, const std::string& sentence, const Identified& found,
               Diagnosis& diagnosis) {
  for (const Finding& finding : diagnosis.findings) {
    const bool replaced =
        std::any_of(tip.instead_of.begin(), tip.instead_of.end(), [&](BlockIndex block) {
          return KeyOf(found.candidate_set->blocks()[block]) == KeyOfFinding(finding);
        });
    if (!replaced) continue;
    diagnosis.doubts.push_back({KeyOfFinding(finding).id, ScopeOf(finding.effect.term), sentence});
  }
  if (diagnosis.withheld.empty()) {
    diagnosis.withheld = fmt::format("either {}, or the named effects act: {}, and diagnose again",
                                     TipText(tip), RemedyOf(tip));
  }
}

}  // namespace

bool WrongTip::certain() const {
  return within_noise && evidence_gap < -kMistakeMargin;
}

bool TestsTips(const Dataset& data) {
  std::set<int> tools;
  for (const table::MeasuredRow& row : data.table.rows) tools.insert(row.tool_number.value_or(0));
  const auto turned = std::find(data.turned_sessions.begin(), data.turned_sessions.end(), true);
  return !data.tip_free() && (tools.size() > 1 || turned != data.turned_sessions.end());
}

std::optional<WrongTip> WrongTipOf(const Identified& found) {
  const Dataset& data = found.fit.data;
  const LinearProblem& problem = found.candidate_set->problem();
  std::optional<WrongTip> best;
  if (!TestsTips(data)) return best;
  const auto consider = [&](std::optional<int> tool, const std::optional<TipColumns>& columns) {
    if (!columns) return;
    for (const double lenience : {0.0, kRivalGap}) {
      const TipFit fit = FitTip(*found.candidate_set, found.best.columns, *columns, lenience);
      const std::optional<WrongTip> tip = WrongTipFrom(found, tool, fit);
      if (tip && (!best || tip->evidence_gap < best->evidence_gap)) best = tip;
    }
  };
  for (int tool = 0; data.cell.tools() > 1 && tool < data.cell.tools(); ++tool) {
    consider(tool, TipColumnsOf(problem, tool));
  }
  consider(std::nullopt, TurnColumnsOf(problem));
  return best;
}

std::string SentenceOf(const WrongTip& tip, const Identified& found) {
  const std::vector<std::string> beside = NamesOfBlocks(found, tip.beside);
  const std::vector<std::string> instead_of = NamesOfBlocks(found, tip.instead_of);
  const std::string subject = beside.empty()       ? "the declared cell leaves"
                              : beside.size() == 1 ? beside.front() + " leaves"
                                                   : Listed(beside) + " leave";
  std::string text =
      fmt::format("{}: {}. With this corrected, {} no more than the noise of {:.3g} mm on one axis",
                  TipText(tip), RemedyOf(tip), subject, 1e3 * tip.sigma_m);
  if (instead_of.empty()) return text;
  return text + fmt::format("; as declared, the rows would need {}", Listed(instead_of));
}

void CheckTips(const std::optional<WrongTip>& tip, const Identified& found, Diagnosis& diagnosis) {
  if (diagnosis.findings.empty() || !TestsTips(found.fit.data)) return;
  ExplanationCheck check;
  check.name = "tool_tips";
  check.passed = !tip;
  check.figure = tip ? 1 : 0;
  check.sentence = tip ? fmt::format("these rows are explained as well if {}", TipText(*tip))
                       : "no wrong tip of a tool and no turned orientation fits the rows as well";
  diagnosis.checks.push_back(check);
  if (tip) AddDoubts(*tip, check.sentence, found, diagnosis);
}

}  // namespace plumbline::diagnosis
