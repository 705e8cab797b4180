#include "app/measure/imports/row_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace plumbline::measure {
namespace {

/// Places of the rows of a file in an order other than that of the lines.
using Ranks = std::vector<std::size_t>;

/// The rank of each row by a key; nullopt if a row has none or two rows have the same.
template <typename KeyOf>
std::optional<Ranks> RanksBy(const ImportedTable& table, KeyOf key_of) {
  std::vector<double> keys;
  for (const ImportedRow& row : table.rows) {
    const std::optional<double> key = key_of(row);
    if (!key) return std::nullopt;
    keys.push_back(*key);
  }
  Ranks order(keys.size()), ranks(keys.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t row) { return keys[row]; });
  for (std::size_t k = 0; k < order.size(); ++k) {
    if (k > 0 && keys[order[k]] == keys[order[k - 1]]) return std::nullopt;
    ranks[order[k]] = k;
  }
  return ranks;
}

/// The number at the end of a text such as "17", "P17" or "Point 017".
std::optional<double> NumberAtEnd(const ImportedRow& row, const char* column) {
  const auto text = row.texts.find(column);
  if (text == row.texts.end()) return std::nullopt;
  if (const auto number = text::NumberIn(text->second, '.')) return number;
  const std::size_t digits = text->second.find_last_not_of("0123456789") + 1;
  if (digits >= text->second.size() || text->second.size() - digits > 9) return std::nullopt;
  return std::stod(text->second.substr(digits));
}

std::optional<Ranks> RanksByNumber(const ImportedTable& table) {
  for (const char* column : {"number", "name"}) {
    if (auto ranks = RanksBy(table, [&](const auto& row) { return NumberAtEnd(row, column); })) {
      return ranks;
    }
  }
  return std::nullopt;
}

std::optional<double> TimeOf(const ImportedRow& row) {
  const auto t_s = row.numbers.find("t_s");
  return t_s == row.numbers.end() ? std::nullopt : std::optional(t_s->second);
}

Ranks InOrder(std::size_t rows) {
  Ranks ranks(rows);
  std::iota(ranks.begin(), ranks.end(), std::size_t{0});
  return ranks;
}

/// An order of the rows that a kind of column shows, in one file or in both.
struct Evidence {
  std::string name;  ///< "numbers", "times"
  std::optional<Ranks> measured, joints;

  /// The pairs in which both rows have the same rank; nullopt if no file has any.
  std::optional<Ranks> Pairs() const {
    if (!measured && !joints) return std::nullopt;
    const std::size_t rows = (measured ? *measured : *joints).size();
    const Ranks of_joints = joints.value_or(InOrder(rows));
    Ranks row_of_rank(rows), pairs;
    for (std::size_t j = 0; j < rows; ++j) row_of_rank[of_joints[j]] = j;
    for (const std::size_t rank : measured.value_or(InOrder(rows))) {
      pairs.push_back(row_of_rank[rank]);
    }
    return pairs;
  }
};

/// True if the times of each pair differ by the same amount.
bool ClocksConfirm(const ImportedTable& measured, const ImportedTable& joints, const Ranks& pairs) {
  if (pairs.size() < 3) return false;
  double least = std::numeric_limits<double>::infinity(), most = -least, shortest = least;
  std::vector<double> times;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double t_s = *TimeOf(measured.rows[i]);
    const double difference_s = t_s - *TimeOf(joints.rows[pairs[i]]);
    least = std::min(least, difference_s), most = std::max(most, difference_s);
    times.push_back(t_s);
  }
  std::ranges::sort(times);
  for (std::size_t k = 1; k < times.size(); ++k) {
    shortest = std::min(shortest, times[k] - times[k - 1]);
  }
  return most - least < shortest / 2;
}

/// "by the numbers of a.csv, which b.csv lacks, line 3 of a.csv belongs to line 5 of b.csv, not to
/// line 3": the first row that the evidence puts elsewhere.
std::string ObjectionText(const Evidence& evidence, const Ranks& pairs,
                          const ImportedTable& measured, const ImportedTable& joints,
                          const std::string& joints_file) {
  std::size_t i = 0;
  while (pairs[i] == i) ++i;
  const ImportedRow& row = measured.rows[i];
  const std::string whose = evidence.measured && evidence.joints ? "both files"
                            : evidence.measured
                                ? fmt::format("{}, which {} lacks", row.file, joints_file)
                                : fmt::format("{}, which {} lacks", joints_file, row.file);
  return fmt::format("by the {} of {}, line {} of {} belongs to line {} of {}, not to line {}",
                     evidence.name, whose, row.line, row.file, joints.rows[pairs[i]].line,
                     joints_file, joints.rows[i].line);
}

/// What the other kind of evidence says about an objection to the order of the rows.
std::string OtherText(const Evidence& other, const std::optional<Ranks>& pairs,
                      const Ranks& by_row) {
  if (!pairs) return "nothing confirms that";
  if (*pairs == by_row) return fmt::format("the {} agree with the order of the lines", other.name);
  return fmt::format("the {} show a third order", other.name);
}

}  // namespace

std::optional<RowPairing> PairingOf(const ImportedTable& measured, const ImportedTable& joints,
                                    const std::string& joints_file, config::FaultList& faults) {
  const Ranks by_row = InOrder(measured.rows.size());
  const Evidence numbers{"numbers", RanksByNumber(measured), RanksByNumber(joints)};
  const Evidence times{"times", RanksBy(measured, TimeOf), RanksBy(joints, TimeOf)};
  const auto by_number = numbers.Pairs(), by_time = times.Pairs();
  if (times.measured && times.joints && ClocksConfirm(measured, joints, *by_time)) {
    return RowPairing{*by_time, "time"};
  }
  const bool numbers_object = by_number && *by_number != by_row;
  const bool times_object = by_time && *by_time != by_row;
  if (!numbers_object && !times_object) return RowPairing{by_row, "row"};
  if (by_number == by_time) return RowPairing{*by_number, "number and time"};
  const std::string objection =
      numbers_object ? ObjectionText(numbers, *by_number, measured, joints, joints_file)
                     : ObjectionText(times, *by_time, measured, joints, joints_file);
  faults.Add({config::Fault::Severity::kFault, joints_file, 0, "",
              fmt::format("the rows of the two files cannot be matched: {}, but {}. Number the "
                          "rows of both files alike. If the rows are in the same order all the "
                          "same, map the column to \"ignore\" with --mapping",
                          objection,
                          numbers_object ? OtherText(times, by_time, by_row)
                                         : OtherText(numbers, by_number, by_row))});
  return std::nullopt;
}

}  // namespace plumbline::measure
