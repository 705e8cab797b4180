#include "app/measure/diagnosis/critics/open_world.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "app/measure/diagnosis/critics/misfit.h"
#include "app/measure/diagnosis/data/thresholds.h"
#include "app/measure/diagnosis/linear/empirical_columns.h"
#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/result/diagnosis_text.h"
#include "app/measure/diagnosis/search/explained_effects.h"
#include "app/measure/diagnosis/search/unknown.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxLevels = 8;    // more are a scale, which a curve follows
constexpr int kMinLevelPoses = 3;        // of a level, and of the other rows
constexpr std::size_t kMaxPerCause = 2;  // rivals named in place of one effect

using RowFactors = std::shared_ptr<const PerRow<double>>;

/// The rows of one session, tool, payload item or payload.
struct Level {
  std::string column, text;
  RowFactors rows;
};

/// The levels of a column, each with enough poses in it and outside it.
template <typename NameOf>
void AddLevels(const Dataset& data, const char* column, const NameOf& name_of,
               std::vector<Level>& levels) {
  std::map<std::string, std::set<ClusterIndex>> poses;
  for (const RowIndex row : data.row_indices()) poses[name_of(row)].insert(data.cluster_of[row]);
  if (poses.size() < 2 || poses.size() > kMaxLevels) return;
  for (const auto& [name, own] : poses) {
    const auto count = static_cast<int>(own.size());
    if (name.empty() || count < kMinLevelPoses || data.clusters - count < kMinLevelPoses) continue;
    auto rows = std::make_shared<PerRow<double>>();
    for (const RowIndex row : data.row_indices()) rows->push_back(name_of(row) == name ? 1 : 0);
    levels.push_back({column, fmt::format("{} {}", column, name), std::move(rows)});
  }
}

std::vector<Level> LevelsOf(const Dataset& data) {
  std::vector<Level> levels;
  const auto number = [](const std::optional<int>& n) { return n ? fmt::format("{}", *n) : ""; };
  const auto row_at = [&](RowIndex row) -> const MeasuredRow& { return data.measured(row); };
  AddLevels(
      data, "session", [&](RowIndex row) { return row_at(row).session; }, levels);
  AddLevels(
      data, "tool", [&](RowIndex row) { return number(row_at(row).tool_number); }, levels);
  AddLevels(
      data, "payload_item", [&](RowIndex row) { return number(row_at(row).payload_item); }, levels);
  AddLevels(
      data, "payload_kg",
      [&](RowIndex row) {
        const auto& mass_kg = row_at(row).payload_kg;
        return mass_kg ? fmt::format("{:.6g}", *mass_kg) : "";
      },
      levels);
  return levels;
}

/// Effects that may act in some of the rows only: those without a searched shape, and the answer's.
std::vector<Block> EffectsThatMayVary(const Identified& found) {
  std::vector<Block> blocks;
  for (const BlockIndex block : found.best.blocks) {
    const Block& own = found.candidate_set->blocks()[block];
    if (!own.empirical()) blocks.push_back(own);
  }
  for (const Block& block : found.candidates.blocks) {
    const bool known =
        std::ranges::any_of(blocks, [&](const Block& other) { return SameColumns(other, block); });
    if (!known) blocks.push_back(block);
  }
  return blocks;
}

std::vector<BlockIndex> Without(std::vector<BlockIndex> support, BlockIndex removed) {
  std::erase(support, removed);
  return support;
}

std::vector<BlockIndex> With(std::vector<BlockIndex> support, BlockIndex added) {
  support.push_back(added);
  return support;
}

bool Holds(const Explanation& explanation, BlockIndex block) {
  return std::ranges::find(explanation.blocks, block) != explanation.blocks.end();
}

