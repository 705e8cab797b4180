#include "app/measure/diagnosis/search/unknown.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/carried_columns.h"
#include "app/measure/diagnosis/linear/empirical_columns.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/search/explained_effects.h"

namespace plumbline::measure {
namespace {

using I = effects::Influence<double>;
constexpr std::size_t kBlocksKept = 4;

/// Curves along one signal, or surfaces over two, on one carrier: what does not depend on the
/// residual.
struct EmpiricalFits {
  Eigen::MatrixXd factors;  ///< in the order of the carried columns
  NestedFits fits;

  EmpiricalFits(const CarriedColumns& carried, Eigen::MatrixXd of_rows)
      : factors(std::move(of_rows)), fits(carried.Gram(factors)) {}

  std::vector<double> Gains(const Eigen::MatrixXd& along) const {
    return fits.Gains(CarriedColumns::Moments(factors, along));
  }
};

/// Empirical blocks, each with its reduction of the score.
using Scored = std::vector<std::pair<double, Block>>;

/// A carrier, and a residual along it.
struct CarriedResidual {
  const std::vector<int>& entries;
  const CarriedColumns& columns;
  Eigen::MatrixXd along;

  CarriedResidual(const LinearProblem& problem, const std::vector<int>& carrier,
                  const Eigen::VectorXd& residual)
      : entries(carrier), columns(problem.CarriedBy(carrier)), along(columns.Along(residual)) {}
};

/// Key of what is kept for a carrier and one or two signals.
int KeyOfFits(const Dataset& data, const std::vector<int>& carrier, SignalIndex first,
              int second = 0) {
  const int signals = data.signals.count() + 1;
  return (carrier.front() * signals + first.value()) * signals + second;
}

/// Curves along one signal, of every degree that its values support.
void AddCurves(const LinearProblem& problem, const CarriedResidual& residual, SignalIndex signal,
               double trials, Scored& found) {
  const Dataset& data = problem.data();
  const std::vector<int>& carrier = residual.entries;
  const std::vector<int> degrees = Degrees(data.signals[signal], carrier.size());
  if (degrees.empty()) return;
  const int first = IsFreeFrame(data, carrier) ? 1 : 0;
  const auto& curves = problem.Kept<EmpiricalFits>(KeyOfFits(data, carrier, signal), [&] {
    const Eigen::MatrixXd factors =
        Polynomials(problem, residual.columns.rows(), signal, degrees.back());
    return EmpiricalFits(residual.columns, factors.rightCols(factors.cols() - first));
  });
  const std::vector<double> gains = curves.Gains(residual.along);
  const double per_column = std::log(static_cast<double>(problem.clusters()));
  for (const int degree : degrees) {
    const auto last = carrier.size() * static_cast<std::size_t>(degree - first + 1) - 1;
    found.emplace_back(gains[last] - per_column * curves.fits.Rank(last),
                       EmpiricalBlock(data, signal, carrier, degree, first == 0, trials));
  }
}

/// Surfaces over two signals: bilinear (includes their product) and quadratic.
void AddSurfaces(const LinearProblem& problem, const CarriedResidual& residual,
                 const SignalPair& pair, double trials, Scored& found) {
  const Dataset& data = problem.data();
  const double per_column = std::log(static_cast<double>(problem.clusters()));
  const auto distinct = [&](SignalIndex signal) { return data.signals[signal].distinct; };
  const bool with_constant = !IsFreeFrame(data, residual.entries);
  struct Surfaces {
    EmpiricalFits bilinear, quadratic;
  };
  const int least = std::min(distinct(pair.first), distinct(pair.second));
  if (least <= 1) return;
  const int second = pair.second.value() + 1;
  const auto& surfaces =
      problem.Kept<Surfaces>(KeyOfFits(data, residual.entries, pair.first, second), [&] {
        const auto fits = [&](int degree) {
          return EmpiricalFits(residual.columns, SurfaceFactors(problem, residual.columns.rows(),
                                                                pair, degree, with_constant));
        };
        return Surfaces{fits(1), fits(2)};
      });
  for (const int degree : {1, 2}) {
    if (least <= degree) return;
    const EmpiricalFits& surface = degree == 1 ? surfaces.bilinear : surfaces.quadratic;
    const std::vector<double> gains = surface.Gains(residual.along);
    found.emplace_back(gains.back() - per_column * surface.fits.Rank(gains.size() - 1),
                       EmpiricalSurface(data, pair.first, pair.second, residual.entries, degree,
                                        with_constant, trials));
  }
}

/// Pairs of recorded signals, without joint signals.
std::vector<SignalPair> SignalPairs(const Dataset& data) {
  std::vector<SignalIndex> signals;
  for (const SignalIndex s : data.signals.indices()) {
    if (!data.signals[s].of_joint) signals.push_back(s);
  }
  std::vector<SignalPair> pairs;
  for (std::size_t i = 0; i < signals.size(); ++i) {
    for (std::size_t j = i + 1; j < signals.size(); ++j) pairs.emplace_back(signals[i], signals[j]);
  }
  return pairs;
}

/// True if an empirical curve is much larger between the rows than at them. Surfaces are exempt:
/// their corners are often far from every row, and the written effect is limited to its rows
/// anyway.
bool Overshoots(const CandidateSet& candidate_set, const Explanation& explanation) {
  constexpr int kNodes = 60;
  const Dataset& data = candidate_set.problem().data();
  const Coefficients coefficients = candidate_set.CoefficientsOf(explanation);
  for (const BlockIndex index : explanation.blocks) {
    const Block& block = candidate_set.blocks()[index];
    if (!block.empirical() || block.columns.front().second_signal) continue;
    const RecordedSignal& signal = data.signals[*block.columns.front().signal];
    std::map<int, std::map<int, double>> curves;  // carrier -> degree -> coefficient
    for (const auto& [key, value] : coefficients) {
      if (key.first != index) continue;
      const BlockColumn& column = block.columns[key.second];
      curves[column.entry][column.degree] = value;
    }
    for (const auto& [entry, curve] : curves) {
      const auto at = [&curve = curve](double x) {
        double sum = 0;
        for (const auto& [degree, value] : curve) sum += value * Legendre(degree, x);
        return std::abs(sum);
      };
      double at_rows = 0, between = 0;
      for (const RowIndex row : candidate_set.problem().rows()) {
        at_rows = std::max(at_rows, at(Scaled(signal, signal.values[row])));
      }
      for (int k = 0; k <= kNodes; ++k) between = std::max(between, at(2.0 * k / kNodes - 1));
      if (between > kMaxOvershoot * at_rows) return true;
    }
  }
  return false;
}

/// Number of empirical terms that the search chooses among: signals or pairs, carriers, degrees. A
/// surface additionally pays for the choice of its second driver among the signals.
struct ShapeTrials {
  double of_curve, of_surface;

