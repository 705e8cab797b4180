#include "app/measure/siblings/arm_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/measure/diagnosis/linear/alignment.h"
#include "app/measure/diagnosis/linear/fit_problem.h"
#include "app/measure/diagnosis/linear/nuisances.h"
#include "app/measure/diagnosis/linear/refit.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kConfidence = 0.8;
constexpr double kContradicted = 0.01;
constexpr double kMinDeviations = 3;  // of a mean from zero

struct WeightedMean {
  double mean = 0, weights = 0;
  double squares = 0;  ///< weighted sum of squares about the mean
};

WeightedMean MeanOf(std::span<const Estimate> estimates, double between_variance) {
  WeightedMean weighted;
  const auto weight = [between_variance](const Estimate& estimate) {
    return 1 / (estimate.sd * estimate.sd + between_variance);
  };
  for (const Estimate& estimate : estimates) {
    weighted.weights += weight(estimate);
    weighted.mean += weight(estimate) * estimate.value;
  }
  weighted.mean /= weighted.weights;
  for (const Estimate& estimate : estimates) {
    weighted.squares += weight(estimate) * std::pow(estimate.value - weighted.mean, 2);
  }
  return weighted;
}

/// Where a decreasing function falls to `limit`, between `low` and a bound that is doubled from
/// `high` on; `low` if it is below the limit there already.
template <typename Decreasing>
double RootOf(const Decreasing& function, double limit, double low, double high) {
  if (function(low) <= limit) return low;
  for (int k = 0; k < 200 && function(high) > limit; ++k) high *= 2;
  for (int k = 0; k < 200 && high - low > 1e-12 * high; ++k) {
    const double middle = (low + high) / 2;
    (function(middle) > limit ? low : high) = middle;
  }
  return high;
}

double SumOfVariances(std::span<const Estimate> estimates) {
  double sum = 0;
  for (const Estimate& estimate : estimates) sum += estimate.sd * estimate.sd;
  return sum;
}

/// The spread's variance at which the weighted squares fall to `squares`; 0 if they are below
/// already.
double VarianceWith(std::span<const Estimate> estimates, double squares) {
  return RootOf([&](double variance) { return MeanOf(estimates, variance).squares; }, squares, 0,
                SumOfVariances(estimates));
}

/// Estimates of one quantity with their mean.
struct Quantity {
  std::vector<Estimate> estimates;
  double mean = 0;
  std::size_t place = 0;  ///< among all
};

double FreedomOf(const std::vector<Quantity>& quantities) {
  double freedom = 0;
  for (const Quantity& one : quantities) freedom += static_cast<double>(one.estimates.size() - 1);
  return freedom;
}

double SquaresWith(const Quantity& quantity, double spread) {
  return MeanOf(quantity.estimates, std::pow(spread * quantity.mean, 2)).squares;
}

/// The upper limit of their common spread.
double SpreadOf(const std::vector<Quantity>& quantities) {
  const double limit = statistics::ChiSquareQuantile(kConfidence, FreedomOf(quantities));
  return RootOf(
      [&](double spread) {
        double squares = 0;
        for (const Quantity& one : quantities) squares += SquaresWith(one, spread);
        return squares;
      },
      limit, kLeastCommonSpread, 2 * kLeastCommonSpread);
}

/// Squares of a quantity with the spread of the others, in units of what contradicts that.
double Excess(const Quantity& quantity, const std::vector<Quantity>& all) {
  std::vector<Quantity> others;
  for (const Quantity& one : all) {
    if (&one != &quantity) others.push_back(one);
  }
  if (others.empty()) return 0;
  const auto freedom = static_cast<double>(quantity.estimates.size() - 1);
  return SquaresWith(quantity, SpreadOf(others)) /
         statistics::ChiSquareQuantile(kContradicted / static_cast<double>(all.size()), freedom);
}

bool HasShape(const effects::EffectTraits& traits) {
  return std::ranges::any_of(traits.parameters, [](const effects::ParameterSpec& spec) {
    return spec.role == effects::ParameterRole::kShape;
  });
}

/// All rows with the weights of the arm's own diagnosis.
FitProblem ProblemOf(const Dataset& data, const Arm& arm, int threads) {
  FitProblem problem = UnitWeightFit(data, threads);
  const std::map<int, double>& weight_of_line = arm.found.weight_of_line;
  for (const RowIndex row : data.row_indices()) {
    const auto found = weight_of_line.find(data.measured(row).line);
    problem.weights[row] *= found == weight_of_line.end() ? 0 : found->second;
  }
  problem.sigma_m = arm.found.sigma_m;
  return problem;
}

bool Contains(const std::vector<SizeKey>& keys, const SizeKey& key) {
  return std::ranges::find(keys, key) != keys.end();
}

