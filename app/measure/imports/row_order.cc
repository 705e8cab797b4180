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
  if (const auto number = NumberIn(text->second, '.')) return number;
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

/// The pairs in which both rows have the same rank; nullopt if no file has any.
std::optional<Ranks> Paired(const std::optional<Ranks>& measured,
                            const std::optional<Ranks>& joints) {
  if (!measured && !joints) return std::nullopt;
  const std::size_t rows = (measured ? *measured : *joints).size();
  const Ranks of_joints = joints.value_or(InOrder(rows)), of_rows = measured.value_or(of_joints);
  if (!measured) return Paired(InOrder(rows), joints);
  Ranks row_of_rank(rows), pairs;
  for (std::size_t j = 0; j < rows; ++j) row_of_rank[of_joints[j]] = j;
  for (const std::size_t rank : of_rows) pairs.push_back(row_of_rank[rank]);
  return pairs;
}

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

/// The first row that another order puts elsewhere: "row 1 (line 3) would belong to line 11".
std::string ExampleOf(const Ranks& pairs, const ImportedTable& measured,
                      const ImportedTable& joints, const std::string& joints_file) {
  std::size_t i = 0;
  while (pairs[i] == i) ++i;
  return fmt::format("line {} of {} would belong to line {} of {}, not to line {}",
                     measured.rows[i].line, measured.rows[i].file, joints.rows[pairs[i]].line,
                     joints_file, joints.rows[i].line);
}

}  // namespace

std::optional<RowPairing> PairingOf(const ImportedTable& measured, const ImportedTable& joints,
                                    const std::string& joints_file, config::FaultList& faults) {
  const Ranks by_row = InOrder(measured.rows.size());
  const auto by_number = Paired(RanksByNumber(measured), RanksByNumber(joints));
  const auto measured_times = RanksBy(measured, TimeOf), joint_times = RanksBy(joints, TimeOf);
  const auto by_time = Paired(measured_times, joint_times);
  if (measured_times && joint_times && ClocksConfirm(measured, joints, *by_time)) {
    return RowPairing{*by_time, "time"};
  }
  const bool numbers_object = by_number && *by_number != by_row;
  const bool times_object = by_time && *by_time != by_row;
  if (!numbers_object && !times_object) return RowPairing{by_row, "row"};
  if (by_number == by_time) return RowPairing{*by_number, "number and time"};
  const auto& object = numbers_object ? *by_number : *by_time;
  faults.Add(
      {config::Fault::Severity::kFault, joints_file, 0, "",
       fmt::format("the rows of both files cannot be matched: by its {} {}; {}. Number the rows of "
                   "both files alike. If the rows are in the same order all the same, map the "
                   "column to \"ignore\" with --mapping",
                   numbers_object ? "numbers, which only one of the files has," : "times",
                   ExampleOf(object, measured, joints, joints_file),
                   numbers_object && by_time ? (times_object ? "the times say something else again"
                                                             : "the times agree "
                                                               "with the order of "
                                                               "the rows")
                                             : "nothing else in the files decides")});
  return std::nullopt;
}

}  // namespace plumbline::measure