  explicit ShapeTrials(const Dataset& data) {
    const double carriers = static_cast<double>(Carriers(data).size());
    const double signals = static_cast<double>(data.signals.size());
    of_curve = carriers * (8 * signals + 2 * static_cast<double>(SignalPairs(data).size()));
    of_surface = of_curve * std::max(1.0, signals - 1);
  }
};

}  // namespace

std::optional<Block> BestEmpirical(const LinearProblem& problem, const Eigen::VectorXd& residual,
                                   const std::vector<SignalIndex>& drivers,
                                   const std::vector<int>& carriers) {
  const ShapeTrials trials(problem.data());
  Scored found;
  const CarriedResidual along(problem, carriers, residual);
  if (drivers.size() == 1) {
    AddCurves(problem, along, drivers.front(), trials.of_curve, found);
  } else {
    AddSurfaces(problem, along, {drivers[0], drivers[1]}, trials.of_surface, found);
  }
  const auto best = std::ranges::max_element(
      found, [](const auto& a, const auto& b) { return a.first < b.first; });
  if (best == found.end()) return std::nullopt;
  return best->second;
}

std::vector<BlockIndex> AddEmpirical(CandidateSet& candidate_set, const Eigen::VectorXd& residual) {
  const LinearProblem& problem = candidate_set.problem();
  const Dataset& data = problem.data();
  const auto carriers = Carriers(data);
  const std::vector<SignalPair> pairs = SignalPairs(data);
  const ShapeTrials trials(data);
  Scored found;
  for (const std::vector<int>& carrier : carriers) {
    const CarriedResidual along(problem, carrier, residual);
    for (const SignalIndex signal : data.signals.indices()) {
      if (MayFollow(carrier, data.signals[signal]))
        AddCurves(problem, along, signal, trials.of_curve, found);
    }
    for (const SignalPair& pair : pairs) {
      AddSurfaces(problem, along, pair, trials.of_surface, found);
    }
  }
  std::ranges::stable_sort(found, [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<BlockIndex> indices;
  for (std::size_t k = 0; k < std::min(kBlocksKept, found.size()); ++k) {
    const BlockIndex index = candidate_set.Add(found[k].second);
    if (candidate_set.Observable(index)) indices.push_back(index);
  }
  return indices;
}

namespace {

/// Search for explanations with one empirical block, by growing and pruning.
class EmpiricalSearch {
 public:
  EmpiricalSearch(CandidateSet& candidate_set, const Explanation& catalogue)
      : candidate_set_(candidate_set), best_(catalogue) {
    for (const BlockIndex block : candidate_set.blocks().indices()) {
      if (!candidate_set.blocks()[block].empirical() && candidate_set.Observable(block))
        catalogue_.push_back(block);
    }
  }

  const Explanation& best() const { return best_; }

  /// Adds the empirical blocks that fit the residual of an explanation.
  void AddEmpiricalBlocks(const Explanation& from) {
    for (const BlockIndex block : AddEmpirical(candidate_set_, candidate_set_.Residual(from))) {
      const bool known = std::ranges::find(empirical_, block) != empirical_.end();
      if (!known) empirical_.push_back(block);
    }
  }

  /// Evaluates every empirical block alone and added to an explanation.
  void EvaluateWith(const Explanation& explanation) {
    for (const BlockIndex block : empirical_) {
      Evaluate({block});
      Evaluate(With(explanation.blocks, block));
    }
  }

  /// Adds the best empirical blocks to an explanation and removes its effects, first one at a time,
  /// then cumulatively, the least important first: effects that only imitated the unknown cause.
  void Prune(const Explanation& explanation) {
    for (const BlockIndex block : BestAddedTo(explanation)) {
      std::vector<std::pair<double, BlockIndex>> by_score;
      by_score.reserve(explanation.blocks.size());
      for (const BlockIndex removed : explanation.blocks) {
        by_score.emplace_back(Evaluate(With(Without(explanation.blocks, removed), block)), removed);
      }
      std::ranges::stable_sort(by_score);
      std::vector<BlockIndex> remaining = explanation.blocks;
      for (const auto& [score, removed] : by_score) {
        remaining = Without(remaining, removed);
        Evaluate(With(remaining, block));
      }
    }
  }

  /// Adds catalogue effects to the best explanation, one at a time, while the score improves.
  void Grow() {
    double before = 1e300;
    while (HasEmpirical(candidate_set_, best_) && best_.score < before - kMinGainToGrow) {
      const std::vector<BlockIndex> from = best_.blocks;
      before = best_.score;
      for (const BlockIndex block : catalogue_) EvaluateBelowBest(With(from, block));
    }
  }

 private:
  std::vector<BlockIndex> BestAddedTo(const Explanation& explanation) {
    constexpr std::size_t kTried = 4;
    std::vector<std::pair<double, BlockIndex>> by_score;
    for (const BlockIndex block : empirical_) {
      by_score.emplace_back(Evaluate(With(explanation.blocks, block)), block);
    }
    std::ranges::stable_sort(by_score);
    std::vector<BlockIndex> best;
    for (std::size_t k = 0; k < std::min(kTried, by_score.size()); ++k) {
      best.push_back(by_score[k].second);
    }
    return best;
  }

  static std::vector<BlockIndex> With(std::vector<BlockIndex> support, BlockIndex block) {
    support.push_back(block);
    return support;
  }

  static std::vector<BlockIndex> Without(std::vector<BlockIndex> support, BlockIndex removed) {
    support.erase(std::remove(support.begin(), support.end(), removed), support.end());
    return support;
  }

  /// Evaluates a support that may beat the best explanation; skips the others early.
  void EvaluateBelowBest(const std::vector<BlockIndex>& support) {
    if (Excluded(support)) return;
    std::optional<Explanation> explanation = candidate_set_.EvaluateBelow(support, best_.score);
    if (explanation) UpdateBest(std::move(*explanation));
  }

  /// True if shapes of one effect exclude each other, as in the search of the catalogue.
  bool Excluded(const std::vector<BlockIndex>& support) const {
    std::vector<const Block*> blocks;
    blocks.reserve(support.size());
    for (const BlockIndex block : support) blocks.push_back(&candidate_set_.blocks()[block]);
    return ShapesConflict(candidate_set_.problem(), blocks);
  }

  void UpdateBest(Explanation explanation) {
    if (explanation.score < best_.score && !Overshoots(candidate_set_, explanation)) {
      best_ = std::move(explanation);
    }
  }

  /// Evaluates a support, updates the best explanation, and returns the score. Cached.
  double Evaluate(std::vector<BlockIndex> support) {
    std::ranges::sort(support);
    support.erase(std::unique(support.begin(), support.end()), support.end());
    const auto known = scores_.find(support);
    if (known != scores_.end()) return known->second;
    Explanation explanation = candidate_set_.Evaluate(support);
    const double score = explanation.score;
    scores_.emplace(std::move(support), score);
    UpdateBest(std::move(explanation));
    return score;
  }

  CandidateSet& candidate_set_;
  Explanation best_;
  std::vector<BlockIndex> catalogue_, empirical_;
  std::map<std::vector<BlockIndex>, double> scores_;
};

}  // namespace

Explanation WithUnknown(CandidateSet& candidate_set, const std::vector<Explanation>& ranked) {
  constexpr std::size_t kFitted = 3, kPromising = 12;  // of the best explanations
  EmpiricalSearch search(candidate_set, ranked.front());
  search.AddEmpiricalBlocks(candidate_set.Fit({}));
  for (std::size_t k = 0; k < std::min(ranked.size(), kFitted); ++k)
    search.AddEmpiricalBlocks(ranked[k]);
  for (std::size_t k = 0; k < std::min(ranked.size(), kPromising); ++k) {
    search.EvaluateWith(ranked[k]);
    if (k < kFitted) search.Prune(ranked[k]);
  }
  search.Grow();
  return search.best();
}

}  // namespace plumbline::measure