/// The own findings of the arm without the sizes in `keys`.
std::vector<effects::ActiveEffect> OtherFindings(const Arm& arm, const std::vector<SizeKey>& keys) {
  std::vector<effects::ActiveEffect> others;
  for (const effects::ActiveEffect& effect : arm.found.effects) {
    effects::ActiveEffect rest = effect;
    rest.term.parameters.clear();
    rest.values.clear();
    rest.covariance.resize(0, 0);
    const effects::EffectTerm& term = effect.term;
    for (std::size_t k = 0; k < term.parameters.size(); ++k) {
      if (Contains(keys, {term.effect, term.word, term.parameters[k]})) continue;
      rest.term.parameters.push_back(term.parameters[k]);
      rest.values.push_back(effect.values[k]);
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
    const effects::ActiveEffect& active = refit.model.effects[effect];
    const SizeKey key{active.term.effect, active.term.word, active.term.parameters[value]};
    if (!refit.identifiable[i] || !Contains(keys, key)) continue;
    fit.keys.push_back(key);
    values.push_back(active.values[value]);
    places.push_back(static_cast<Eigen::Index>(i));
  }
  fit.values =
      Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  fit.covariance = ratio * refit.covariance(places, places);
  return fit;
}

}  // namespace

double Pooled::next_sd() const {
  return std::hypot(between_sd, mean_sd);
}

std::optional<Pooled> PoolEstimates(std::span<const Estimate> estimates,
                                    std::optional<double> common) {
  if (estimates.size() < 2) return std::nullopt;
  const auto freedom = static_cast<double>(estimates.size() - 1);
  double variance = 0;
  if (common) {
    variance = std::pow(*common * MeanOf(estimates, 0).mean, 2);
  } else {
    variance = VarianceWith(estimates, statistics::ChiSquareQuantile(kConfidence, freedom));
    variance = std::max(variance, std::pow(kLeastSpread * MeanOf(estimates, variance).mean, 2));
  }
  const WeightedMean weighted = MeanOf(estimates, variance);
  return Pooled{weighted.mean, std::sqrt(variance), 1 / std::sqrt(weighted.weights),
                static_cast<int>(estimates.size())};
}

std::optional<CommonSpread> CommonSpreadOf(std::span<const std::vector<Estimate>> quantities) {
  std::vector<Quantity> counted;
  for (std::size_t k = 0; k < quantities.size(); ++k) {
    if (quantities[k].size() < 2) continue;
    const WeightedMean weighted = MeanOf(quantities[k], 0);
    if (std::abs(weighted.mean) < kMinDeviations / std::sqrt(weighted.weights)) continue;
    counted.push_back({quantities[k], weighted.mean, k});
  }
  while (FreedomOf(counted) >= kMinCommonFreedom) {
    std::vector<double> excess;
    for (const Quantity& one : counted) excess.push_back(Excess(one, counted));
    const auto worst = std::ranges::max_element(excess);
    if (*worst > 1) {
      counted.erase(counted.begin() + (worst - excess.begin()));
      continue;
    }
    CommonSpread common{SpreadOf(counted), std::vector<bool>(quantities.size(), false)};
    for (const Quantity& one : counted) common.shared_by[one.place] = true;
    return common;
  }
  return std::nullopt;
}

double SpreadAboutZero(std::span<const Estimate> estimates) {
  if (estimates.empty()) return 0;
  const auto squares = [&](double variance) {
    double sum = 0;
    for (const Estimate& one : estimates)
      sum += one.value * one.value / (one.sd * one.sd + variance);
    return sum;
  };
  return std::sqrt(RootOf(
      squares, statistics::ChiSquareQuantile(kConfidence, static_cast<double>(estimates.size())), 0,
      SumOfVariances(estimates)));
}

ArmFindings FindingsOf(const Diagnosis& diagnosis) {
  ArmFindings found;
  for (const Finding& finding : diagnosis.findings) found.effects.push_back(finding.effect);
  for (const RowTrace& row : diagnosis.rows) found.weight_of_line[row.line] = row.weight;
  found.sigma_m = diagnosis.sigma_m;
  // What the arm alone does not explain is not noise. The scatter that a fit leaves counts in its
  // own covariance.
  if (diagnosis.sigma_origin == "residual" && diagnosis.noise_in_use_m > 0)
    found.sigma_m *= diagnosis.noise_floor_m / diagnosis.noise_in_use_m;
  return found;
}

std::vector<SizeKey> SharedSizes(const effects::EffectTerm& term) {
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
    auto group = std::ranges::find_if(grouped, [&](const effects::ActiveEffect& effect) {
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
                         const std::vector<double>& start, OwnFindings own, int threads) {
  const Result<Dataset> data = DatasetFrom(arm.cell, arm.rows);
  if (!data) return Error{data.error()};
  const FitProblem problem = ProblemOf(*data, arm, threads);
  Result<Model> model = Align(*data, Model::Declared(*data), threads);
  if (!model) return Error{model.error()};
  model.value().effects = EffectsWith(keys, start, effects::PrismaticJoints(arm.cell.robot));
  if (own == OwnFindings::kFitted) {
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

Result<std::vector<TipDisplacement>> DisplacementsBy(
    const std::vector<effects::ActiveEffect>& effects, const Arm& arm, int threads) {
  const Result<Dataset> data = DatasetFrom(arm.cell, arm.rows);
  if (!data) return Error{data.error()};
  const FitProblem problem = ProblemOf(*data, arm, threads);
  std::vector<TipDisplacement> displacements;
  for (const effects::ActiveEffect& effect : effects)
    displacements.push_back(TipDisplacementOf(problem, effect));
  return displacements;
}

std::string ProbabilityText(double probability) {
  constexpr double kLeast = 1e-12;
  return probability < kLeast ? "< 1e-12" : fmt::format("= {:.1g}", probability);
}

}  // namespace plumbline::measure
