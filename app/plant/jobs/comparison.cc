#include "app/plant/jobs/comparison.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "firmware-like/statistics/statistics.h"

namespace plumbline::plant {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;
using Change = CellComparison::Change;

constexpr double kNormal95 = 1.96;
constexpr std::size_t kWorstShown = 10;

/// A member of a JSON object; null if there is none.
const json& MemberOf(const json& object, const char* name) {
  static const json none;
  const auto found = object.is_object() ? object.find(name) : object.end();
  return found == object.end() ? none : *found;
}

std::string TextMember(const json& object, const char* name) {
  const json& member = MemberOf(object, name);
  return member.is_string() ? member.get<std::string>() : "";
}

std::optional<double> PositiveMember(const json& object, const char* name) {
  const json& member = MemberOf(object, name);
  if (!member.is_number() || !(member.get<double>() > 0)) return std::nullopt;
  return member.get<double>();
}

/// "joint_compliance q2 q3" for each effect, sorted.
std::vector<std::string> EffectsIn(const json& answer) {
  std::vector<std::string> effects;
  const json& all = MemberOf(answer, "effects");
  for (const json& effect : all.is_array() ? all : json::array()) {
    std::string text = TextMember(effect, "id");
    const json& scope = MemberOf(effect, "scope");
    for (const json& joint : scope.is_array() ? scope : json::array()) {
      if (joint.is_string()) text += " " + joint.get<std::string>();
    }
    effects.push_back(std::move(text));
  }
  std::sort(effects.begin(), effects.end());
  return effects;
}

/// Error of one split and the standard deviation of its logarithm.
struct SplitError {
  double error_mm = 0, log_sd = 0;
};

std::optional<SplitError> ErrorOf(const json& split) {
  const auto error = PositiveMember(split, "after_mm"), low = PositiveMember(split, "after_low_mm"),
             high = PositiveMember(split, "after_high_mm");
  if (!error || !low || !high || *high < *low) return std::nullopt;
  return SplitError{*error, (std::log(*high) - std::log(*low)) / (2 * kNormal95)};
}

std::optional<HeldOutPair> PairOf(const json& old_answer, const json& new_answer) {
  std::optional<HeldOutPair> hardest;
  const json &old_splits = MemberOf(old_answer, "held_out"),
             &new_splits = MemberOf(new_answer, "held_out");
  if (!old_splits.is_array() || !new_splits.is_array()) return std::nullopt;
  for (const json& old_split : old_splits) {
    const auto old_error = ErrorOf(old_split);
    if (!old_error || (hardest && hardest->old_mm >= old_error->error_mm)) continue;
    for (const json& new_split : new_splits) {
      const auto new_error = ErrorOf(new_split);
      if (!new_error || TextMember(new_split, "by") != TextMember(old_split, "by")) continue;
      hardest = {TextMember(old_split, "by"), old_error->error_mm, new_error->error_mm,
                 std::hypot(old_error->log_sd, new_error->log_sd)};
    }
  }
  return hardest;
}

/// Why a version gave no answer; empty if it gave one.
std::string WhyNone(const JobAnswer& answer) {
  if (!answer.failed.empty()) return "failed: " + answer.failed;
  if (!answer.output.is_object()) return "not finished";
  const std::string refused = TextMember(answer.output, "refused");
  return refused.empty() ? "" : "refused: " + refused;
}

double LogRatioOf(const HeldOutPair& error) {
  return std::log(error.new_mm) - std::log(error.old_mm);
}

Change ChangeOf(const HeldOutPair& error) {
  const double log_ratio = LogRatioOf(error);
  const double limit = std::max(kNormal95 * error.log_sd, std::log1p(kLeastChange));
  if (std::abs(log_ratio) <= limit) return Change::kEqual;
  return log_ratio > 0 ? Change::kWorse : Change::kBetter;
}

const char* NameOf(Change change) {
  switch (change) {
    case Change::kEqual:
      return "equal";
    case Change::kBetter:
      return "better";
    case Change::kWorse:
      return "worse";
    case Change::kRefused:
      return "no answer";
    case Change::kAnswers:
      return "answers now";
    case Change::kNotComparable:
      return "not comparable";
  }
  return "?";
}

bool IsWorseChange(Change change) {
  return change == Change::kWorse || change == Change::kRefused;
}

double LogRatioOf(const CellComparison& cell) {
  return cell.error ? LogRatioOf(*cell.error) : 0;
}

void AddPlantRatio(PlantComparison& comparison) {
  std::vector<double> logs;
  for (const CellComparison& cell : comparison.cells) {
    if (cell.error) logs.push_back(LogRatioOf(cell));
  }
  const auto count = static_cast<double>(logs.size());
  if (count < 3) return;
  double mean = 0, squares = 0;
  for (const double one : logs) mean += one / count;
  for (const double one : logs) squares += (one - mean) * (one - mean);
  const double sd = std::sqrt(squares / (count - 1) / count);
  const double half = statistics::StudentCoverageFactor(0.95, count - 1) * sd;
  comparison.ratio = std::exp(mean);
  comparison.ratio_low = std::exp(mean - half);
  comparison.ratio_high = std::exp(mean + half);
}

std::string FoundText(const std::string& verdict, const std::vector<std::string>& effects) {
  return effects.empty() ? verdict : fmt::format("{} ({})", verdict, fmt::join(effects, ", "));
}

/// "line/node  0.031 -> 0.052 mm (+68 %, 95 % within ±21 %), worse".
std::string CellLine(const CellComparison& cell) {
  if (!cell.error)
    return fmt::format("  {:<24} {}: {}\n", cell.cell, NameOf(cell.change), cell.reason);
  return fmt::format("  {:<24} {:.4g} -> {:.4g} mm by {} ({:+.1f} %, uncertainty {:.1f} %): {}\n",
                     cell.cell, cell.error->old_mm, cell.error->new_mm, cell.error->by,
                     100 * std::expm1(LogRatioOf(cell)),
                     100 * std::expm1(kNormal95 * cell.error->log_sd), NameOf(cell.change));
}

}  // namespace

