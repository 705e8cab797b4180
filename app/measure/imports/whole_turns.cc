#include "app/measure/imports/whole_turns.h"

#include <fmt/format.h>

#include <cmath>

#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

constexpr double kTurn_deg = 360;

}  // namespace

void SubtractWholeTurns(const model::Robot& robot, double margin_rad, ImportedTable& table) {
  const double margin_deg = kDegPerRad * margin_rad;
  const kinematics::Chain chain(robot);
  for (int j = 0; j < robot.size(); ++j) {
    const model::Joint& joint = robot.joints[j];
    const double low_deg = kDegPerRad * joint.min, high_deg = kDegPerRad * joint.max;
    const bool one_turn = high_deg - low_deg <= kTurn_deg + 2 * margin_deg;  // false if unlimited
    if (!chain.RepeatsAfterTurn(j) || !one_turn) continue;
    const std::string column =
        model::JointColumnName(model::JointQuantity::kPosition, joint.type, j);
    std::vector<ImportedRow*> above;
    bool fits = true;
    for (ImportedRow& row : table.rows) {
      const auto value = row.numbers.find(column);
      if (value == row.numbers.end()) continue;
      const double q_deg = value->second;
      const bool high = q_deg > high_deg + margin_deg;
      const double kept_deg = high ? q_deg - kTurn_deg : q_deg;
      fits = fits && q_deg >= 0 && q_deg <= kTurn_deg && kept_deg >= low_deg - margin_deg;
      if (high) above.push_back(&row);
    }
    if (!fits || above.empty()) continue;
    const double first_deg = above.front()->numbers.at(column);
    table.notes.push_back(fmt::format(
        "{}: the file counts from 0 to 360 degrees, the cell from {:.6g} to {:.6g}: 360 subtracted "
        "in {} of {} rows, the first in line {} ({:.6g} becomes {:.6g})",
        column, low_deg, high_deg, above.size(), table.rows.size(), above.front()->line, first_deg,
        first_deg - kTurn_deg));
    for (ImportedRow* row : above) row->numbers.at(column) -= kTurn_deg;
  }
}

}  // namespace plumbline::measure
