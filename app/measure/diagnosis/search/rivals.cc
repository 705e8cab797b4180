#include "app/measure/diagnosis/search/rivals.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/shape_search.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "app/measure/diagnosis/search/unknown.h"
#include "app/measure/diagnosis/shapes/periodic_search.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxRivalRefits = 8;
/// A strongly nonlinear rival converges slowly from its linear fit; stopping early would rule it
/// out wrongly.
constexpr int kRivalIterations = 40;

/// The effects of the answer that a rival replaces, and those it uses instead.
struct Exchange {
  std::vector<EffectKey> lacking, instead;

  // NOLINTNEXTLINE(modernize-use-nullptr)
  friend auto operator<=>(const Exchange&, const Exchange&) = default;
};

/// An exchange, and the joint and rounded cycles per turn of every line put in place. Explanations
/// of one trial are alike, so one of them is refitted.
struct Exchanged {
  Exchange exchange;
  std::vector<std::pair<int, int>> lines;

  // NOLINTNEXTLINE(modernize-use-nullptr)
  friend auto operator<=>(const Exchanged&, const Exchanged&) = default;
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

Exchanged TrialOf(const CandidateSet& candidate_set, const Explanation& other,
                  const Exchange& exchange) {
  Exchanged trial{exchange, {}};
  for (const BlockIndex block : other.blocks) {
    const Block& own = candidate_set.blocks()[block];
    const std::optional<PeriodicLine> line = LineOf(own);
    const auto& instead = exchange.instead;
    if (!line || std::ranges::find(instead, KeyOf(own)) == instead.end()) continue;
    trial.lines.emplace_back(line->joint, static_cast<int>(std::lround(line->cycles_per_turn)));
  }
  return trial;
}

/// An effect, its line in the answer, and the line of the same joint that an explanation has in its
/// place.
struct LineExchange {
  EffectKey key;
  PeriodicLine own, instead;
};

bool Contains(const LinearProblem& problem, const std::vector<PeriodicLine>& lines,
              const PeriodicLine& line) {
  return std::ranges::any_of(
      lines, [&](const PeriodicLine& other) { return Unresolved(problem, line, other); });
}

/// The lines that these rows cannot distinguish from this one (line_aliases.h).
std::vector<PeriodicLine> PossibleAliases(const LinearProblem& problem, const PeriodicLine& line) {
  std::vector<PeriodicLine> aliases;
  for (const double cycles : AliasedCycles(problem, line)) {
    aliases.push_back({line.joint, cycles, 0, line.amplitude_rad});
  }
  return aliases;
}

/// nullopt unless one line is all that the explanations differ in.
std::optional<LineExchange> LineExchangeOf(const CandidateSet& candidate_set,
                                           const Explanation& answer, const Explanation& other) {
  std::vector<BlockIndex> own, instead;
  std::set_difference(answer.blocks.begin(), answer.blocks.end(), other.blocks.begin(),
                      other.blocks.end(), std::back_inserter(own));
  std::set_difference(other.blocks.begin(), other.blocks.end(), answer.blocks.begin(),
                      answer.blocks.end(), std::back_inserter(instead));
  if (own.size() != 1 || instead.size() != 1) return std::nullopt;
  const std::optional<PeriodicLine> line = LineOf(candidate_set.blocks()[own.front()]);
  const std::optional<PeriodicLine> other_line = LineOf(candidate_set.blocks()[instead.front()]);
  if (!line || !other_line || line->joint != other_line->joint ||
      Unresolved(candidate_set.problem(), *line, *other_line))
    return std::nullopt;
  return LineExchange{KeyOf(candidate_set.blocks()[own.front()]), *line, *other_line};
}

class RivalSearch {
 public:
  RivalSearch(const FindingsContext& context, const Model& model, Diagnosis& diagnosis)
      : context_(context),
        model_(model),
        diagnosis_(diagnosis),
        answer_(EffectKeys(context.candidate_set, context.best)),
        own_(Linearise(context.problem.data, model, false, context.options.threads)) {}

