// Table of shape searches by effect id.
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/carried_columns.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/shapes/moment_search.h"
#include "app/measure/diagnosis/shapes/periodic_search.h"
#include "app/measure/diagnosis/shapes/shape_gain.h"
#include "firmware-like/effects/catalogue.h"

namespace plumbline::measure {
namespace {

// Shape search for the time constant of thermal drift.

constexpr double kDriftTrials =
    4;  // effective number: neighbouring time constants give nearly equal curves

constexpr std::size_t kMostDrifts = 2;  // of one explanation
/// Least ratio of their time constants. A judgement: below it, one exponential follows the sum of
/// two to a few per cent.
constexpr double kMinDriftRatio = 4;

const effects::Effect& ThermalDrift() {
  static const effects::Effect& effect = *effects::FindEffect("thermal_drift");
  return effect;
}

Block DriftBlock(double time_constant_s) {
  Block block;
  block.term.effect = &ThermalDrift();
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

/// Orthonormal basis of constant translations of the base at the rows, whitened and projected.
struct ConstantShift {
  explicit ConstantShift(const LinearProblem& problem) {
    Eigen::MatrixXd columns = problem.Carried(TranslationEntries(effects::Influence<double>::kBase),
                                              Eigen::MatrixXd::Ones(problem.rows().count(), 1));
    problem.Project(columns);
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(columns);
    basis = qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), qr.rank());
  }
  Eigen::MatrixXd basis;
};

/// Shares of the final drift at the rows of a problem, for trial time constants: what does not
/// depend on the residual.
class DriftScan {
 public:
  static constexpr int kSteps = 24;

  DriftScan(const LinearProblem& problem, double span_s)
      : carried_(problem.CarriedBy(TranslationEntries(effects::Influence<double>::kBase))),
        t_(static_cast<Eigen::Index>(carried_.rows().size())) {
    for (std::size_t k = 0; k < carried_.rows().size(); ++k) {
      const RowIndex row = problem.rows()[carried_.rows()[k]];
      t_[static_cast<Eigen::Index>(k)] = problem.data().conditions[row].t_s.value_or(0);
    }
    warmth_.resize(t_.size(), kSteps);
    for (int k = 0; k < kSteps; ++k) {
      tau_s_.push_back(span_s / 40 * std::pow(Ratio(), k));
      warmth_.col(k) = WarmthAt(tau_s_.back());
      grams_.push_back(carried_.Gram(warmth_.col(k)));
    }
  }

  /// Ratio of successive time constants of the scan.
  static double Ratio() { return std::pow(200.0, 1.0 / (kSteps - 1)); }
  Eigen::MatrixXd Along(const Eigen::VectorXd& residual) const { return carried_.Along(residual); }

  /// Gains of the scan with their time constants, best first.
  std::vector<std::pair<double, double>> Gains(const Eigen::MatrixXd& along) const {
    std::vector<std::pair<double, double>> gains;
    const Eigen::MatrixXd moments = along.transpose() * warmth_;
    for (int k = 0; k < kSteps; ++k) {
      const auto step = static_cast<std::size_t>(k);
      gains.emplace_back(GainFrom(grams_[step], moments.col(k)), tau_s_[step]);
    }
    std::sort(gains.rbegin(), gains.rend());
    return gains;
  }

  double GainAt(double tau_s, const Eigen::MatrixXd& along) const {
    const Eigen::MatrixXd warmth = WarmthAt(tau_s);
    return GainFrom(carried_.Gram(warmth), CarriedColumns::Moments(warmth, along));
  }

 private:
  Eigen::VectorXd WarmthAt(double tau_s) const { return 1 - (-t_ / tau_s).array().exp(); }

  const CarriedColumns& carried_;
  Eigen::VectorXd t_;
  std::vector<double> tau_s_;
  Eigen::MatrixXd warmth_;
  std::vector<Eigen::MatrixXd> grams_;
};

class DriftSearch final : public ShapeSearch {
 public:
  std::vector<Block> Propose(const LinearProblem& problem,
                             const Eigen::VectorXd& residual) const override {
    double span = 0;
    for (const effects::Conditions& moment : problem.data().conditions) {
      span = std::max(span, moment.t_s.value_or(0));
    }
    if (!(span > 0)) return {};
    const DriftScan& scan = problem.Kept<DriftScan>(0, [&] { return DriftScan(problem, span); });
    const Eigen::MatrixXd along = scan.Along(residual);
    constexpr int kHalvings = 5;
    constexpr std::size_t kKept = 2;
    const std::vector<std::pair<double, double>> coarse = scan.Gains(along);
    Found found;
    for (std::size_t k = 0; k < kKept; ++k) {
      auto [best, tau] = coarse[k];
      double step = std::sqrt(DriftScan::Ratio());
      for (int halving = 0; halving < kHalvings; ++halving, step = std::sqrt(step)) {
        for (const double other : {tau / step, tau * step}) {
          const double of_other = scan.GainAt(other, along);
          if (of_other > best) std::tie(best, tau) = std::pair(of_other, other);
        }
      }
      found.emplace_back(best, DriftBlock(tau));
    }
    return Best(std::move(found), kKept);
  }

