#include "app/measure/siblings/fleet_prior.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "app/measure/siblings/repeated_rows.h"
#include "firmware-like/effects/catalogue.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kMinFleetDeviations = 3;  // of a fleet's mean from zero

/// Place among all sizes: by catalogue, word and joint.
auto PlaceOf(const SizeKey& key) {
  const auto effect = std::ranges::find(effects::Catalogue(), key.effect);
  const effects::TermParameter& parameter = key.parameter;
  return std::tuple(effect - effects::Catalogue().begin(), key.word, parameter.joint, parameter.of,
                    parameter.spec, parameter.harmonic);
}

/// Sizes found in at least two, and at least half, of the arms.
std::vector<SizeKey> CommonSizes(const std::vector<const ArmFindings*>& arms) {
  std::vector<SizeKey> keys;
  std::vector<std::size_t> found_in;
  for (const ArmFindings* arm : arms) {
    for (const effects::ActiveEffect& effect : arm->effects) {
      for (const SizeKey& key : SharedSizes(effect.term)) {
        const auto at = std::ranges::find(keys, key);
        if (at == keys.end()) {
          keys.push_back(key);
          found_in.push_back(1);
        } else {
          ++found_in[at - keys.begin()];
        }
      }
    }
  }
  std::vector<SizeKey> common;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    if (found_in[k] >= 2 && 2 * found_in[k] >= arms.size()) common.push_back(keys[k]);
  }
  std::ranges::sort(common, {}, PlaceOf);
  return common;
}

/// The sizes that every arm has of its own, of all revolute joints.
std::vector<SizeKey> IndividualSizes(const model::CellModel& cell) {
  std::vector<SizeKey> keys;
  for (const effects::Effect* effect : effects::Catalogue()) {
    if (!effect->traits().zero_mean_over_arms) continue;
    for (std::size_t joint = 0; joint < cell.robot.joints.size(); ++joint) {
      if (cell.robot.joints[joint].type != model::JointType::kRevolute) continue;
      effects::TermParameter parameter;
      parameter.joint = static_cast<int>(joint);
      keys.push_back({effect, {}, parameter});
    }
  }
  return keys;
}

/// Covariance of the sizes of one effect.
Eigen::MatrixXd CovarianceOf(const effects::ActiveEffect& effect, const std::vector<SizeKey>& keys,
                             const Eigen::MatrixXd& covariance) {
  std::vector<Eigen::Index> places;
  for (const effects::TermParameter& parameter : effect.term.parameters) {
    const SizeKey key{effect.term.effect, effect.term.word, parameter};
    places.push_back(std::ranges::find(keys, key) - keys.begin());
  }
  return covariance(places, places);
}

/// A prior in vectors.
struct Sizes {
  std::vector<SizeKey> keys;
  std::vector<double> means;
  Eigen::MatrixXd covariance;  ///< of a further arm
};

Sizes SizesOf(const std::vector<SizePrior>& prior) {
  const auto count = static_cast<Eigen::Index>(prior.size());
  Sizes sizes{{}, {}, Eigen::MatrixXd::Zero(count, count)};
  for (const SizePrior& one : prior) {
    const auto at = static_cast<Eigen::Index>(sizes.keys.size());
    sizes.covariance(at, at) = std::pow(one.pooled.next_sd(), 2);
    sizes.keys.push_back(one.key);
    sizes.means.push_back(one.pooled.mean);
  }
  return sizes;
}

/// Effects with their part of the covariance.
std::vector<effects::ActiveEffect> EffectsWith(const std::vector<SizeKey>& keys,
                                               const std::vector<double>& values,
                                               const Eigen::MatrixXd& covariance,
                                               const model::CellModel& cell) {
  std::vector<effects::ActiveEffect> effects =
      EffectsWith(keys, values, effects::PrismaticJoints(cell.robot));
  for (effects::ActiveEffect& effect : effects) {
    effect.covariance = CovarianceOf(effect, keys, covariance);
  }
  return effects;
}

/// Places of the sizes to apply: all but individual ones that the rows hardly show, which remain
/// near zero.
/// @param covariance  after the update
std::vector<Eigen::Index> ShownPlaces(const std::vector<SizeKey>& keys,
                                      const std::vector<SizePrior>& prior,
                                      const Eigen::MatrixXd& covariance) {
  constexpr double kHardly = 0.8;  // of the prior's variance is left
  std::vector<Eigen::Index> shown;
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const bool individual =
        keys[k].effect->traits().zero_mean_over_arms && prior[k].pooled.mean == 0;
    if (individual && covariance(at, at) > kHardly * std::pow(prior[k].pooled.next_sd(), 2))
      continue;
    shown.push_back(at);
  }
  return shown;
}

