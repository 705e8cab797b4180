#include "app/measure/diagnosis/open_world.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>
#include <vector>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/empirical_columns.h"
#include "app/measure/diagnosis/explained_effects.h"
#include "app/measure/diagnosis/misfit.h"
#include "app/measure/diagnosis/robust.h"
#include "app/measure/diagnosis/thresholds.h"
#include "app/measure/diagnosis/unknown.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxLevels = 8;    // more are a scale, which a curve follows
constexpr int kMinPoses = 3;             // of a level, and of the other rows
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
    if (name.empty() || count < kMinPoses || data.clusters - count < kMinPoses) continue;
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

class OpenRivals {
 public:
  OpenRivals(Identified& found, Diagnosis& diagnosis)
      : set_(*found.candidate_set), best_(found.best), diagnosis_(diagnosis) {}

  void TryCurves() {
    const LinearProblem& problem = set_.problem();
    const Dataset& data = problem.data();
    for (const BlockIndex own : best_.blocks) {
      const std::vector<SignalIndex> drivers = DriversOf(data, set_.blocks()[own]);
      if (drivers.empty()) continue;
      const Eigen::VectorXd residual = set_.PartialResidual(best_, own);
      for (const SignalIndex driver : drivers) {
        for (const std::vector<int>& carrier : Carriers(data)) {
          if (!MayFollow(carrier, data.signals[driver])) continue;
          const auto curve = BestEmpirical(problem, residual, {driver}, carrier);
          if (curve) TryCurve(own, set_.Add(*curve));
        }
      }
    }
  }

  void TryLevels(const std::vector<Level>& levels, const std::vector<Block>& effects) {
    std::vector<Block> blocks;
    std::vector<const Level*> level_of;
    for (const Level& level : levels) {
      for (const Block& effect : effects) {
        blocks.push_back(effect);
        blocks.back().factors = level.rows;
        blocks.back().trials *= static_cast<double>(levels.size());
        level_of.push_back(&level);
      }
    }
    const std::vector<BlockIndex> added = set_.Add(blocks);
    for (std::size_t k = 0; k < added.size(); ++k) {
      if (set_.Observable(added[k])) TryLevel(*level_of[k], added[k]);
    }
  }

 private:
  void TryCurve(BlockIndex own, BlockIndex curve) {
    if (!set_.Observable(curve)) return;
    const auto other =
        set_.EvaluateBelow(With(Without(best_.blocks, own), curve), best_.score + kRivalGap);
    if (!other || !Holds(*other, curve) || other->blocks.size() > best_.blocks.size()) return;
    const Block& block = set_.blocks()[curve];
    Keep(*other, block.term.drivers.front(), block.id, curve);
  }

  void TryLevel(const Level& level, BlockIndex block) {
    std::vector<std::vector<BlockIndex>> supports = {With(best_.blocks, block)};
    for (const BlockIndex own : best_.blocks) {
      supports.push_back(With(Without(best_.blocks, own), block));
    }
    for (const auto& support : supports) {
      const auto other = set_.EvaluateBelow(support, best_.score);
      if (!other || !Holds(*other, block)) continue;
      if (other->score < best_.score - kUnknownMargin) AddDriver(level.column);
      Keep(*other, "only with " + level.text, set_.blocks()[block].id, block);
    }
  }

  void AddDriver(const std::string& column) {
    auto& drivers = diagnosis_.drivers;
    if (std::ranges::find(drivers, column) == drivers.end()) drivers.push_back(column);
  }

  /// Adds the rival to `diagnosis.rivals` for each named effect that it lacks.
  void Keep(const Explanation& other, const std::string& word, const std::string& id,
            BlockIndex instead) {
    for (const BlockIndex own : best_.blocks) {
      if (Holds(other, own)) continue;
      const EffectKey lacking = KeyOf(set_.blocks()[own]);
      const double left = SignalLeft(set_, best_, lacking, other.blocks);
      constexpr double kSame = 1e-6;  // of the signal: the same columns
      if (set_.blocks()[instead].factors && left < kSame) continue;
      const auto of_this = std::ranges::count_if(diagnosis_.rivals, [&](const Rival& rival) {
        return rival.instead_of == lacking.id && rival.instead_of_word == lacking.word;
      });
      const bool known = std::ranges::any_of(diagnosis_.rivals, [&](const Rival& rival) {
        return rival.instead_of == lacking.id && rival.id == id && rival.word == word;
      });
      if (known || static_cast<std::size_t>(of_this) >= kMaxPerCause) continue;
      Rival& rival = diagnosis_.rivals.emplace_back();
      rival.instead_of = lacking.id;
      rival.instead_of_word = lacking.word;
      rival.id = id;
      rival.word = word;
      rival.signal_left = left;
      rival.evidence_gap = other.score - best_.score;
    }
  }

  CandidateSet& set_;
  const Explanation best_;
  Diagnosis& diagnosis_;
};

// Rejected rows.

