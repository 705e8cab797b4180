#include "app/diagnosis/rivals.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>

#include "app/diagnosis/diagnosis_text.h"
#include "app/diagnosis/thresholds.h"

namespace plumbline::diagnosis {
namespace {

constexpr std::size_t kMaxRefits = 8;
/// A strongly nonlinear rival converges slowly from its linear fit; stopping early would rule it
/// out wrongly.
constexpr int kRivalIterations = 40;

/// The effects of the answer that a rival replaces, and those it uses instead.
struct Exchange {
  std::vector<EffectKey> lacking, instead;

  // NOLINTNEXTLINE(modernize-use-nullptr)
  friend auto operator<=>(const Exchange&, const Exchange&) = default;
};

/// nullopt if the other explanation has more effects, or differs in none.
std::optional<Exchange> ExchangeOf(const std::vector<EffectKey>& answer,
                                   const std::vector<EffectKey>& other) {
  if (other.empty() || other.size() > answer.size()) return {};
  Exchange exchange;
  std::set_difference(answer.begin(), answer.end(), other.begin(), other.end(),
                      std::back_inserter(exchange.lacking));
  std::set_difference(other.begin(), other.end(), answer.begin(), answer.end(),
                      std::back_inserter(exchange.instead));
  if (exchange.lacking.empty() || exchange.instead.empty()) return {};
  return exchange;
}

double CostOf(const Explanation& explanation) {
  return explanation.score - explanation.chi2;
}

/// The scope of the last effect of a key.
std::vector<std::string> ScopeWithin(const Model& model, const EffectKey& key) {
  std::vector<std::string> scope;
  for (const effects::ActiveEffect& effect : model.effects) {
    if (effect.term.effect->traits().id == key.id && effect.term.word == key.word) {
      scope = ScopeOf(effect.term);
    }
  }
  return scope;
}

class RivalSearch {
 public:
  RivalSearch(const FindingsContext& context, const Model& model, Diagnosis& diagnosis)
      : context_(context),
        model_(model),
        diagnosis_(diagnosis),
        answer_(EffectKeys(context.candidate_set, context.best)),
        own_(Linearise(context.problem.data, model, false, context.options.threads)) {}

  /// Refits an explanation, unless one with the same exchange was refitted before.
  void Consider(const Explanation& other) {
    const std::optional<Exchange> exchange =
        ExchangeOf(answer_, EffectKeys(context_.candidate_set, other));
    if (!exchange || refitted_.contains(*exchange)) return;
    if (refitted_.size() >= kMaxRefits) {
      skipped_.insert(*exchange);
      return;
    }
    Model start = model_;
    start.effects = EffectsFrom(context_.problem.data, context_.candidate_set.blocks(),
                                context_.candidate_set.CoefficientsOf(other));
    const Result<Refit> refit = RefitModel(context_.problem, start, {kRivalIterations});
    if (!refit) return;
    refitted_.insert(*exchange);
    const double gap =
        refit->chi2 + CostOf(other) - (context_.searched_chi2 + CostOf(context_.best));
    if (gap > kRivalGap) {
      const bool by_size = gap - (other.prior - context_.best.prior) <= kRivalGap;
      if (by_size) {
        for (const EffectKey& key : exchange->instead) too_large_.insert(key.id);
      }
      return;
    }
    Add(*exchange, other, refit->model, gap);
    found_.push_back(other);
    found_.back().score = context_.best.score + gap;
  }

  std::vector<Explanation> Found() && {
    if (!skipped_.empty()) {
      diagnosis_.notes.push_back(fmt::format(
          "{} possible rivals were refitted; {} more scored close enough but were skipped",
          kMaxRefits, skipped_.size()));
    }
    for (const Rival& rival : diagnosis_.rivals) too_large_.erase(rival.id);
    if (!too_large_.empty()) {
      std::vector<std::string> names;
      for (const std::string& id : too_large_) names.push_back(EffectName(id));
      diagnosis_.notes.push_back(
          fmt::format("{} would fit as well, but only at a size implausible for a sound machine; "
                      "nothing else rules it out",
                      Listed(names, "or")));
    }
    return std::move(found_);
  }

 private:
  void Add(const Exchange& exchange, const Explanation& other, const Model& theirs, double gap) {
    const std::vector<Vec3> shifts_W = ShiftsOf(theirs);
    for (const EffectKey& lacking : exchange.lacking) {
      for (const EffectKey& key : exchange.instead) {
        if (!named_.emplace(lacking, key).second) continue;
        Rival& rival = diagnosis_.rivals.emplace_back();
        rival.instead_of = lacking.id;
        rival.instead_of_word = lacking.word;
        rival.id = key.id;
        rival.word = key.word;
        rival.scope = ScopeWithin(theirs, key);
        rival.signal_left = context_.candidate_set.SignalLeft(context_.best, lacking, other.blocks);
        rival.evidence_gap = gap;
        rival.shift_W = shifts_W;
      }
    }
  }

  /// For each row, the prediction of another model minus that of the answer [m]; empty if the
  /// sagged posture of either does not converge.
  std::vector<Vec3> ShiftsOf(const Model& theirs) const {
    const Dataset& data = context_.problem.data;
    const Result<Linearisation> there = Linearise(data, theirs, false, context_.options.threads);
    if (!own_ || !there) return {};
    std::vector<Vec3> shifts_W;
    for (const RowIndex row : data.row_indices()) {
      shifts_W.emplace_back(there->rows[row].p_W - own_->rows[row].p_W);
    }
    return shifts_W;
  }

  const FindingsContext& context_;
  const Model& model_;
  Diagnosis& diagnosis_;
  const std::vector<EffectKey> answer_;
  const Result<Linearisation> own_;
  std::set<Exchange> refitted_, skipped_;
  std::set<std::string> too_large_;  ///< effects ruled out by their size alone
  std::set<std::pair<EffectKey, EffectKey>> named_;
  std::vector<Explanation> found_;
};

}  // namespace

std::vector<Explanation> AddRivals(const FindingsContext& context, const Model& model,
                                   Diagnosis& diagnosis) {
  RivalSearch search(context, model, diagnosis);
  for (const Explanation& other : context.ranked) {
    if (other.score > context.best.score + kRefitScoreRange) break;
    search.Consider(other);
  }
  return std::move(search).Found();
}

}  // namespace plumbline::diagnosis