/// The recorded signals that an effect follows by its law: those that it needs, and the angle of a
/// joint along which it is periodic.
std::vector<SignalIndex> DriversOf(const Dataset& data, const Block& block) {
  const effects::EffectTraits& traits = block.term.effect->traits();
  std::set<std::string> columns;
  if (traits.Needs(effects::Signal::kTime, block.term.word) || ActsFromEventTime(block.term))
    columns.insert({"t_s", "row"});
  if (traits.Needs(effects::Signal::kTemperature, block.term.word)) columns.insert("temp_C");
  if (traits.Needs(effects::Signal::kPayload, block.term.word)) columns.insert("payload_kg");
  if (const auto line = LineOf(block)) columns.insert(fmt::format("q{}_deg", line->joint + 1));
  std::vector<SignalIndex> drivers;
  for (const SignalIndex signal : data.signals.indices()) {
    if (columns.contains(data.signals[signal].column)) drivers.push_back(signal);
  }
  return drivers;
}

/// Rivals of the answer in a candidate set of its own, so that what is tried leaves no trace.
class OpenRivals {
 public:
  OpenRivals(const Identified& found, Opinion& opinion) : set_(*found.problem), opinion_(opinion) {
    std::vector<BlockIndex> support;
    for (const BlockIndex block : found.best.blocks)
      support.push_back(set_.Add(found.candidate_set->blocks()[block]));
    best_ = set_.Evaluate(support);
  }

  /// A curve in place of each name, and of all names that follow one signal: two events may be one
  /// creeping cause.
  void TryCurves() {
    std::map<SignalIndex, std::vector<BlockIndex>> following;
    for (const BlockIndex own : best_.blocks) {
      for (const SignalIndex driver : DriversOf(set_.problem().data(), set_.blocks()[own])) {
        following[driver].push_back(own);
        TryCurvesAlong(driver, {own});
      }
    }
    for (const auto& [driver, names] : following) {
      if (names.size() > 1) TryCurvesAlong(driver, names);
    }
  }

  /// @param levels  number of levels among which this one is tried
  void TryLevel(const Level& level, std::size_t levels, std::vector<Block> effects) {
    for (Block& effect : effects) {
      effect.factors = level.rows;
      effect.trials *= static_cast<double>(levels);
    }
    std::optional<Explanation> better;
    for (const BlockIndex block : set_.Add(effects)) {
      if (!set_.Observable(block)) continue;
      std::vector<std::vector<BlockIndex>> supports = {With(best_.blocks, block)};
      for (const BlockIndex own : best_.blocks)
        supports.push_back(With(Without(best_.blocks, own), block));
      for (const auto& support : supports) {
        const auto other = set_.EvaluateBelow(support, best_.score);
        if (!other || !Holds(*other, block)) continue;
        Keep(*other, block, level.text, "");
        if (!better || other->score < better->score) better = *other;
      }
    }
    if (better && better->score < best_.score - kUnknownMargin) AddDriver(level, *better);
  }

  /// Adds the best rivals of each name.
  void Finish() {
    std::ranges::stable_sort(
        kept_, [](const Rival& a, const Rival& b) { return a.evidence_gap < b.evidence_gap; });
    std::map<std::pair<std::string, std::string>, std::size_t> count;
    std::set<std::string> names;
    for (const Rival& rival : kept_) {
      if (count[{rival.instead_of, rival.instead_of_word}] >= kMaxPerCause) continue;
      if (!names.insert(rival.instead_of + rival.instead_of_word + RivalName(rival)).second)
        continue;
      ++count[{rival.instead_of, rival.instead_of_word}];
      opinion_.rivals.push_back(rival);
    }
  }

 private:
  void TryCurvesAlong(SignalIndex driver, const std::vector<BlockIndex>& names) {
    const LinearProblem& problem = set_.problem();
    std::vector<BlockIndex> others = best_.blocks;
    for (const BlockIndex name : names) std::erase(others, name);
    const Eigen::VectorXd residual = set_.Residual(set_.Fit(others));
    for (const std::vector<int>& carrier : Carriers(problem.data())) {
      if (!MayFollow(carrier, problem.data().signals[driver])) continue;
      const auto curve = BestEmpirical(problem, residual, {driver}, carrier);
      if (curve) TryCurve(others, set_.Add(*curve));
    }
  }