  /// Refits an explanation, unless one of the same trial was refitted before.
  void Consider(const Explanation& other) {
    const std::optional<Exchange> exchange =
        ExchangeOf(answer_, EffectKeys(context_.candidate_set, other));
    if (!exchange) return ConsiderLine(other);
    const Exchanged trial = TrialOf(context_.candidate_set, other, *exchange);
    if (refitted_.contains(trial)) return;
    if (refitted_.size() >= kMaxRivalRefits) {
      skipped_.insert(trial);
      return;
    }
    const Result<Refit> refit = Refitted(other);
    if (!refit) return;
    refitted_.insert(trial);
    if (!ShapesAreVisible(context_.candidate_set.problem(), refit->model.effects)) return;
    const double gap = GapOf(other, *refit);
    if (gap > kRivalGap) {
      const bool by_size = gap - (other.prior - context_.best.prior) <= kRivalGap;
      if (by_size) {
        for (const EffectKey& key : exchange->instead) too_large_.insert(key.id);
      }
      return;
    }
    Add(*exchange, other, refit->model, gap);
    Keep(other, gap);
  }

  std::vector<Explanation> Found() && {
    if (!skipped_.empty()) {
      diagnosis_.notes.push_back(fmt::format(
          "{} possible rivals were refitted; {} more scored close enough but were skipped",
          kMaxRivalRefits, skipped_.size()));
    }
    for (const Aliases& aliases : aliased_) {
      if (aliases.found.size() > 1) diagnosis_.notes.push_back(AliasesText(aliases.found));
    }
    for (const Rival& rival : diagnosis_.rivals) too_large_.erase(rival.id);
    if (!too_large_.empty()) {
      std::vector<std::string> names;
      for (const std::string& id : too_large_) names.push_back(EffectName(id));
      diagnosis_.notes.push_back(
          fmt::format("{} would fit as well, but only at a size implausible for a healthy machine; "
                      "nothing else rules it out",
                      Listed(names, "or")));
    }
    return std::move(found_);
  }

 private:
  Result<Refit> Refitted(const Explanation& other) const {
    Model start = model_;
    start.effects = EffectsFrom(context_.problem.data, context_.candidate_set.blocks(),
                                context_.candidate_set.CoefficientsOf(other));
    return RefitModel(context_.problem, start, {kRivalIterations});
  }

  double GapOf(const Explanation& other, const Refit& refit) const {
    return refit.chi2 + other.prior_and_cost() -
           (context_.searched_chi2 + context_.best.prior_and_cost());
  }

  void Keep(const Explanation& other, double gap) {
    found_.push_back(other);
    found_.back().score = context_.best.score + gap;
  }

  /// Adds an explanation that differs only in having an alias in place of one line.
  void ConsiderLine(const Explanation& other) {
    const std::optional<LineExchange> exchange =
        LineExchangeOf(context_.candidate_set, context_.best, other);
    if (!exchange) return;
    const LinearProblem& problem = context_.candidate_set.problem();
    const PeriodicLine &own = exchange->own, &instead = exchange->instead;
    Aliases& aliases = AliasesFoundOf(own);
    if (!Contains(problem, aliases.possible, instead)) return;
    if (Contains(problem, aliases.tried, instead) || aliases.tried.size() > kMaxRivalRefits) return;
    aliases.tried.push_back(instead);
    const Result<Refit> refit = Refitted(other);
    if (!refit) return;
    const double gap = GapOf(other, *refit);
    if (gap > kRivalGap) return;
    aliases.found.push_back(instead);
    Rival& rival = diagnosis_.rivals.emplace_back();
    rival.instead_of = rival.id = exchange->key.id;
    rival.instead_of_word = exchange->key.word;
    rival.instead_of_cycles = own.cycles_per_turn;
    rival.cycles = instead.cycles_per_turn;
    rival.scope = {JointName(own)};
    rival.signal_left =
        SignalLeft(context_.candidate_set, context_.best, exchange->key, other.blocks);
    rival.evidence_gap = gap;
    rival.shift_W = ShiftsOf(refit->model);
    Keep(other, gap);
  }

  /// A line of the answer, and those that the rows may not distinguish from it.
  struct Aliases {
    std::vector<PeriodicLine> possible;
    std::vector<PeriodicLine> tried, found;  ///< each begins with the line itself
  };

  Aliases& AliasesFoundOf(const PeriodicLine& own) {
    for (Aliases& aliases : aliased_) {
      const PeriodicLine& line = aliases.tried.front();
      if (line.joint == own.joint && line.cycles_per_turn == own.cycles_per_turn) return aliases;
    }
    return aliased_.emplace_back(
        Aliases{PossibleAliases(context_.candidate_set.problem(), own), {own}, {own}});
  }

