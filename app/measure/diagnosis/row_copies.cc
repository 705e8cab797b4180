#include "app/measure/diagnosis/row_copies.h"

#include <fmt/format.h>

#include <cmath>
#include <set>
#include <tuple>

namespace plumbline::measure {
namespace {

/// Erases the marked rows and their observations.
void EraseRows(Dataset& data, const std::vector<bool>& erased) {
  std::vector<MeasuredRow> rows;
  PerRow<Observation> observations;
  for (const RowIndex row : data.row_indices()) {
    if (erased[row.offset()]) continue;
    rows.push_back(std::move(data.table.rows[row.offset()]));
    observations.push_back(data.observations[row]);
  }
  data.table.rows = std::move(rows);
  data.observations = std::move(observations);
}

/// Every number of a row.
std::vector<double> NumbersOf(const MeasuredRow& row) {
  constexpr double kAbsent = HUGE_VAL;  // no cell holds it
  std::vector<double> numbers;
  for (const std::optional<double>& value : {row.t_s, row.payload_kg, row.temp_C, row.range_m,
                                             row.q_step_rad, row.gauge_m, row.sigma_m}) {
    numbers.push_back(value.value_or(kAbsent));
  }
  for (const std::optional<int>& number : {row.tool_number, row.payload_item})
    numbers.push_back(number ? *number : kAbsent);
  const Vec3 p = row.measured_W.value_or(Vec3::Constant(kAbsent));
  numbers.insert(numbers.end(), p.begin(), p.end());
  const Eigen::Vector4d turn =
      row.orientation_W ? row.orientation_W->coeffs() : Eigen::Vector4d::Constant(kAbsent);
  numbers.insert(numbers.end(), turn.begin(), turn.end());
  for (const model::JointVector* of_joints : {&row.q, &row.qd, &row.qdd, &row.tau}) {
    numbers.insert(numbers.end(), of_joints->begin(), of_joints->end());
  }
  numbers.insert(numbers.end(), row.further.begin(), row.further.end());
  return numbers;
}

}  // namespace

void DropCopies(Dataset& data) {
  std::set<std::tuple<std::string, std::string, std::vector<double>>> seen;
  const bool timed = data.table.recorded.time;
  int copies = 0, first = 0;
  std::vector<bool> copy;
  for (const MeasuredRow& row : data.table.rows) {
    copy.push_back(!seen.emplace(row.session, row.artefact, NumbersOf(row)).second);
    if (copy.back() && copies++ == 0) first = row.line;
  }
  if (copies == 0) return;
  if (timed) EraseRows(data, copy);
  data.notes.push_back(
      timed ? fmt::format(
                  "{} rows are exact copies of earlier rows and were ignored (first: line {})",
                  copies, first)
            : fmt::format(
                  "{} rows are equal to earlier rows in every digit (first: line {}); without t_s "
                  "they cannot be distinguished from repeated measurements and were kept",
                  copies, first));
}

}  // namespace plumbline::measure