  void TryCurve(const std::vector<BlockIndex>& others, BlockIndex curve) {
    if (!set_.Observable(curve)) return;
    const auto other = set_.EvaluateBelow(With(others, curve), best_.score + kRivalGap);
    if (!other || !Holds(*other, curve) || other->blocks.size() > best_.blocks.size()) return;
    Keep(*other, curve, "", set_.blocks()[curve].term.drivers.front());
  }

  /// The answer is unknown, driven by the column that distinguishes the level.
  void AddDriver(const Level& level, const Explanation& better) {
    opinion_.drivers.push_back(level.column);
    std::vector<std::string> names;
    for (const BlockIndex block : better.blocks) {
      const Block& own = set_.blocks()[block];
      if (own.factors) names.push_back(EffectName(own.id, own.term.word, {}));
    }
    opinion_.notes.push_back(fmt::format(
        "{} with {} only fits better than the answer (by {:.0f} in the score; 10 is very strong): "
        "find out what differs there",
        Listed(names), level.text, best_.score - better.score));
  }

  /// Keeps the rival for each named effect that it lacks and moves otherwise.
  void Keep(const Explanation& other, BlockIndex instead, const std::string& only,
            const std::string& along) {
    constexpr double kSame = 1e-6;  // of the signal: the same columns at these rows
    // Of the signal of an event: a curve that is level before and after it, and changes where no
    // row was measured, such as between two sessions. A judgement; through evenly spaced rows, a
    // curve of the highest degree misses twice as much of a step.
    constexpr double kSameStep = 0.1;
    for (const BlockIndex own : best_.blocks) {
      if (Holds(other, own)) continue;
      const Block& named = set_.blocks()[own];
      const EffectKey lacking = KeyOf(named);
      const double left = SignalLeft(set_, best_, lacking, other.blocks);
      if (!only.empty() && left < kSame) continue;
      if (!along.empty() && ActsFromEventTime(named.term) && left < kSameStep) continue;
      Rival& rival = kept_.emplace_back();
      rival.instead_of = lacking.id;
      rival.instead_of_word = lacking.word;
      rival.id = set_.blocks()[instead].id;
      rival.only = only;
      rival.along = along;
      rival.signal_left = left;
      rival.evidence_gap = other.score - best_.score;
    }
  }

  CandidateSet set_;
  Explanation best_;
  Opinion& opinion_;
  std::vector<Rival> kept_;
};

// Rejected rows.

std::vector<RowIndex> RejectedRows(const FitProblem& fit) {
  std::vector<RowIndex> rows;
  for (const RowIndex row : fit.rows) {
    if (fit.data.numbers[row].count > 0 && fit.weights[row] < kOutlierWeight) rows.push_back(row);
  }
  return rows;
}

/// The column in which rejected rows differ most from the others, and the probability of that by
/// chance, over all columns.
struct Distinction {
  std::string column = "row";
  double p_value = 1;
};

/// By the rank sum test of every recorded signal, the row number and what gravity does included,
/// with its normal approximation [H. B. Mann & D. R. Whitney, Ann. Math. Stat. 18 (1947) 50].
/// @param events  the first row of each event
Distinction DistinctionOf(const Dataset& data, const std::vector<RowQuantity>& loads,
                          const std::vector<RowIndex>& rejected,
                          const std::vector<RowIndex>& events) {
  const std::set<RowIndex> own(rejected.begin(), rejected.end());
  const auto m = static_cast<double>(events.size());
  const auto others = static_cast<double>(data.rows()) - static_cast<double>(own.size());
  const double sd = std::sqrt((m + others + 1) / (12 * m * others));  // of the share of pairs
  Distinction most;
  double largest = -1;
  int columns = 0;
  const auto compare = [&](const std::string& name, const auto& value_of) {
    ++columns;
    double above = 0;  // pairs in which the own row has the larger value
    for (const RowIndex row : events) {
      for (const RowIndex other : data.row_indices()) {
        if (own.contains(other)) continue;
        const double a = value_of(row), b = value_of(other);
        above += a > b ? 1 : a == b ? 0.5 : 0;
      }
    }
    const double deviation = std::abs(above / (m * others) - 0.5);
    if (deviation <= largest) return;
    largest = deviation;
    most.column = name;
  };
  compare("row", [](RowIndex row) { return static_cast<double>(row.value()); });
  for (const RecordedSignal& signal : data.signals)
    compare(signal.column, [&](RowIndex row) { return signal.values[row]; });
  for (const RowQuantity& load : loads)
    compare(load.column, [&](RowIndex row) { return load.values[row]; });
  most.p_value = std::min(1.0, columns * std::erfc(largest / sd / std::sqrt(2.0)));
  return most;
}

}  // namespace

