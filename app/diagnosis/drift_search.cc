#include "app/diagnosis/drift_search.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "app/diagnosis/shape_gain.h"
#include "firmware-like/effects/thermal_drift.h"

namespace plumbline::diagnosis {
namespace {

constexpr double kDriftTrials =
    4;  // effective number: neighbouring time constants give nearly equal curves

Block DriftBlock(double time_constant_s) {
  Block block;
  block.term.effect = &effects::ThermalDrift();
  block.id = block.term.effect->traits().id;
  block.term.parameters = {{0}, {1}, {2}, {3}};
  for (int axis = 0; axis < 3; ++axis) {
    BlockColumn& column = block.columns.emplace_back();
    column.parameter = axis;
    column.values = {0, 0, 0, time_constant_s};
    column.plausible = PlausibleSizes(block.term.effect->traits(), axis);
  }
  block.trials = kDriftTrials;
  return block;
}

class DriftSearch final : public ShapeSearch {
 public:
  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    double span = 0;
    for (const effects::Conditions& moment : problem.data().conditions) {
      span = std::max(span, moment.t_s.value_or(0));
    }
    if (!(span > 0)) return {};
    const Eigen::VectorXd t =
        SignalAtRows(problem, [](const effects::Conditions& m) { return m.t_s.value_or(0); });
    const auto gain = [&](double tau) {
      const Eigen::MatrixXd warmth = 1 - (-t / tau).array().exp();
      return Gain(problem,
                  problem.Carried(TranslationEntries(effects::Influence<double>::kBase), warmth),
                  residual);
    };
    constexpr int kSteps = 24, kHalvings = 5;
    constexpr std::size_t kKept = 2;
    const double ratio = std::pow(200.0, 1.0 / (kSteps - 1));
    std::vector<std::pair<double, double>> coarse;  // gain, time constant
    for (int k = 0; k < kSteps; ++k) {
      const double tau = span / 40 * std::pow(ratio, k);
      coarse.emplace_back(gain(tau), tau);
    }
    std::sort(coarse.rbegin(), coarse.rend());
    Found found;
    for (std::size_t k = 0; k < kKept; ++k) {
      auto [best, tau] = coarse[k];
      double step = std::sqrt(ratio);
      for (int halving = 0; halving < kHalvings; ++halving, step = std::sqrt(step)) {
        for (const double other : {tau / step, tau * step}) {
          const double of_other = gain(other);
          if (of_other > best) std::tie(best, tau) = std::pair(of_other, other);
        }
      }
      found.emplace_back(best, DriftBlock(tau));
    }
    return Best(std::move(found), kKept);
  }

  std::vector<Block> Refitted(const Dataset&, const effects::ActiveEffect& effect) const override {
    std::vector<Block> blocks;
    const auto& specs = effect.term.effect->traits().parameters;
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      const auto spec = static_cast<std::size_t>(effect.term.parameters[k].spec);
      if (specs[spec].role == effects::ParameterRole::kShape)
        blocks.push_back(DriftBlock(effect.values[k]));
    }
    return blocks;
  }

  bool Excludes(const LinearProblem&, std::span<const Block* const> support) const override {
    return std::count_if(support.begin(), support.end(), [](const Block* block) {
             return block->term.effect == &effects::ThermalDrift();
           }) > 1;
  }
};

}  // namespace

const ShapeSearch& ThermalDriftSearch() {
  static const DriftSearch search;
  return search;
}

}  // namespace plumbline::diagnosis
