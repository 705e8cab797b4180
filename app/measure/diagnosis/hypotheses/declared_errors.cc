#include "app/measure/diagnosis/hypotheses/declared_errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/support_fit.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/findings.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

using What = DeclaredErrorKind::What;

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
    const auto same = std::ranges::find_if(units, [&](const SupportFit::Unit& unit) {
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
    const auto of_block =
        std::ranges::count_if(units, [&](const auto& other) { return other.block == unit.block; });
    unit.cost += (candidate_set.BlockCost(unit.block) +
                  candidate_set.EffectCost() * candidate_set.Inflation(unit.block)) /
                 static_cast<double>(of_block);
  }
  return units;
}

/// Fit of an error beside those columns of the answer that are worth their cost.
struct ErrorFit {
  std::vector<ColumnIndex> kept;
  Eigen::VectorXd offset;
  double minimum = 0;  ///< chi2 plus the prior
};

/// @param lenience  a unit is dropped if chi2 then rises by less than its cost plus this
ErrorFit FitError(const CandidateSet& candidate_set, const std::vector<ColumnIndex>& columns,
                  const DeclaredErrorColumns& error, double lenience) {
  const auto count = static_cast<int>(columns.size());
  const auto axes = static_cast<int>(error.columns.cols());
  const Eigen::VectorXd& response = candidate_set.problem().response();
  Eigen::MatrixXd all(response.size(), count + axes);
  Eigen::VectorXd precision(count + axes);
  for (int k = 0; k < count; ++k) {
    const ColumnIndex column = columns[k];
    all.col(k) = candidate_set.columns().col(column.value());
    precision[k] = PrecisionOf(candidate_set, column);
  }
  all.rightCols(axes) = error.columns;
  precision.tail(axes) = (error.deviation * error.length).array().square().inverse();
  Eigen::MatrixXd gram = all.transpose() * all;
  gram.diagonal() += precision;
  std::vector<SupportFit::Unit> units = UnitsOf(candidate_set, columns, lenience);
  // Without a cost, the error is never dropped.
  std::vector<int> places(static_cast<std::size_t>(axes));
  std::iota(places.begin(), places.end(), count);
  units.push_back({BlockIndex(), -1, std::move(places), 0});
  SupportFit fit(gram, all.transpose() * response, response.squaredNorm(), std::move(units));
  fit.Eliminate();
  ErrorFit found;
  found.minimum = fit.minimum();
  for (const int place : fit.Places()) {
    if (place < count) found.kept.push_back(columns[place]);
  }
  found.offset.resize(axes);
  for (int axis = 0; axis < axes; ++axis) {
    found.offset[axis] = fit.Value(count + axis) / error.length[axis];
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

/// Cost of the error: that of an effect with as many parameters, and the choice among `choices`.
double CostOfError(const CandidateSet& candidate_set, Eigen::Index axes, int choices) {
  const LinearProblem& problem = candidate_set.problem();
  const double rho = problem.fit().row_correlation;
  const double inflation = (1 + rho) / (1 - rho);
  return inflation *
         (static_cast<double>(axes) * std::log(static_cast<double>(problem.clusters())) +
          candidate_set.EffectCost() + 2 * std::log(static_cast<double>(choices)));
}

std::vector<EffectKey> EffectsOf(const CandidateSet& candidate_set,
                                 const std::vector<ColumnIndex>& columns) {
  std::vector<EffectKey> keys;
  for (const ColumnIndex column : columns) {
    const EffectKey key = KeyOf(candidate_set.blocks()[candidate_set.BlockOfColumn(column)]);
    if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
  }
  return keys;
}

/// The answer as columns of a candidate set.
struct Answer {
  const CandidateSet& candidate_set;
  Explanation explanation;
  double sigma_m = 0;  ///< noise in use, one axis
};

/// @return  nullopt if the error is neither certain nor a rival
std::optional<DeclaredError> DeclaredErrorFrom(const Answer& answer, const DeclaredErrorKind& kind,
                                               const ErrorFit& fit) {
  const CandidateSet& candidate_set = answer.candidate_set;
  const std::vector<ColumnIndex>& columns = answer.explanation.columns;
  const Dataset& data = candidate_set.problem().data();
  if (kind.what == What::kItemMass) {
    const double declared_kg = data.cell.payload_items[kind.item].mass_kg;
    if (declared_kg + fit.offset[0] <= 0) return std::nullopt;
  }
  const ColumnScore kept = ScoreOf(candidate_set, fit.kept);
  const double score =
      fit.minimum + kept.cost + CostOfError(candidate_set, fit.offset.size(), kind.choices);
  DeclaredError error;
  error.kind = kind;
  if (kind.what == What::kItemMass) {
    error.mass_kg = fit.offset[0];
  } else {
    error.offset = fit.offset;
  }
  error.evidence_gap = score - ScoreOf(candidate_set, columns).score;
  error.sigma_m = data.sigma_m;
  const double left_m =
      answer.sigma_m * std::sqrt(fit.minimum / std::max(1.0, candidate_set.problem().freedom()));
  error.within_noise = left_m < kExcessNoiseRatio * data.sigma_m;
  std::vector<ColumnIndex> replaced;
  std::set_difference(columns.begin(), columns.end(), fit.kept.begin(), fit.kept.end(),
                      std::back_inserter(replaced));
  error.beside = EffectsOf(candidate_set, fit.kept);
  error.instead_of = EffectsOf(candidate_set, replaced);
  const bool needed = score < kept.score;
  // Rows after a move may have been rejected before, so that it must leave nothing else to reject.
  const bool possible = kind.what != What::kMove || error.within_noise;
  const bool rival = possible && error.evidence_gap <= kRivalGap && !replaced.empty();
  if (!needed || !(error.certain() || rival)) return std::nullopt;
  return error;
}

std::vector<std::string> NamesOf(const std::vector<EffectKey>& effects) {
  std::vector<std::string> names;
  for (const EffectKey& effect : effects) {
    const std::string name = EffectName(effect.id);
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

const model::PayloadItem& ItemOf(const DeclaredError& error, const Dataset& data) {
  return data.cell.payload_items[error.kind.item];
}

/// The error as a clause.
std::string TextOf(const DeclaredError& error, const Dataset& data) {
  const Vec3 mm = 1e3 * error.offset;
  switch (error.kind.what) {
    case What::kTurn: {
      const double angle = error.offset.norm();
      const Vec3 axis = error.offset / angle;
      return fmt::format(
          "the measured orientation is turned on the tool by {:.2f} deg about ({:.2f}, {:.2f}, "
          "{:.2f}) of the flange frame",
          angle / kRadPerDeg, axis.x(), axis.y(), axis.z());
    }
    case What::kTip:
      return fmt::format(
          "the tip of tool {} is ({:.2f}, {:.2f}, {:.2f}) mm from the declared one, in the flange "
          "frame",
          data.cell.ToolAt(error.kind.tool).number.value_or(0), mm.x(), mm.y(), mm.z());
    case What::kItemMass: {
      const model::PayloadItem& item = ItemOf(error, data);
      return fmt::format(
          "payload item {} has a mass of about {:.1f} kg instead of the declared {:.1f} kg",
          item.number, item.mass_kg + error.mass_kg, item.mass_kg);
    }
    case What::kMove:
      break;
  }
  return fmt::format("the artefact {} moved by ({:.2f}, {:.2f}, {:.2f}) mm before line {}",
                     data.cell.artefacts[error.kind.artefact.offset()].name, mm.x(), mm.y(), mm.z(),
                     data.measured(error.kind.from).line);
}

/// What to check, and what to correct if it is wrong.
std::string RemedyOf(const DeclaredError& error, const Dataset& data) {
  switch (error.kind.what) {
    case What::kTurn:
      return "check how the probe is mounted on the tool, and declare tool = \"unknown\" if it is "
             "turned";
    case What::kTip:
      return fmt::format(
          "measure the TCP of tool {} and correct its tcp_mm (or the tool's length) if it is "
          "wrong, "
          "or declare tool = \"unknown\" in [measurement] to have it estimated from these rows",
          data.cell.ToolAt(error.kind.tool).number.value_or(0));
    case What::kItemMass:
      return fmt::format("weigh payload item {} and correct its mass_kg if it is wrong",
                         ItemOf(error, data).number);
    case What::kMove:
      break;
  }
  return fmt::format(
      "fasten it and measure again, or declare one more artefact for its rows from line {} on",
      data.measured(error.kind.from).line);
}

/// True if the row is on an artefact that may have moved, and was rejected as an outlier.
bool IsRejectedTouch(const FitProblem& fit, RowIndex row) {
  return fit.weights[row] < kOutlierWeight && fit.data.numbers[row].count > 0 &&
         IsAtUnknownPlace(fit.data, row);
}

bool RejectsTouches(const FitProblem& fit) {
  const auto rows = fit.data.row_indices();
  return std::ranges::any_of(rows, [&](RowIndex row) { return IsRejectedTouch(fit, row); });
}

/// The fit with full weight for those rows: after a move, they are not misread.
FitProblem WithRejectedTouches(FitProblem fit) {
  for (const RowIndex row : fit.data.row_indices()) {
    if (IsRejectedTouch(fit, row)) fit.weights[row] = 1;
  }
  return fit;
}

const char* CheckOf(What what) {
  switch (what) {
    case What::kItemMass:
      return "payload_items";
    case What::kMove:
      return "artefact_moves";
    case What::kTip:
    case What::kTurn:
      break;
  }
  return "tool_tips";
}

/// With and without the effects of the answer, which may make up for a wrong mass, or be what shows
/// it.
std::vector<DeclaredErrorColumns> AllItemErrors(const Identified& found, int threads) {
  std::vector<DeclaredErrorColumns> errors =
      ItemErrors(found.candidate_set->problem(), found.aligned, threads);
  for (DeclaredErrorColumns& columns :
       ItemErrors(found.candidate_set->problem(), found.model, threads)) {
    errors.push_back(std::move(columns));
  }
  return errors;
}

}  // namespace

bool DeclaredError::certain() const {
  return within_noise && evidence_gap < -kMistakeMargin;
}

DeclaredErrorSearch SearchDeclaredErrors(const Identified& found, bool with_moves, int threads) {
  DeclaredErrorSearch search;
  std::optional<DeclaredError>& best = search.likeliest;
  const auto consider = [&](const Answer& answer, const DeclaredErrorColumns& columns) {
    for (const double lenience : {0.0, kRivalGap}) {
      const ErrorFit fit =
          FitError(answer.candidate_set, answer.explanation.columns, columns, lenience);
      const std::optional<DeclaredError> error = DeclaredErrorFrom(answer, columns.kind, fit);
      if (error && (!best || error->evidence_gap < best->evidence_gap)) best = error;
    }
  };
  const Answer answer{*found.candidate_set, found.best, found.fit.sigma_m};
  for (const DeclaredErrorColumns& columns : TipErrors(answer.candidate_set.problem())) {
    consider(answer, columns);
  }
  for (const DeclaredErrorColumns& columns : AllItemErrors(found, threads)) {
    search.tested_items = true;
    consider(answer, columns);
  }
  search.tested_moves = with_moves && TestsMoves(found.fit.data);
  if (!search.tested_moves) return search;
  // A move may hide behind effects that imitate it, so that it is also sought in the whole
  // residual.
  const auto consider_moves = [&](const Answer& tried) {
    const LinearProblem& problem = tried.candidate_set.problem();
    for (const Eigen::VectorXd& residual :
         {tried.candidate_set.Residual(tried.explanation), Eigen::VectorXd(problem.response())}) {
      if (const auto move = LikeliestMove(problem, residual)) consider(tried, *move);
    }
  };
  if (!RejectsTouches(found.fit)) {
    consider_moves(answer);
    return search;
  }
  const LinearProblem problem(WithRejectedTouches(found.fit), found.linear, found.model);
  CandidateSet candidate_set(problem);
  std::vector<BlockIndex> support;
  for (const BlockIndex block : found.best.blocks) {
    support.push_back(candidate_set.Add(found.candidate_set->blocks()[block]));
  }
  consider_moves({candidate_set, candidate_set.Fit(support), found.fit.sigma_m});
  return search;
}

std::string SentenceOf(const DeclaredError& error, const Identified& found) {
  const Dataset& data = found.fit.data;
  const std::vector<std::string> beside = NamesOf(error.beside);
  const std::vector<std::string> instead_of = NamesOf(error.instead_of);
  const std::string subject = beside.empty()       ? "the declared cell leaves"
                              : beside.size() == 1 ? beside.front() + " leaves"
                                                   : Listed(beside) + " leave";
  std::string text =
      fmt::format("{}: {}. With this corrected, {} no more than the noise of {:.3g} mm on one axis",
                  TextOf(error, data), RemedyOf(error, data), subject, 1e3 * error.sigma_m);
  if (instead_of.empty()) return text;
  return text + fmt::format("; as declared, the rows would need {}", Listed(instead_of));
}

Opinion OpinionOnDeclarations(const DeclaredErrorSearch& search, const Identified& found,
                              const std::vector<Finding>& findings) {
  Opinion opinion;
  const std::optional<DeclaredError>& error = search.likeliest;
  if (findings.empty()) return opinion;
  const auto add = [&](const char* name, const std::string& sentence) {
    ExplanationCheck& check = opinion.checks.emplace_back();
    check.name = name;
    check.passed = !error;
    check.figure = error ? 1 : 0;
    check.sentence = sentence;
  };
  const Dataset& data = found.fit.data;
  if (!error) {
    if (TestsTips(data))
      add("tool_tips", "no wrong tip of a tool and no turned orientation fits as well");
    if (search.tested_items) add("payload_items", "no wrong mass of a payload item fits as well");
    if (search.tested_moves) add("artefact_moves", "no artefact that moved fits as well");
    return opinion;
  }
  const std::string sentence =
      fmt::format("these rows are explained as well if {}", TextOf(*error, data));
  add(CheckOf(error->kind.what), sentence);
  for (const Finding& finding : findings) {
    const auto& replaced = error->instead_of;
    if (std::ranges::find(replaced, KeyOfFinding(finding)) == replaced.end()) continue;
    opinion.doubts.push_back({KeyOfFinding(finding).id, ScopeOf(finding.effect.term), sentence});
  }
  opinion.withheld = fmt::format("either {}, or the named effects act: {}, and diagnose again",
                                 TextOf(*error, data), RemedyOf(*error, data));
  return opinion;
}

}  // namespace plumbline::measure
