#include "app/measure/siblings/sibling_prior.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware-like/effects/catalogue.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

constexpr double kMinFleetDeviations = 3;  // of a fleet's mean from zero

/// Sizes found in at least two, and at least half, of the arms, in order of first appearance.
std::vector<SizeKey> CommonSizes(const std::vector<Arm>& arms) {
  std::vector<SizeKey> keys;
  std::vector<std::size_t> found_in;
  for (const Arm& arm : arms) {
    for (const Finding& finding : arm.diagnosis.findings) {
      for (const SizeKey& key : SharedSizes(finding)) {
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

}  // namespace

std::vector<SizePrior> PriorFrom(const std::vector<Arm>& arms, int threads,
                                 std::vector<std::string>& notes) {
  std::vector<SizeKey> keys = CommonSizes(arms);
  if (keys.empty()) return {};
  const std::size_t common_keys = keys.size();
  for (const SizeKey& key : IndividualSizes(arms.front().cell)) {
    if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
  }
  std::vector<std::vector<Estimate>> estimates(keys.size());
  for (const Arm& arm : arms) {
    const Result<SizeFit> fit =
        FitSizes(arm, keys, std::vector<double>(keys.size(), 0.0), true, threads);
    if (!fit) {
      notes.push_back(fmt::format("sibling {} does not take part: {}", arm.name, fit.error()));
      continue;
    }
    for (std::size_t k = 0; k < keys.size(); ++k) {
      const auto at = std::ranges::find(fit->keys, keys[k]);
      if (at == fit->keys.end()) continue;
      const auto place = at - fit->keys.begin();
      const double sd = std::sqrt(fit->covariance(place, place));
      if (std::isfinite(sd) && sd > 0) estimates[k].push_back({fit->values[place], sd});
    }
  }
  std::vector<SizePrior> prior;
  const std::span<const std::vector<Estimate>> of_common(estimates.data(), common_keys);
  const std::optional<CommonSpread> common = CommonSpreadOf(of_common);
  std::vector<std::size_t> of_own;  // sizes that each arm has of its own
  for (std::size_t k = 0; k < keys.size(); ++k) {
    const bool shares = k < common_keys && common && common->shared_by[k];
    const std::optional<Pooled> pooled =
        PoolEstimates(estimates[k], shares ? std::optional(common->spread) : std::nullopt);
    if (!pooled) continue;
    const bool zero_mean = keys[k].effect->traits().zero_mean_over_arms &&
                           std::abs(pooled->mean) < kMinFleetDeviations * pooled->mean_sd;
    if (zero_mean) of_own.push_back(k);
    if (!zero_mean && k < common_keys) prior.push_back({keys[k], *pooled});
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

std::vector<effects::ActiveEffect> MeanEffectsOf(const std::vector<SizePrior>& prior,
                                                 const model::CellModel& cell) {
  const Sizes sizes = SizesOf(prior);
  return EffectsWith(sizes.keys, sizes.means, sizes.covariance, cell);
}

Result<Posterior> UpdatedBy(const Arm& arm, const std::vector<SizePrior>& prior, int threads) {
  auto [keys, means, covariance] = SizesOf(prior);
  const auto count = static_cast<Eigen::Index>(keys.size());
  const Result<SizeFit> fit = FitSizes(arm, keys, means, false, threads);
  if (!fit) return Error{fit.error()};
  Posterior posterior;
  const auto determined = static_cast<Eigen::Index>(fit->keys.size());
  if (determined > 0) {
    // Kalman update with H selecting the sizes that the rows determine.
    Eigen::MatrixXd selects = Eigen::MatrixXd::Zero(determined, count);
    for (Eigen::Index i = 0; i < determined; ++i) {
      const auto at = std::ranges::find(keys, fit->keys[i]);
      selects(i, at - keys.begin()) = 1;
    }
    const Eigen::Map<Eigen::VectorXd> mean(means.data(), count);
    const Eigen::MatrixXd innovation = selects * covariance * selects.transpose() + fit->covariance;
    const Eigen::VectorXd away = fit->values - selects * mean;
    posterior.p_value = statistics::ChiSquareTail(away.dot(innovation.ldlt().solve(away)),
                                                  static_cast<double>(determined));
    const Eigen::MatrixXd gain = innovation.ldlt().solve(selects * covariance).transpose();
    const Eigen::VectorXd updated = mean + gain * away;
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
  return posterior;
}

}  // namespace plumbline::measure
