#include "app/cli/imported_joints.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "firmware-like/geometry/angle.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/joint_columns.h"
#include "firmware-like/plausibility_filter.h"

namespace plumbline::cli {
namespace {

std::vector<const measure::MeasuredRow*> AllRows(const measure::MeasuredTable& table) {
  std::vector<const measure::MeasuredRow*> rows;
  for (const auto* list : {&table.rows, &table.unmeasured}) {
    for (const measure::MeasuredRow& row : *list) rows.push_back(&row);
  }
  return rows;
}

/// True if the angles were probably degrees that were read as radians: a joint is turned by more
/// than two turns, and every row is within the limits once the factor is undone.
bool AreDegrees(const kinematics::Chain& chain,
                const std::vector<const measure::MeasuredRow*>& rows, double margin) {
  constexpr double kTwoTurns_rad = 4 * std::numbers::pi;
  double largest_rad = 0;
  const bool fit = std::all_of(rows.begin(), rows.end(), [&](const measure::MeasuredRow* row) {
    model::JointVector q = row->q;
    for (int j = 0; j < chain.size(); ++j) {
      if (chain.type(j) != model::JointType::kRevolute) continue;
      largest_rad = std::max(largest_rad, std::abs(q[j]));
      q[j] *= kRadPerDeg;
    }
    return chain.WithinLimits(q, margin);
  });
  return fit && largest_rad > kTwoTurns_rad;
}

std::string Remedy(bool are_degrees, const std::string& angle_unit) {
  if (are_degrees) {
    return fmt::format("all rows fit if the angles are in degrees: {}",
                       angle_unit == "rad"
                           ? "give --angle-unit deg"
                           : "correct the unit of the angles in the file or mapping");
  }
  return "check --angle-unit, the order of the joints and the limits of the cell; without --cell "
         "the limits are not checked";
}

}  // namespace

void CheckImportedJoints(const model::CellModel& cell, const measure::MeasuredTable& table,
                         const std::string& angle_unit, config::FaultList& faults) {
  const double margin = PlausibilityLimits{}.limit_margin_rad;
  const kinematics::Chain chain(cell.robot);
  const std::vector<const measure::MeasuredRow*> rows = AllRows(table);
  for (int j = 0; j < chain.size(); ++j) {
    const double low = chain.lower()[j], high = chain.upper()[j];
    const measure::MeasuredRow* first = nullptr;
    int outside = 0;
    for (const measure::MeasuredRow* row : rows) {
      if (row->q[j] >= low - margin && row->q[j] <= high + margin) continue;
      ++outside;
      if (first == nullptr || row->line < first->line) first = row;
    }
    if (first == nullptr) continue;
    const double unit = model::PositionForm(chain.type(j)).to_SI;
    faults.Add(
        {config::Fault::Severity::kFault, table.file, first->line,
         model::JointColumnName(model::JointQuantity::kPosition, chain.type(j), j),
         fmt::format("{:.6g} is outside the joint limits {:.6g} to {:.6g} of the cell, as in "
                     "{} of {} row{}; no file is written; {}",
                     first->q[j] / unit, low / unit, high / unit, outside, rows.size(),
                     rows.size() == 1 ? "" : "s",
                     Remedy(AreDegrees(chain, rows, margin), angle_unit))});
    return;
  }
}

}  // namespace plumbline::cli
