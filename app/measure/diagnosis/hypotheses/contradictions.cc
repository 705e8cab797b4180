#include "app/measure/diagnosis/hypotheses/contradictions.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/search/findings.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kChance = 1e-3;  // of a contradiction by noise, for all equations together
constexpr double kMinIndependence = 1e-6;  // 1 - h; less is not tested
constexpr double kMaxShareSetAside = 0.25;
constexpr double kUseful = 0.5;  // see CorrectionIsUseful()

/// Standard deviation with which places declared as exact are tested [m]: less than any touch can
/// show, but enough for the others to determine the place, too.
constexpr double kNearlyExact_m = 1e-5;

/// The fit whose equations are tested.
struct TestedFit {
  const LinearProblem& problem;
  const CandidateSet& candidate_set;
  const Explanation& explanation;
};

/// Orthonormal basis of the selected columns, which are well conditioned (CandidateSet).
Eigen::MatrixXd BasisOfEffects(const TestedFit& fit) {
  const Eigen::MatrixXd& columns = fit.candidate_set.columns();
  Eigen::MatrixXd selected(fit.problem.layout().total(),
                           static_cast<Eigen::Index>(fit.explanation.columns.size()));
  Eigen::Index at = 0;
  for (const ColumnIndex column : fit.explanation.columns) {
    selected.col(at++) = columns.col(column.value());
  }
  if (at == 0) return selected;
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(selected);
  return qr.householderQ() * Eigen::MatrixXd::Identity(selected.rows(), at);
}

/// A tested equation: its reference, z, and declared minus predicted [m].
struct Tested {
  const Equation* equation = nullptr;
  double z = 0, difference_m = 0;
};

/// The equations that something else determines, too.
std::vector<Tested> TestsOf(const TestedFit& fit, const std::vector<Equation>& equations) {
  const Eigen::MatrixXd basis = BasisOfEffects(fit);
  const Eigen::VectorXd residual = fit.candidate_set.Residual(fit.explanation);
  const NuisanceProjection& nuisances = fit.problem.nuisances();
  const Eigen::Index first = residual.size() - static_cast<Eigen::Index>(equations.size());
  std::vector<Tested> tested;
  for (std::size_t k = 0; k < equations.size(); ++k) {
    if (!equations[k].reference.distance && !equations[k].reference.artefact)
      continue;  // no reference to name
    const Eigen::Index at = first + static_cast<Eigen::Index>(k);
    const double independence =
        1 - nuisances.Leverage(static_cast<int>(at)) - basis.row(at).squaredNorm();
    if (independence < kMinIndependence) continue;
    tested.push_back({&equations[k], std::abs(residual[at]) / std::sqrt(independence),
                      equations[k].sd_m * residual[at] / independence});
  }
  return tested;
}

std::string SentenceOf(const Tested& test, const model::CellModel& cell) {
  const Equation& equation = *test.equation;
  const std::string name = NameOf(equation.reference, cell);
  const std::string size = fmt::format("{:.0f} standard deviations", test.z);
  return equation.reference.distance
             ? fmt::format("{} is declared as {:.6g} mm, but is {:.6g} mm by all other data ({})",
                           name, 1e3 * equation.declared_m,
                           1e3 * (equation.declared_m - test.difference_m), size)
             : fmt::format("{} are {:.3g} mm away from where all other data put it ({})", name,
                           1e3 * std::abs(test.difference_m), size);
}

/// "a (.. standard deviations); b (..)"
std::string Sentences(const std::vector<Contradiction>& contradictions) {
  std::vector<std::string> all;
  all.reserve(contradictions.size());
  for (const Contradiction& one : contradictions) all.push_back(one.sentence);
  return fmt::format("{}", fmt::join(all, "; "));
}