  std::optional<Eigen::MatrixXd> Columns(const LinearProblem& problem,
                                         const Block& block) const override {
    const double tau_s = block.columns.front().values.back();
    const Eigen::ArrayXd t_s =
        SignalAtRows(problem, [](const effects::Conditions& m) { return m.t_s.value_or(0); });
    const Eigen::MatrixXd warmth = 1 - (-t_s / tau_s).exp();
    return problem.Carried(TranslationEntries(effects::Influence<double>::kBase), warmth);
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

  /// The part of the drift that is not constant over the rows must be as large as the evidence that
  /// rules out a rival, four sigma: otherwise a constant shift is not ruled out.
  bool Visible(const LinearProblem& problem, const effects::ActiveEffect& effect) const override {
    Eigen::Vector3d size_m = Eigen::Vector3d::Zero();
    double tau_s = 0;
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      const int spec = effect.term.parameters[k].spec;
      if (spec < 3) size_m[spec] = effect.values[k];
      if (spec == 3) tau_s = effect.values[k];
    }
    const Eigen::ArrayXd t_s =
        SignalAtRows(problem, [](const effects::Conditions& m) { return m.t_s.value_or(0); });
    Eigen::MatrixXd moved = problem.Carried(TranslationEntries(effects::Influence<double>::kBase),
                                            (1 - (-t_s / tau_s).exp()).matrix()) *
                            size_m;
    problem.Project(moved);
    const Eigen::MatrixXd& basis =
        problem.Kept<ConstantShift>(0, [&] { return ConstantShift(problem); }).basis;
    return (moved - basis * (basis.transpose() * moved)).squaredNorm() > kRivalGap;
  }

  bool Excludes(const LinearProblem&, std::span<const Block* const> support) const override {
    std::vector<double> constants_s;
    for (const Block* block : support) {
      if (block->term.effect == &ThermalDrift())
        constants_s.push_back(block->columns.front().values.back());
    }
    if (constants_s.size() < 2) return false;
    const auto [fast, slow] = std::ranges::minmax(constants_s);
    return constants_s.size() > kMostDrifts || slow < kMinDriftRatio * fast;
  }
};

/// For `thermal_drift`: proposes the two best time constants between 1/40 and 5 times the recorded
/// time span. An explanation contains at most two: the sum of two exponentials is distinguishable
/// from one only if their time constants are far apart, that of three hardly ever.
const ShapeSearch& ThermalDriftSearch() {
  static const DriftSearch search;
  return search;
}

/// For `compliance_asymmetry`, which is linear: where the torque has one direction, |tau| is tau,
/// and the compliance of the joint is the simpler explanation.
class AsymmetrySearch final : public ShapeSearch {
  using I = effects::Influence<double>;

 public:
  bool DependsOnResidual() const override { return false; }
  std::vector<Block> Fixed(const Dataset& data) const override {
    return {WholeBlock(data, *effects::FindEffect("compliance_asymmetry"), "")};
  }

  /// What the compliance of the same joint cannot reproduce must be as large as the evidence that
  /// rules out a rival, four sigma, in every joint.
  bool Visible(const LinearProblem& problem, const effects::ActiveEffect& effect) const override {
    const Eigen::MatrixXd everywhere = Eigen::MatrixXd::Ones(problem.rows().count(), 1);
    for (std::size_t k = 0; k < effect.values.size(); ++k) {
      const int joint = effect.term.parameters[k].joint;
      const auto column = [&](I::JointEntry entry) {
        Eigen::MatrixXd of_entry = problem.Carried({entry * model::kMaxJoints + joint}, everywhere);
        problem.Project(of_entry);
        return Eigen::VectorXd(of_entry.col(0));
      };
      const Eigen::VectorXd moved = effect.values[k] * column(I::kLoadShare);
      const Eigen::VectorXd yielded = column(I::kCompliance).normalized();
      if (!((moved - yielded * yielded.dot(moved)).squaredNorm() > kRivalGap)) return false;
    }
    return true;
  }
};

const ShapeSearch& ComplianceAsymmetrySearch() {
  static const AsymmetrySearch search;
  return search;
}

struct Registered {
  std::string_view id;
  const ShapeSearch& (*search)();
};

constexpr std::array kSearches = {
    Registered{"compliance_asymmetry", ComplianceAsymmetrySearch},
    Registered{"counterbalance", CounterbalanceSearch},
    Registered{"gear_periodic", GearPeriodicSearch},
    Registered{"thermal_drift", ThermalDriftSearch},
    Registered{"step_event", StepEventSearch},
    Registered{"tilt_event", TiltEventSearch},
    Registered{"offset_event", OffsetEventSearch},
    Registered{"camera_zoom", CameraZoomSearch},
};

}  // namespace

const ShapeSearch* ShapeSearchOf(const effects::Effect& effect) {
  const auto found = std::ranges::find_if(
      kSearches, [&](const Registered& known) { return known.id == effect.traits().id; });
  return found == kSearches.end() ? nullptr : &found->search();
}

bool ShapesAreVisible(const LinearProblem& problem,
                      const std::vector<effects::ActiveEffect>& effects) {
  return std::ranges::all_of(effects, [&](const effects::ActiveEffect& effect) {
    const ShapeSearch* const search = ShapeSearchOf(*effect.term.effect);
    return search == nullptr || search->Visible(problem, effect);
  });
}

}  // namespace plumbline::measure