namespace {

/// Keeps the best rivals of each name.
void KeepBestRivals(std::vector<Rival>& rivals) {
  std::ranges::stable_sort(
      rivals, [](const Rival& a, const Rival& b) { return a.evidence_gap < b.evidence_gap; });
  std::map<std::pair<std::string, std::string>, std::size_t> count;
  std::erase_if(rivals, [&](const Rival& rival) {
    return count[{rival.instead_of, rival.instead_of_word}]++ >= kMaxPerCause;
  });
}

}  // namespace

Opinion OpinionOnOpenWorld(const Identified& found) {
  Opinion opinion;
  if (found.unknown) return opinion;
  const std::vector<Level> levels = LevelsOf(found.fit.data);
  const std::vector<Block> effects =
      levels.empty() ? std::vector<Block>() : EffectsThatMayVary(found);
  OpenRivals curves(found, opinion);
  curves.TryCurves();
  curves.Finish();
  for (const Level& level : levels) {  // each in a set of its own, which bounds the memory
    OpenRivals rivals(found, opinion);
    rivals.TryLevel(level, levels.size(), effects);
    rivals.Finish();
  }
  KeepBestRivals(opinion.rivals);
  if (!opinion.rivals.empty()) opinion.permits = Verdict::kAmbiguous;
  if (!opinion.drivers.empty()) opinion.permits = Verdict::kUnknown;
  return opinion;
}

namespace {

/// Number of the event of each rejected row. A run of rejected rows, at most two accepted ones
/// between them, may be one event, and so may all visits of a pose.
std::vector<int> EventsOf(const Dataset& data, const std::vector<RowIndex>& rejected) {
  constexpr int kMaxGap = 2;
  std::vector<int> events;
  std::map<ClusterIndex, int> of_pose;
  int last_row = -kMaxGap - 2, count = 0;
  for (const RowIndex row : rejected) {
    const auto known = of_pose.find(data.cluster_of[row]);
    const bool continues = !events.empty() && row.value() - last_row <= kMaxGap + 1;
    const int event = known != of_pose.end() ? known->second : continues ? events.back() : count++;
    of_pose.emplace(data.cluster_of[row], event);
    events.push_back(event);
    last_row = row.value();
  }
  return events;
}

/// Fits of the rejected rows at full weight, with and without one more effect in them alone.
class RegimeSearch {
 public:
  RegimeSearch(const Identified& found, const std::vector<RowIndex>& rejected)
      : events_(EventsOf(found.fit.data, rejected)),
        there_(std::make_shared<PerRow<double>>(found.fit.data.rows(), 0.0)),
        problem_(WithRejected(found, rejected), found.linear, found.model),
        set_(problem_) {
    for (const BlockIndex block : found.best.blocks)
      support_.push_back(set_.Add(found.candidate_set->blocks()[block]));
    std::vector<Block> blocks = EffectsThatMayVary(found);
    for (Block& block : blocks) block.factors = there_;
    added_ = set_.Add(blocks);
    const std::vector<double> before = SquaresThere(set_.Fit(support_));
    for (const double square : before) total_ += square;
    double fourth = 0;
    for (const double square : before) fourth += square * square;
    numbers_ = found.fit.data.lengths_per_row() * total_ * total_ / fourth;
  }