/// The cell with its exact places declared with kNearlyExact_m, so that they have equations;
/// nullopt if it has none.
std::optional<model::CellModel> WithNearlyExactPlaces(const Dataset& data) {
  model::CellModel cell = data.cell;
  bool any = false;
  for (const ArtefactIndex k : data.used_artefacts.indices()) {
    model::Artefact& artefact = cell.artefacts[k.offset()];
    if (!data.used_artefacts[k] || !artefact.place || artefact.sd_m > 0) continue;
    artefact.sd_m = kNearlyExact_m;
    any = true;
  }
  return any ? std::optional(std::move(cell)) : std::nullopt;
}

/// The columns of an explanation in another candidate set, to which its blocks are added.
Explanation FitSameColumns(const CandidateSet& from, const Explanation& explanation,
                           CandidateSet& candidate_set) {
  std::vector<Block> blocks;
  for (const BlockIndex block : explanation.blocks) blocks.push_back(from.blocks()[block]);
  const std::vector<BlockIndex> added = candidate_set.Add(blocks);
  const Coefficients kept = from.CoefficientsOf(explanation);
  std::vector<ColumnIndex> columns;
  for (std::size_t k = 0; k < added.size(); ++k) {
    for (const ColumnIndex column : candidate_set.ColumnsOf({added[k]})) {
      if (kept.contains({explanation.blocks[k], candidate_set.WithinBlock(column)})) {
        columns.push_back(column);
      }
    }
  }
  std::ranges::sort(columns);
  return candidate_set.FitColumns(columns);
}

/// Tests of all equations with the effects of the answer, and without any effect.
struct Tests {
  std::vector<Tested> of_answer, of_declared;
};

Tests TestsOfBoth(const TestedFit& fit, const std::vector<Equation>& equations) {
  return {TestsOf(fit, equations), TestsOf({fit.problem, fit.candidate_set, {}}, equations)};
}

/// RMS of declared minus predicted [m].
double RmsDifference(const std::vector<Tested>& tests) {
  double sum = 0;
  for (const Tested& test : tests) sum += test.difference_m * test.difference_m;
  return tests.empty() ? 0 : std::sqrt(sum / static_cast<double>(tests.size()));
}

/// Tests of all equations, those of exact places included.
/// @param data  with places that are nearly exact; outlives the result
/// @return      an error if a deflected posture does not converge
Result<Tests> TestsWithExactPlaces(const Identified& found, const Dataset& data,
                                   const std::vector<Equation>& equations) {
  Result<Linearisation> linear = LineariseApart(data, found.model, found.fit.threads);
  if (!linear) return linear.failure();
  const FitProblem fit = found.fit.WithData(data);
  const LinearProblem problem(fit, std::make_shared<const Linearisation>(std::move(linear).value()),
                              found.model);
  CandidateSet candidate_set(problem);
  const Explanation same = FitSameColumns(*found.candidate_set, found.best, candidate_set);
  return TestsOfBoth({problem, candidate_set, same}, equations);
}

}  // namespace

Result<TestedReferences> TestReferences(const Identified& found) {
  TestedReferences result;
  References& references = result.references;
  Dataset data = found.fit.data;
  const std::optional<model::CellModel> nearly_exact = WithNearlyExactPlaces(data);
  if (nearly_exact) data.cell = *nearly_exact;
  const std::vector<Equation> equations = Nuisances(data).EquationsAt(found.model);
  if (equations.empty()) return result;
  const Result<Tests> tests =
      nearly_exact ? TestsWithExactPlaces(found, data, equations)
                   : TestsOfBoth({*found.problem, *found.candidate_set, found.best}, equations);
  if (!tests) return tests.failure();
  const std::vector<Tested>& tested = tests->of_answer;
  result.with_effects_m = RmsDifference(tested);
  result.declared_m = RmsDifference(tests->of_declared);
  const double limit = std::sqrt(statistics::ChiSquareQuantile(
      kChance / static_cast<double>(std::max<std::size_t>(1, tested.size())), 1));
  std::map<Reference, Tested> largest;
  for (const Tested& test : tested) {
    Tested& of_reference = largest[test.equation->reference];
    if (of_reference.equation == nullptr || of_reference.z < test.z) of_reference = test;
  }
  references.tested = static_cast<int>(largest.size());
  for (const auto& [reference, test] : largest) {
    if (test.z < limit) continue;
    references.contradicting.push_back({reference, test.z, SentenceOf(test, found.fit.data.cell)});
    result.largest_m = std::max(result.largest_m, std::abs(test.difference_m));
  }
  std::ranges::stable_sort(
      references.contradicting,
      [](const Contradiction& a, const Contradiction& b) { return a.z > b.z; });
  return result;
}