std::vector<RowIndex> RejectedRows(const FitProblem& fit) {
  std::vector<RowIndex> rows;
  for (const RowIndex row : fit.rows) {
    if (fit.data.numbers[row].count > 0 && fit.weights[row] < kOutlierWeight) rows.push_back(row);
  }
  return rows;
}

/// The column in which some rows differ most from the others: the largest rank sum statistic of a
/// recorded signal, the row number and what gravity does included.
std::string ColumnOf(const Dataset& data, const std::vector<RowQuantity>& loads,
                     const std::vector<RowIndex>& rows) {
  const std::set<RowIndex> own(rows.begin(), rows.end());
  const auto n = static_cast<double>(data.rows()), m = static_cast<double>(own.size());
  const auto deviation = [&](const auto& value_of) {
    double above = 0;  // pairs in which the own row has the larger value
    for (const RowIndex row : own) {
      for (const RowIndex other : data.row_indices()) {
        if (own.contains(other)) continue;
        const double a = value_of(row), b = value_of(other);
        above += a > b ? 1 : a == b ? 0.5 : 0;
      }
    }
    return std::abs(above / (m * (n - m)) - 0.5);
  };
  std::string column = "row";
  double largest = deviation([](RowIndex row) { return static_cast<double>(row.value()); });
  const auto compare = [&](const std::string& name, const PerRow<double>& values) {
    const double own_deviation = deviation([&](RowIndex row) { return values[row]; });
    if (own_deviation <= largest) return;
    largest = own_deviation;
    column = name;
  };
  for (const RecordedSignal& signal : data.signals) compare(signal.column, signal.values);
  for (const RowQuantity& load : loads) compare(load.column, load.values);
  return column;
}

}  // namespace

void AddOpenRivals(Identified& found, Diagnosis& diagnosis) {
  OpenRivals rivals(found, diagnosis);
  rivals.TryCurves();
  const std::vector<Level> levels = LevelsOf(found.fit.data);
  if (!levels.empty()) rivals.TryLevels(levels, EffectsThatMayVary(found));
}

std::optional<RejectedRegime> RegimeOfRejectedRows(const Identified& found) {
  constexpr std::size_t kMinRejected = 4;  // poses
  const Dataset& data = found.fit.data;
  const std::vector<RowIndex> rejected = RejectedRows(found.fit);
  std::set<ClusterIndex> poses;
  for (const RowIndex row : rejected) poses.insert(data.cluster_of[row]);
  if (poses.size() < kMinRejected) return std::nullopt;

  FitProblem fit = found.fit;
  auto there = std::make_shared<PerRow<double>>(data.rows(), 0.0);
  for (const RowIndex row : rejected) {
    fit.weights[row] = 1;
    (*there)[row] = 1;
  }
  const LinearProblem problem(fit, found.linear, found.model);
  CandidateSet set(problem);
  std::vector<BlockIndex> support;
  for (const BlockIndex block : found.best.blocks)
    support.push_back(set.Add(found.candidate_set->blocks()[block]));
  std::vector<Block> blocks = EffectsThatMayVary(found);
  for (Block& block : blocks) block.factors = there;
  const std::vector<BlockIndex> added = set.Add(blocks);
  const auto squares_there = [&](const Explanation& explanation) {
    const Eigen::VectorXd residual = set.Residual(explanation);
    std::vector<double> squares;
    for (const FitRowIndex j : problem.rows().indices()) {
      if ((*there)[problem.rows()[j]] > 0)
        squares.push_back(problem.layout().PartOf(residual, j).squaredNorm());
    }
    return squares;
  };
  const auto sum_of = [](const std::vector<double>& terms, int power) {
    double sum = 0;
    for (const double term : terms) sum += std::pow(term, power);
    return sum;
  };
  const std::vector<double> before = squares_there(set.Fit(support));
  const double total = sum_of(before, 1);
  // Gross errors of different sizes have fewer numbers than rows: the participation ratio.
  const double numbers = data.lengths_per_row() * total * total / sum_of(before, 2);
  std::optional<RejectedRegime> regime;
  double least = kConditionSignificance / static_cast<double>(added.size());
  for (const BlockIndex block : added) {
    if (!set.Observable(block)) continue;
    const Explanation with = set.Evaluate(With(support, block));
    const auto columns = static_cast<double>(std::ranges::count_if(
        with.columns, [&](ColumnIndex column) { return set.BlockOfColumn(column) == block; }));
    if (columns == 0 || numbers <= columns + 1) continue;
    const double left = sum_of(squares_there(with), 1), freedom = numbers - columns;
    const double p =
        FisherTail((total - left) / columns / std::max(left / freedom, 1e-9), columns, freedom);
    if (p >= least) continue;
    least = p;
    const Block& own = set.blocks()[block];
    regime =
        RejectedRegime{static_cast<int>(rejected.size()), EffectName(own.id, own.term.word, {}),
                       ColumnOf(data, GravityLoadsAt(data, *found.linear), rejected)};
  }
  return regime;
}

}  // namespace plumbline::measure