/// The sizes of a prior that a fit determines, as the measurement of a Kalman update.
struct Innovation {
  Eigen::MatrixXd selects;     ///< of all sizes, those that are determined
  Eigen::VectorXd away;        ///< fitted minus prior
  Eigen::MatrixXd covariance;  ///< of `away`

  double Probability() const {
    if (away.size() == 0) return 1;
    return statistics::ChiSquareTail(away.dot(covariance.ldlt().solve(away)),
                                     static_cast<double>(away.size()));
  }
};

Innovation InnovationOf(const SizeFit& fit, const Sizes& prior) {
  std::vector<Eigen::Index> of_fit, of_prior;
  for (std::size_t k = 0; k < fit.keys.size(); ++k) {
    const auto at = std::ranges::find(prior.keys, fit.keys[k]);
    if (at == prior.keys.end()) continue;
    of_fit.push_back(static_cast<Eigen::Index>(k));
    of_prior.push_back(at - prior.keys.begin());
  }
  const auto count = static_cast<Eigen::Index>(prior.keys.size());
  const Eigen::Map<const Eigen::VectorXd> mean(prior.means.data(), count);
  return {Eigen::MatrixXd::Identity(count, count)(of_prior, Eigen::all),
          fit.values(of_fit) - mean(of_prior),
          prior.covariance(of_prior, of_prior) + fit.covariance(of_fit, of_fit)};
}

/// Estimates of each agreed size in the arms that determine it.
std::vector<std::vector<Estimate>> EstimatesOf(const std::vector<SizeKey>& keys,
                                               const std::vector<const SizeFit*>& fits) {
  std::vector<std::vector<Estimate>> estimates(keys.size());
  for (const SizeFit* fit : fits) {
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const auto at = std::ranges::find(fit->keys, keys[k]);
      if (at == fit->keys.end()) continue;
      const auto place = at - fit->keys.begin();
      const double sd = std::sqrt(fit->covariance(place, place));
      if (std::isfinite(sd) && sd > 0) estimates[k].push_back({fit->values[place], sd});
    }
  }
  return estimates;
}

std::vector<SizePrior> PriorOf(const AgreedSizes& agreed, const std::vector<const SizeFit*>& fits) {
  const std::vector<SizeKey>& keys = agreed.keys;
  const std::vector<std::vector<Estimate>> estimates = EstimatesOf(keys, fits);
  std::vector<SizePrior> prior;
  const std::span<const std::vector<Estimate>> of_common(estimates.data(), agreed.common);
  const std::optional<CommonSpread> common = CommonSpreadOf(of_common);
  std::vector<std::size_t> of_own;  // sizes that each arm has of its own
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const bool shares = k < agreed.common && common && common->shared_by[k];
    const std::optional<Pooled> pooled =
        PoolEstimates(estimates[k], shares ? std::optional(common->spread) : std::nullopt);
    if (!pooled) continue;
    const bool zero_mean = keys[k].effect->traits().zero_mean_over_arms &&
                           std::abs(pooled->mean) < kMinFleetDeviations * pooled->mean_sd;
    if (zero_mean) of_own.push_back(k);
    if (!zero_mean && k < agreed.common) prior.push_back({keys[k], *pooled});
  }
  std::vector<Estimate> individual;
  for (const std::size_t k : of_own)
    individual.insert(individual.end(), estimates[k].begin(), estimates[k].end());
  const double spread = SpreadAboutZero(individual);
  if (!(spread > 0)) return prior;
  for (const std::size_t k : of_own)
    prior.push_back({keys[k], {0, spread, 0, static_cast<int>(estimates[k].size())}});
  return prior;
}

/// The prior of all fits except one; nullptr: of all.
std::vector<SizePrior> PriorWithout(const ArmFit* one, const AgreedSizes& agreed,
                                    const std::vector<ArmFit>& fits) {
  std::vector<const SizeFit*> others;
  for (const ArmFit& fit : fits) {
    if (&fit != one) others.push_back(&fit.fit);
  }
  return PriorOf(agreed, others);
}

}  // namespace

std::string FleetPrior::Source() const {
  if (model.empty()) return fmt::format("siblings {}", fmt::join(ArmNames(), ", "));
  return fmt::format("{} arms of {}, {}{}", arms.size(), model, date,
                     without_itself ? ", without this arm itself" : "");
}

std::vector<std::string> FleetPrior::ArmNames() const {
  std::vector<std::string> names;
  for (const ArmFit& one : arms) names.push_back(one.arm);
  return names;
}