bool TestedReferences::CorrectionIsUseful(double rms_before_m) const {
  return with_effects_m < kUseful * declared_m && largest_m < kUseful * rms_before_m;
}

Opinion OpinionOnContradictions(const TestedReferences& tested, const Diagnosis& diagnosis) {
  Opinion opinion;
  const std::vector<Contradiction>& contradicting = tested.references.contradicting;
  if (tested.references.tested == 0) return opinion;
  ExplanationCheck check;
  check.name = "contradictions";
  check.figure = static_cast<double>(contradicting.size());
  check.passed = contradicting.empty();
  check.sentence = check.passed
                       ? fmt::format(
                             "all {} declared distances and places in use that other data can "
                             "test agree with it",
                             tested.references.tested)
                       : Sentences(contradicting);
  opinion.checks.push_back(check);
  if (check.passed) return opinion;
  if (diagnosis.findings.empty()) {
    opinion.permits = Verdict::kUnknown;
    return opinion;
  }
  const std::string reason = "a declared value contradicts the model: " + check.sentence;
  for (const Finding& finding : diagnosis.findings) {
    if (!finding.effect.term.drivers.empty()) continue;  // an empirical curve names no cause
    opinion.doubts.push_back({KeyOfFinding(finding).id, ScopeOf(finding.effect.term), reason});
  }
  if (!tested.CorrectionIsUseful(diagnosis.rms_before_m))
    opinion.withheld = reason + "; measure it again; if it is right, the model lacks something";
  return opinion;
}

Result<Diagnosis> SetAsideContradictions(
    const model::CellModel& cell, const DiagnosisOptions& options,
    const std::function<Result<std::unique_ptr<Attempt>>(const model::CellModel&)>& attempt) {
  Result<std::unique_ptr<Attempt>> with_all = attempt(cell);
  if (!with_all) return with_all.failure();
  const References references = (*with_all)->so_far().references;
  if (references.contradicting.empty()) return (*with_all)->Finish();
  const auto most = static_cast<std::size_t>(kMaxShareSetAside * references.tested);
  std::vector<Contradiction> set_aside;
  model::CellModel left = cell;
  Contradiction worst = references.contradicting.front();
  while (set_aside.size() < most) {
    left = Without(worst.reference, left);
    set_aside.push_back(worst);
    const Result<std::unique_ptr<Attempt>> next = attempt(left);
    if (!next && options.interrupted && options.interrupted()) return next.failure();
    if (!next) break;
    const Diagnosis& so_far = (*next)->so_far();
    if (so_far.references.contradicting.empty()) {
      if (so_far.verdict == Verdict::kUnknown) break;
      Result<Diagnosis> without = (*next)->Finish();
      if (!without && options.interrupted && options.interrupted()) return without;
      if (!without || without->verdict == Verdict::kUnknown) break;
      without.value().notes.insert(
          without.value().notes.begin(),
          fmt::format("set aside, because all other data contradict: {}. Measure "
                      "again and correct the cell",
                      Sentences(set_aside)));
      without.value().references.set_aside = std::move(set_aside);
      return without;
    }
    worst = so_far.references.contradicting.front();
  }
  Result<Diagnosis> diagnosis = (*with_all)->Finish();
  if (!diagnosis) return diagnosis;
  diagnosis.value().notes.insert(
      diagnosis.value().notes.begin(),
      fmt::format("{} of {} declared distances and places contradict the rest of the data: {}. "
                  "Measure again; if they are right, the model lacks something",
                  references.contradicting.size(), references.tested,
                  Sentences(references.contradicting)));
  return diagnosis;
}

}  // namespace plumbline::measure