  /// The effect that explains most, with its p-value over all effects; 1 if none is observable.
  RejectedRegime Best() const {
    RejectedRegime best;
    best.rows = static_cast<int>(events_.size());
    for (const BlockIndex block : added_) {
      if (!set_.Observable(block)) continue;
      const Explanation with = set_.Evaluate(With(support_, block));
      const auto columns = static_cast<double>(std::ranges::count_if(
          with.columns, [&](ColumnIndex column) { return set_.BlockOfColumn(column) == block; }));
      const double freedom = numbers_ - columns;
      if (columns == 0 || freedom < 1) continue;
      double left = 0;
      for (const double square : SquaresThere(with)) left += square;
      const double share = 1 - left / total_;
      const double f = share / columns / std::max((1 - share) / freedom, 1e-9);
      const double p = static_cast<double>(added_.size()) * FisherTail(f, columns, freedom) *
                       std::exp(LogChoices(set_, with, block));
      if (share <= 0 || p >= best.p_value) continue;
      const Block& own = set_.blocks()[block];
      best.p_value = p;
      best.share = share;
      best.effect = EffectName(own.id, own.term.word, {});
    }
    return best;
  }

 private:
  FitProblem WithRejected(const Identified& found, const std::vector<RowIndex>& rejected) {
    FitProblem fit = found.fit;
    for (const RowIndex row : rejected) fit.weights[row] = (*there_)[row] = 1;
    return fit;
  }

  /// Squares of the rejected rows' residuals, summed over what may be one event.
  std::vector<double> SquaresThere(const Explanation& explanation) const {
    const Eigen::VectorXd residual = set_.Residual(explanation);
    std::vector<double> squares(static_cast<std::size_t>(*std::ranges::max_element(events_)) + 1);
    std::size_t k = 0;
    for (const FitRowIndex j : problem_.rows().indices()) {
      if ((*there_)[problem_.rows()[j]] > 0)
        squares[static_cast<std::size_t>(events_[k++])] +=
            problem_.layout().PartOf(residual, j).squaredNorm();
    }
    return squares;
  }

  const std::vector<int> events_;  ///< of each rejected row
  const std::shared_ptr<PerRow<double>> there_;
  const LinearProblem problem_;
  CandidateSet set_;
  std::vector<BlockIndex> support_, added_;
  double total_ = 0;
  double numbers_ = 0;  ///< of independent lengths: the participation ratio of the events
};

}  // namespace

std::optional<RejectedRegime> RegimeOfRejectedRows(const Identified& found) {
  constexpr std::size_t kMinEvents = 4;
  const Dataset& data = found.fit.data;
  const std::vector<RowIndex> rejected = RejectedRows(found.fit);
  const std::vector<int> numbers = EventsOf(data, rejected);
  std::vector<RowIndex> events;
  for (std::size_t k = 0; k < rejected.size(); ++k) {
    if (numbers[k] == static_cast<int>(events.size())) events.push_back(rejected[k]);
  }
  if (events.size() < kMinEvents) return std::nullopt;
  RejectedRegime regime = RegimeSearch(found, rejected).Best();
  const Distinction distinction =
      DistinctionOf(data, GravityLoadsAt(data, *found.linear), rejected, events);
  const bool by_effect = regime.p_value <= kRegimeSignificance;
  if (!by_effect || distinction.p_value <= kRegimeSignificance) regime.driver = distinction.column;
  const double product = regime.p_value * distinction.p_value;
  if (product * (1 - std::log(std::max(product, 1e-300))) > kRegimeSignificance)
    return std::nullopt;
  return regime;
}

Opinion OpinionOnRejectedRows(const Identified& found) {
  const auto regime = RegimeOfRejectedRows(found);
  if (!regime) return {};
  Opinion opinion;
  std::vector<std::string> signs;
  if (regime->p_value <= kRegimeSignificance)
    signs.push_back(fmt::format("{} in these rows only explains {} of their squares",
                                regime->effect, PercentText(regime->share)));
  if (!regime->driver.empty()) {
    signs.push_back(
        fmt::format("they differ from the others most in {}", DriverOf(regime->driver)));
    opinion.drivers = {DriverOf(regime->driver)};
  }
  opinion.notes.push_back(
      fmt::format("the {} rejected rows are hardly gross errors: {}. What acts there is not "
                  "corrected: measure more such poses",
                  regime->rows, fmt::join(signs, "; ")));
  opinion.permits = Verdict::kUnknown;
  return opinion;
}

}  // namespace plumbline::measure
