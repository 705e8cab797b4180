#include "app/measure/table/conditions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "firmware-like/loads/numbered_load.h"

namespace plumbline::measure {
namespace {

constexpr double kStandstill = 1e-6;  // [rad] or [m]; smaller changes are reading noise, not moves

/// History of moves of the drives: their previous positions in each session, and how they were
/// approached.
class MoveHistory {
 public:
  MoveHistory(const model::Robot& robot, const MeasuredTable& table)
      : robot_(robot), table_(table) {}

  /// Processes everything before a row: rows without a measurement, and breaks, after which the
  /// previous move is unknown.
  void AdvanceTo(int line) {
    while (true) {
      const int next_row = unmeasured_ < table_.unmeasured.size()
                               ? table_.unmeasured[unmeasured_].line
                               : std::numeric_limits<int>::max();
      const int next_break =
          break_ < table_.breaks.size() ? table_.breaks[break_] : std::numeric_limits<int>::max();
      // A break takes effect before the row of its own line.
      if (next_break <= std::min(next_row, line)) {
        last_of_session_.clear();
        ++break_;
      } else if (next_row < line) {
        effects::Conditions unused;
        Add(table_.unmeasured[unmeasured_], unused);
        ++unmeasured_;
      } else {
        return;
      }
    }
  }

  /// Sets the last move and the approach directions of a row.
  void Add(const MeasuredRow& row, effects::Conditions& moment) {
    const model::JointVector q = effects::OfDrives(robot_, row.q);
    const auto before = last_of_session_.find(row.session);
    if (before != last_of_session_.end()) {
      const Place& last = before->second;
      moment.last_move = q - last.q;
      moment.approach =
          last.approach.size() > 0 ? last.approach : model::JointVector::Zero(q.size());
      for (Eigen::Index i = 0; i < q.size(); ++i) {
        if (std::abs(moment.last_move[i]) > kStandstill) {
          moment.approach[i] = moment.last_move[i] > 0 ? 1.0 : -1.0;
        }
      }
    }
    last_of_session_[row.session] = {q, moment.approach};
  }

 private:
  struct Place {
    model::JointVector q, approach;
  };
  const model::Robot& robot_;
  const MeasuredTable& table_;
  std::size_t unmeasured_ = 0, break_ = 0;
  std::map<std::string, Place> last_of_session_;
};

}  // namespace

std::vector<effects::Conditions> ConditionsOf(const model::CellModel& cell,
                                              const MeasuredTable& table) {
  std::vector<effects::Conditions> conditions;
  conditions.reserve(table.rows.size());
  const effects::Conditions declared = effects::DeclaredConditions(cell);
  MoveHistory history(cell.robot, table);
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    const MeasuredRow& row = table.rows[k];
    effects::Conditions& moment = conditions.emplace_back(declared);
    moment.q = effects::OfDrives(cell.robot, row.q);
    moment.qd = effects::OfDrives(cell.robot, row.qd);
    moment.qdd = effects::OfDrives(cell.robot, row.qdd);
    moment.tau = row.tau;
    if (row.payload_kg) moment.payload_kg = *row.payload_kg;
    moment.payload_kg += loads::ItemMass_kg(cell, row.payload_item);
    if (row.t_s) moment.t_s = row.t_s;
    if (row.temp_C) moment.temp_C = row.temp_C;
    moment.row = table.rows_before + static_cast<double>(k + 1);
    for (std::size_t i = 0; i < table.further.size(); ++i) {
      moment.further.push_back({table.further[i], row.further[i]});
    }
    if (row.measured_W) moment.camera_name = row.camera;
    history.AdvanceTo(row.line);
    history.Add(row, moment);
  }
  return conditions;
}

}  // namespace plumbline::measure
