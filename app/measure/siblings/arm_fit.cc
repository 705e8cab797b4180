#include "app/measure/siblings/arm_fit.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "app/measure/diagnosis/alignment.h"
#include "app/measure/diagnosis/dataset_preparation.h"
#include "app/measure/diagnosis/fit_problem.h"
#include "app/measure/diagnosis/nuisances.h"
#include "app/measure/diagnosis/refit.h"

namespace plumbline::measure {
namespace {

bool HasShape(const effects::EffectTraits& traits) {
  return std::any_of(traits.parameters.begin(), traits.parameters.end(),
                     [](const effects::ParameterSpec& spec) {
                       return spec.role == effects::ParameterRole::kShape;
                     });
}

/// All rows with the weights of the arm's own diagnosis.
FitProblem ProblemOf(const Dataset& data, const Arm& arm, int threads) {
  FitProblem problem = UnitWeightFit(data, threads);
  std::map<int, double> weight_of_line;
  for (const RowTrace& trace : arm.diagnosis.rows) {
    weight_of_line[trace.line] = trace.weight;
  }
  for (const RowIndex row : data.row_indices()) {
    const auto found = weight_of_line.find(data.measured(row).line);
    problem.weights[row] *= found == weight_of_line.end() ? 0 : found->second;
  }
  problem.sigma_m = arm.diagnosis.sigma_m;
  return problem;
}

bool Contains(const std::vector<SizeKey>& keys, const SizeKey& key) {
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

/// The own findings of the arm without the sizes in `keys`.
std::vector<effects::ActiveEffect> OtherFindings(const Arm& arm, const std::vector<SizeKey>& keys) {
  std::vector<effects::ActiveEffect> others;
  for (const Finding& finding : arm.diagnosis.findings) {
    effects::ActiveEffect rest = finding.effect;
    rest.term.parameters.clear();
    rest.values.clear();
    rest.covariance.resize(0, 0);
    const effects::EffectTerm& term = finding.effect.term;
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      if (Contains(keys, {term.effect, term.word, term.parameters[k]})) continue;
      rest.term.parameters.push_back(term.parameters[k]);
      rest.values.push_back(finding.effect.values[k]);
    }
    if (!rest.values.empty() || term.parameters.empty()) others.push_back(std::move(rest));
  }
  return others;
}

/// RMS error of the aligned model over the rows that count.
Result<double> RmsOf(const Dataset& data, const Model& model, const FitProblem& problem) {
  const Result<Linearisation> linear = Linearise(data, model, false, problem.threads);
  if (!linear) return Error{linear.error()};
  const PerRow<Vec3> errors = ErrorsOf(*linear);
  double sum = 0, weights = 0;
  for (const RowIndex row : data.row_indices()) {
    sum += problem.weights[row] * errors[row].squaredNorm();
    weights += problem.weights[row];
  }
  return weights > 0 ? std::sqrt(sum / weights) : 0.0;
}

/// Residual variance of a fit over that of the noise, at least 1.
double VarianceRatio(const Refit& refit, const FitProblem& problem) {
  double residuals = 0;
  for (const RowIndex row : problem.data.row_indices()) {
    residuals += problem.weights[row] * problem.data.numbers[row].count;
  }
  const Nuisances nuisances(problem.data);
  const double freedom = residuals + nuisances.equations() - nuisances.size() -
                         static_cast<double>(refit.parameters.size());
  return freedom < 1 ? 1 : std::max(1.0, refit.chi2 / freedom);
}

/// The part of a refit that belongs to `keys`.
SizeFit PartOf(const Refit& refit, const std::vector<SizeKey>& keys, double ratio) {
  SizeFit fit;
  std::vector<Eigen::Index> places;
  std::vector<double> values;
  for (std::size_t i = 0; i < refit.parameters.size(); ++i) {
    const auto [effect, value] = refit.parameters[i];
    const effects::ActiveEffect& active = refit.model.effects[static_cast<std::size_t>(effect)];
    const SizeKey key{active.term.effect, active.term.word,
                      active.term.parameters[static_cast<std::size_t>(value)]};
    if (!refit.identifiable[i] || !Contains(keys, key)) continue;
    fit.keys.push_back(key);
    values.push_back(active.values[static_cast<std::size_t>(value)]);
    places.push_back(static_cast<Eigen::Index>(i));
  }
  fit.values =
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  fit.covariance = ratio * refit.covariance(places, places);
  return fit;
}

}  // namespace

std::vector<SizeKey> SharedSizes(const Finding& finding) {
  const effects::EffectTerm& term = finding.effect.term;
  const effects::EffectTraits& traits = term.effect->traits();
  if (!traits.of_arm || HasShape(traits)) return {};
  std::vector<SizeKey> keys;
  for (const effects::TermParameter& parameter : term.parameters) {
    keys.push_back({term.effect, term.word, parameter});
  }
  return keys;
}

std::vector<effects::ActiveEffect> EffectsWith(const std::vector<SizeKey>& keys,
                                               const std::vector<double>& values,
                                               std::uint32_t prismatic) {
  std::vector<effects::ActiveEffect> grouped;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const SizeKey& key = keys[k];
    auto group =
        std::find_if(grouped.begin(), grouped.end(), [&](const effects::ActiveEffect& effect) {
          return effect.term.effect == key.effect && effect.term.word == key.word;
        });
    if (group == grouped.end()) {
      group = grouped.insert(grouped.end(), effects::ActiveEffect{});
      group->term.effect = key.effect;
      group->term.word = key.word;
      group->term.prismatic = prismatic;
    }
    group->term.parameters.push_back(key.parameter);
    group->values.push_back(values[k]);
  }
  return grouped;
}

Result<SizeFit> FitSizes(const Arm& arm, const std::vector<SizeKey>& keys,
                         const std::vector<double>& start, bool own, int threads) {
  const Result<Dataset> data = DatasetFrom(arm.cell, arm.rows);
  if (!data) return Error{data.error()};
  const FitProblem problem = ProblemOf(*data, arm, threads);
  Result<Model> model = Align(*data, Model::Declared(*data), threads);
  if (!model) return Error{model.error()};
  model.value().effects = EffectsWith(keys, start, effects::PrismaticJoints(arm.cell.robot));
  if (own) {
    std::vector<effects::ActiveEffect> others = OtherFindings(arm, keys);
    std::vector<effects::ActiveEffect>& all = model.value().effects;
    all.insert(all.end(), others.begin(), others.end());
  }
  const Result<Refit> refit = RefitModel(problem, *model, {});
  if (!refit) return Error{refit.error()};
  return PartOf(*refit, keys, VarianceRatio(*refit, problem));
}

Result<double> AlignedRms(const model::CellModel& cell, const Arm& arm, int threads) {
  const Result<Dataset> data = DatasetFrom(cell, arm.rows);
  if (!data) return Error{data.error()};
  const Result<Model> model = Align(*data, Model::Declared(*data), threads);
  if (!model) return Error{model.error()};
  return RmsOf(*data, *model, ProblemOf(*data, arm, threads));
}

}  // namespace plumbline::measure
