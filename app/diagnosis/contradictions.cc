#include "app/diagnosis/contradictions.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "app/diagnosis/explanation_checks.h"
#include "app/diagnosis/nuisances.h"
#include "firmware-like/statistics/chi_square.h"

namespace plumbline::diagnosis {
namespace {

constexpr double kChance = 1e-3;  // of a contradiction by noise, for all equations together
constexpr double kMinIndependence = 1e-6;  // 1 - h; less is not tested
constexpr double kMaxShareSetAside = 0.25;

/// Orthonormal basis of the columns of the named effects, nuisances projected out.
Eigen::MatrixXd BasisOfEffects(const Identified& found, const LinearProblem& problem) {
  Eigen::MatrixXd columns(problem.response().size(), 0);
  for (const BlockIndex block : found.best.blocks) {
    const Eigen::MatrixXd own = problem.Columns(found.candidate_set->blocks()[block], true);
    columns.conservativeResize(Eigen::NoChange, columns.cols() + own.cols());
    columns.rightCols(own.cols()) = own;
  }
  if (columns.cols() == 0) return columns;
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
}

std::string DifferenceInWords(const Equation& equation, double difference_m) {
  if (equation.of.distance) {
    return fmt::format("declared as {:.6g} mm, is {:.6g} mm", 1e3 * equation.declared_m,
                       1e3 * (equation.declared_m - difference_m));
  }
  return fmt::format("differ by {:.3g} mm", 1e3 * std::abs(difference_m));
}

/// "a (.. standard deviations); b (..)"
std::string Sentences(const std::vector<Contradiction>& contradictions) {
  std::vector<std::string> all;
  for (const Contradiction& one : contradictions) all.push_back(one.sentence);
  return fmt::format("{}", fmt::join(all, "; "));
}

}  // namespace

std::vector<Contradiction> ContradictionsIn(const Identified& found) {
  const Dataset& data = found.fit.data;
  const std::vector<Equation> equations = Nuisances(data).EquationsAt(found.model);
  if (equations.empty()) return {};
  const LinearProblem problem(found.fit, found.linear, found.model);
  const Eigen::MatrixXd basis = BasisOfEffects(found, problem);
  const Eigen::VectorXd residual =
      problem.response() - basis * (basis.transpose() * problem.response());
  const double limit =
      std::sqrt(statistics::ChiSquareQuantile(kChance / static_cast<double>(equations.size()), 1));
  const Eigen::Index first = residual.size() - static_cast<Eigen::Index>(equations.size());
  std::vector<Contradiction> contradictions;
  for (std::size_t k = 0; k < equations.size(); ++k) {
    const Eigen::Index at = first + static_cast<Eigen::Index>(k);
    const double independence =
        1 - problem.frames().row(at).squaredNorm() - basis.row(at).squaredNorm();
    if (independence < kMinIndependence) continue;
    const double z = std::abs(residual[at]) / std::sqrt(independence);
    if (z < limit) continue;
    const Equation& equation = equations[k];
    Contradiction one{equation.of, z, ""};
    one.sentence = fmt::format(
        "{}, {} according to the rows and the other references ({:.2g} standard deviations)",
        NameOf(equation.of, data.cell),
        DifferenceInWords(equation, equation.sd_m * residual[at] / independence), z);
    const auto same =
        std::find_if(contradictions.begin(), contradictions.end(),
                     [&](const Contradiction& other) { return other.reference == equation.of; });
    if (same == contradictions.end()) {
      contradictions.push_back(std::move(one));
    } else if (same->z < z) {
      *same = std::move(one);
    }
  }
  std::stable_sort(contradictions.begin(), contradictions.end(),
                   [](const Contradiction& a, const Contradiction& b) { return a.z > b.z; });
  return contradictions;
}

void CheckContradictions(const Identified& found, Diagnosis& diagnosis) {
  diagnosis.references = static_cast<int>(ReferencesOf(found.fit.data).size());
  if (diagnosis.references == 0) return;
  diagnosis.contradictions = ContradictionsIn(found);
  ExplanationCheck check;
  check.name = "contradictions";
  check.figure = static_cast<double>(diagnosis.contradictions.size());
  check.passed = diagnosis.contradictions.empty();
  check.sentence = check.passed ? "the rows agree with every declared distance and place"
                                : Sentences(diagnosis.contradictions);
  for (const Finding& finding : diagnosis.findings) {
    if (check.passed || !finding.effect.term.drivers.empty()) continue;
    diagnosis.doubts.push_back({KeyOfFinding(finding).id, ScopeOf(finding.effect.term),
                                "with it, the rows contradict " + check.sentence});
  }
  diagnosis.checks.push_back(std::move(check));
}

Result<Diagnosis> SetAsideContradictions(
    const model::CellModel& cell,
    const std::function<Result<Diagnosis>(const model::CellModel&)>& attempt) {
  Result<Diagnosis> first = attempt(cell);
  if (!first || first->contradictions.empty()) return first;
  Diagnosis with_all = std::move(first).value();
  const auto most = static_cast<std::size_t>(kMaxShareSetAside * with_all.references);
  std::vector<Contradiction> set_aside;
  model::CellModel left = cell;
  Contradiction worst = with_all.contradictions.front();
  while (set_aside.size() < most) {
    left = Without(worst.reference, left);
    set_aside.push_back(worst);
    Result<Diagnosis> next = attempt(left);
    if (!next) break;
    Diagnosis without = std::move(next).value();
    if (without.contradictions.empty() && without.verdict == Verdict::kUnknown) break;
    if (without.contradictions.empty()) {
      without.notes.push_back(
          fmt::format("set aside, since the rest of the data contradicts it: {}. Measure it again "
                      "and correct the cell",
                      Sentences(set_aside)));
      return without;
    }
    worst = without.contradictions.front();
  }
  with_all.notes.push_back(fmt::format(
      "{} of {} declared distances and places contradict the rows: {}. Measure them "
      "again; if they are right, the model lacks something",
      with_all.contradictions.size(), with_all.references, Sentences(with_all.contradictions)));
  return with_all;
}

}  // namespace plumbline::diagnosis
