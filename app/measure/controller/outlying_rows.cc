#include "app/measure/controller/outlying_rows.h"

#include <algorithm>
#include <numeric>
#include <random>

#include "app/measure/controller/identify.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::measure {
namespace {

using Rows = std::vector<std::size_t>;

constexpr double kTail = 1e-8;  // probability of leaving out a posture that fits
constexpr int kSets = 16;
constexpr int kRefinements = 4;

ControllerSample Selected(const ControllerSample& sample, const Rows& rows) {
  ControllerSample some = sample;
  some.postures.clear();
  for (const std::size_t row : rows) some.postures.push_back(sample.postures[row]);
  return some;
}

/// Sets of postures, the same in every run.
std::vector<Rows> RandomSets(std::size_t postures) {
  std::mt19937 random(1);
  Rows all(postures);
  std::iota(all.begin(), all.end(), std::size_t{0});
  std::vector<Rows> sets;
  for (int k = 0; k < kSets; ++k) {
    for (std::size_t i = 0; i < kFewestPostures; ++i)
      std::swap(all[i], all[i + random() % (postures - i)]);
    sets.emplace_back(all.begin(), all.begin() + kFewestPostures);
  }
  return sets;
}

class ConsensusSearch {
 public:
  ConsensusSearch(const RelationFitter& all) : all_(all), count_(all.sample().postures.size()) {
    most_ = std::min(count_ / 4, count_ - std::min(count_, kFewestPostures));
    limit_ = statistics::ChiSquareQuantile(kTail, all.sample().with_orientation ? 6 : 3);
  }

  std::size_t most() const { return most_; }

  /// Rows that a fit to some of them does not predict.
  std::vector<OutlyingRow> NotPredicted(const HypothesisFit& fit) const {
    const auto errors = all_.Residuals(fit);
    std::vector<OutlyingRow> rows;
    for (std::size_t k = 0; k < count_; ++k) {
      const double chi_square = all_.Surprise(fit, all_.sample().postures[k]);
      const auto error = errors.col(static_cast<int>(k));
      if (!(chi_square <= limit_))
        rows.push_back({k,
                        all_.sample().postures[k].line,
                        {error.head<3>().norm(), error.tail<3>().norm()},
                        chi_square});
    }
    return rows;
  }

  /// The rows left out when a fit to a set has taken in all that it predicts; more than most() if
  /// the set has no relation in common with the others.
  std::vector<OutlyingRow> LeftOut(const RelationFitter& set, const Relation& relation) const {
    const HypothesisFit screened = set.Fit({relation}, true);
    std::vector<OutlyingRow> none(count_);
    if (screened.chi_square > statistics::ChiSquareQuantile(kTail, screened.degrees)) return none;
    HypothesisFit fit = set.Fit({relation});
    if (fit.chi_square > statistics::ChiSquareQuantile(kTail, fit.degrees)) return none;
    std::vector<OutlyingRow> out = NotPredicted(fit);
    for (int pass = 0; pass < kRefinements && out.size() <= most_; ++pass) {
      fit = RelationFitter(all_.context(), Without(all_.sample(), out)).FitAndPredict({relation});
      const std::size_t before = out.size();
      out = NotPredicted(fit);
      if (out.size() == before) return fit.Accepted() ? out : none;
    }
    return none;
  }

 private:
  const RelationFitter& all_;
  std::size_t count_, most_ = 0;
  double limit_ = 0;
};

}  // namespace

ControllerSample Without(const ControllerSample& sample, const std::vector<OutlyingRow>& rows) {
  Rows kept;
  for (std::size_t k = 0; k < sample.postures.size(); ++k) {
    const auto is_k = [k](const OutlyingRow& one) { return one.row == k; };
    if (std::none_of(rows.begin(), rows.end(), is_k)) kept.push_back(k);
  }
  return Selected(sample, kept);
}

std::vector<OutlyingRow> FindOutlyingRows(const RelationFitter& fitter,
                                          const std::vector<Relation>& relations,
                                          const std::function<bool(double share)>& go_on) {
  const ConsensusSearch search(fitter);
  std::vector<OutlyingRow> fewest;
  if (search.most() == 0) return fewest;
  bool found = false;
  std::vector<RelationFitter> sets;
  for (const Rows& rows : RandomSets(fitter.sample().postures.size()))
    sets.emplace_back(fitter.context(), Selected(fitter.sample(), rows));
  for (std::size_t k = 0; k < relations.size(); ++k) {
    if (!go_on(static_cast<double>(k) / static_cast<double>(relations.size()))) return {};
    for (const RelationFitter& set : sets) {
      std::vector<OutlyingRow> out = search.LeftOut(set, relations[k]);
      if (out.size() > search.most()) continue;
      if (!found || out.size() < fewest.size()) fewest = std::move(out);
      found = true;
      break;
    }
  }
  return fewest;
}

}  // namespace plumbline::measure