CellComparison CompareAnswers(const std::string& cell, const JobAnswer& old_answer,
                              const JobAnswer& new_answer) {
  CellComparison result;
  result.cell = cell;
  const std::string no_old = WhyNone(old_answer), no_new = WhyNone(new_answer);
  if (!no_old.empty() || !no_new.empty()) {
    result.change = no_old.empty()   ? Change::kRefused
                    : no_new.empty() ? Change::kAnswers
                                     : Change::kNotComparable;
    result.reason = no_new.empty() ? "old version " + no_old : "new version " + no_new;
    return result;
  }
  result.verdict_old = TextMember(old_answer.output, "verdict");
  result.verdict_new = TextMember(new_answer.output, "verdict");
  result.effects_old = EffectsIn(old_answer.output);
  result.effects_new = EffectsIn(new_answer.output);
  const auto data = [](const JobAnswer& answer) {
    return TextMember(MemberOf(answer.output, "plant"), "data_sha256");
  };
  if (data(old_answer) != data(new_answer)) {
    result.reason = "the rows differ: further ones of that time arrived in between";
    return result;
  }
  result.error = PairOf(old_answer.output, new_answer.output);
  if (!result.error) {
    result.reason = "no error of held-out rows in both answers";
    return result;
  }
  result.change = ChangeOf(*result.error);
  return result;
}

bool PlantComparison::IsWorse() const {
  return worse > 0 || (ratio_low && *ratio_low > 1 && *ratio > 1 + kLeastPlantChange);
}

PlantComparison CompareCells(std::vector<CellComparison> cells) {
  PlantComparison comparison;
  std::stable_sort(cells.begin(), cells.end(), [](const auto& a, const auto& b) {
    return std::pair(a.change != Change::kRefused, -LogRatioOf(a)) <
           std::pair(b.change != Change::kRefused, -LogRatioOf(b));
  });
  for (const CellComparison& cell : cells) {
    comparison.better += cell.change == Change::kBetter || cell.change == Change::kAnswers;
    comparison.equal += cell.change == Change::kEqual;
    comparison.worse += IsWorseChange(cell.change);
    comparison.not_comparable += cell.change == Change::kNotComparable;
    comparison.changed_findings += cell.found_differs();
  }
  comparison.cells = std::move(cells);
  AddPlantRatio(comparison);
  return comparison;
}

std::string ComparisonText(const PlantComparison& comparison) {
  std::string text = fmt::format(
      "cells: {} better, {} equal, {} worse, {} not comparable; findings changed in {}\n",
      comparison.better, comparison.equal, comparison.worse, comparison.not_comparable,
      comparison.changed_findings);
  if (comparison.ratio) {
    text += fmt::format("held-out error, new / old, all cells: {:.4f} (95 %: {:.4f} to {:.4f})\n",
                        *comparison.ratio, *comparison.ratio_low, *comparison.ratio_high);
  }
  std::size_t shown = 0;
  for (const CellComparison& cell : comparison.cells) {
    if (cell.change == Change::kEqual && LogRatioOf(cell) <= 0) continue;
    if (shown++ < kWorstShown || IsWorseChange(cell.change)) text += CellLine(cell);
  }
  for (const CellComparison& cell : comparison.cells) {
    if (!cell.found_differs()) continue;
    text += fmt::format("  {:<24} finds {} instead of {}\n", cell.cell,
                        FoundText(cell.verdict_new, cell.effects_new),
                        FoundText(cell.verdict_old, cell.effects_old));
  }
  return text;
}

ordered_json ComparisonJson(const PlantComparison& comparison) {
  const auto number = [](const std::optional<double>& value) {
    return value ? ordered_json(*value) : ordered_json(nullptr);
  };
  ordered_json answer = {{"schema", 1},
                         {"worse_than_before", comparison.IsWorse()},
                         {"better", comparison.better},
                         {"equal", comparison.equal},
                         {"worse", comparison.worse},
                         {"not_comparable", comparison.not_comparable},
                         {"findings_changed", comparison.changed_findings},
                         {"ratio", number(comparison.ratio)},
                         {"ratio_low", number(comparison.ratio_low)},
                         {"ratio_high", number(comparison.ratio_high)},
                         {"cells", ordered_json::array()}};
  for (const CellComparison& cell : comparison.cells) {
    ordered_json one = {{"cell", cell.cell}, {"change", NameOf(cell.change)}};
    if (cell.error) {
      one["by"] = cell.error->by;
      one["old_mm"] = cell.error->old_mm;
      one["new_mm"] = cell.error->new_mm;
      one["log_ratio_sd"] = cell.error->log_sd;
    }
    if (!cell.reason.empty()) one["reason"] = cell.reason;
    one["old"] = {{"verdict", cell.verdict_old}, {"effects", cell.effects_old}};
    one["new"] = {{"verdict", cell.verdict_new}, {"effects", cell.effects_new}};
    answer["cells"].push_back(std::move(one));
  }
  return answer;
}

}  // namespace plumbline::plant