  static std::string AliasesText(std::vector<PeriodicLine> lines) {
    std::ranges::sort(lines, [](const PeriodicLine& a, const PeriodicLine& b) {
      return a.cycles_per_turn < b.cycles_per_turn;
    });
    std::vector<std::string> cycles;
    cycles.reserve(lines.size());
    for (const PeriodicLine& line : lines) {
      cycles.push_back(fmt::format("{:.3g}", line.cycles_per_turn));
    }
    return fmt::format(
        "the readings of {} are equally spaced, so that errors of, for example, {} cycles per turn "
        "are alike at every row but not between the rows: measure poses at which this joint is off "
        "the grid",
        JointName(lines.front()), Listed(cycles, "or"));
  }

  static std::string JointName(const PeriodicLine& line) {
    return fmt::format("q{}", line.joint + 1);
  }

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
        rival.signal_left =
            SignalLeft(context_.candidate_set, context_.best, lacking, other.blocks);
        rival.evidence_gap = gap;
        rival.shift_W = shifts_W;
      }
    }
  }

  /// For each row, the prediction of another model minus that of the answer [m]; empty if the
  /// deflected posture of either does not converge.
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
  std::set<Exchanged> refitted_, skipped_;
  std::vector<Aliases> aliased_;     ///< one per line of the answer
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

namespace {

std::vector<int> CarriersOf(const Block& block) {
  std::vector<int> carriers;
  for (const BlockColumn& column : block.columns) {
    if (std::ranges::find(carriers, column.entry) == carriers.end())
      carriers.push_back(column.entry);
  }
  return carriers;
}

/// Every choice of drivers that differs from those of the block in one signal.
std::vector<std::vector<SignalIndex>> OtherDrivers(const Dataset& data, const Block& block) {
  const BlockColumn& any = block.columns.front();
  std::vector<SignalIndex> own = {*any.signal};
  if (any.second_signal) own.push_back(*any.second_signal);
  std::vector<std::vector<SignalIndex>> others;
  for (std::size_t place = 0; place < own.size(); ++place) {
    for (const SignalIndex signal : data.signals.indices()) {
      if (std::ranges::find(own, signal) != own.end()) continue;
      if (own.size() > 1 && data.signals[signal].of_joint) continue;
      others.push_back(own);
      others.back()[place] = signal;
    }
  }
  return others;
}

/// The explanation with an empirical block replaced by the best one of other drivers; nullopt if
/// none scores within kRivalGap of `best`.
std::optional<Explanation> WithOtherDrivers(CandidateSet& candidate_set, const Explanation& best,
                                            BlockIndex block,
                                            const std::vector<SignalIndex>& drivers) {
  const Block replaced = candidate_set.blocks()[block];
  const std::optional<Block> other =
      BestEmpirical(candidate_set.problem(), candidate_set.PartialResidual(best, block), drivers,
                    CarriersOf(replaced));
  if (!other) return std::nullopt;
  const BlockIndex index = candidate_set.Add(*other);
  if (!candidate_set.Observable(index)) return std::nullopt;
  std::vector<BlockIndex> support = best.blocks;
  std::replace(support.begin(), support.end(), block, index);
  return candidate_set.EvaluateBelow(support, best.score + kRivalGap);
}

}  // namespace

void AddDriverRivals(CandidateSet& candidate_set, const Explanation& best, Diagnosis& diagnosis) {
  const Dataset& data = candidate_set.problem().data();
  for (const BlockIndex block : best.blocks) {
    const Block replaced = candidate_set.blocks()[block];
    if (!replaced.empirical()) continue;
    for (const std::vector<SignalIndex>& drivers : OtherDrivers(data, replaced)) {
      const std::optional<Explanation> other =
          WithOtherDrivers(candidate_set, best, block, drivers);
      const bool as_many = other && other->blocks.size() == best.blocks.size();
      if (!as_many || other->score > best.score + kRivalGap) continue;
      std::vector<std::string> columns;
      for (const SignalIndex driver : drivers) columns.push_back(data.signals[driver].column);
      Rival& rival = diagnosis.rivals.emplace_back();
      rival.instead_of = rival.id = replaced.id;
      rival.instead_of_word = fmt::format("{}", fmt::join(replaced.term.drivers, " and "));
      rival.word = fmt::format("{}", fmt::join(columns, " and "));
      rival.signal_left = SignalLeft(candidate_set, best, KeyOf(replaced), other->blocks);
      rival.evidence_gap = other->score - best.score;
      diagnosis.rival_drivers.push_back(columns);
    }
  }
}

}  // namespace plumbline::measure