Result<AgreedSizes> AgreeOnSizes(const std::vector<const ArmFindings*>& arms,
                                 const model::CellModel& cell) {
  AgreedSizes agreed{CommonSizes(arms), 0};
  agreed.common = agreed.keys.size();
  if (agreed.keys.empty()) {
    return Error{"no size of an effect of the arm was found in at least two, and half, of them"};
  }
  for (const SizeKey& key : IndividualSizes(cell)) {
    if (std::ranges::find(agreed.keys, key) == agreed.keys.end()) agreed.keys.push_back(key);
  }
  return agreed;
}

double ProbabilityOf(const SizeFit& fit, const std::vector<SizePrior>& prior) {
  return InnovationOf(fit, SizesOf(prior)).Probability();
}

Result<FleetPrior> PoolFits(const AgreedSizes& agreed, std::vector<ArmFit> fits) {
  const std::size_t all = fits.size();
  FleetPrior prior;
  while (fits.size() > 2) {
    std::vector<double> probabilities;
    for (const ArmFit& one : fits) {
      probabilities.push_back(ProbabilityOf(one.fit, PriorWithout(&one, agreed, fits)));
    }
    const auto least = std::ranges::min_element(probabilities);
    if (*least >= kDifferentArm / static_cast<double>(fits.size())) break;
    const auto different = fits.begin() + (least - probabilities.begin());
    prior.left_out.push_back({different->arm, fmt::format("it differs from the others (p {})",
                                                          ProbabilityText(*least))});
    fits.erase(different);
  }
  if (fits.size() < 2) return Error{"at least two arms are needed"};
  if (2 * fits.size() <= all) return Error{"most of the arms differ from each other"};
  prior.sizes = PriorWithout(nullptr, agreed, fits);
  prior.arms = std::move(fits);
  prior.agreed = agreed;
  if (prior.sizes.empty()) return Error{"the arms' rows do not determine the sizes"};
  return prior;
}

Result<FleetPrior> WithoutArmOf(const MeasuredTable& rows, FleetPrior prior) {
  const std::vector<std::string> digests = RowDigests(rows, prior.cell.robot.joints);
  const auto own = std::erase_if(
      prior.arms, [&](const ArmFit& one) { return IsSketchOf(one.row_sketch, digests); });
  if (own == 0) return prior;
  prior.without_itself = true;
  Result<FleetPrior> others = PoolFits(prior.agreed, prior.arms);
  if (!others)
    return Error{fmt::format("the prior of {}, {}, without this arm itself: {}", prior.model,
                             prior.date, others.error())};
  prior.arms = std::move(others.value().arms);
  prior.sizes = std::move(others.value().sizes);
  prior.left_out.insert(prior.left_out.end(), others->left_out.begin(), others->left_out.end());
  return prior;
}

std::vector<effects::ActiveEffect> MeanEffectsOf(const std::vector<SizePrior>& prior,
                                                 const model::CellModel& cell) {
  const Sizes sizes = SizesOf(prior);
  return EffectsWith(sizes.keys, sizes.means, sizes.covariance, cell);
}

Result<Posterior> UpdatedBy(const Arm& arm, const std::vector<SizePrior>& prior, int threads) {
  Sizes sizes = SizesOf(prior);
  auto& [keys, means, covariance] = sizes;
  const Result<SizeFit> fit = FitSizes(arm, keys, means, OwnFindings::kOmitted, threads);
  if (!fit) return Error{fit.error()};
  Posterior posterior;
  const Innovation innovation = InnovationOf(*fit, sizes);
  posterior.p_value = innovation.Probability();
  if (innovation.away.size() > 0) {  // Kalman update
    const Eigen::Map<Eigen::VectorXd> mean(means.data(), static_cast<Eigen::Index>(means.size()));
    const Eigen::MatrixXd& selects = innovation.selects;
    const Eigen::MatrixXd gain =
        innovation.covariance.ldlt().solve(selects * covariance).transpose();
    const Eigen::VectorXd updated = mean + gain * innovation.away;
    covariance = covariance - gain * selects * covariance;
    posterior.parameters = (selects * gain).trace();
    means.assign(updated.begin(), updated.end());
  }
  const std::vector<Eigen::Index> shown = ShownPlaces(keys, prior, covariance);
  const Eigen::MatrixXd of_shown = covariance(shown, shown);
  std::vector<SizeKey> shown_keys;
  std::vector<double> shown_means;
  for (const Eigen::Index at : shown) {
    shown_keys.push_back(keys[at]);
    shown_means.push_back(means[at]);
  }
  posterior.effects = EffectsWith(shown_keys, shown_means, of_shown, arm.cell);
  Result<std::vector<TipDisplacement>> displacements =
      DisplacementsBy(posterior.effects, arm, threads);
  if (!displacements) return displacements.failure();
  posterior.displacements = std::move(displacements).value();
  return posterior;
}

}  // namespace plumbline::measure
