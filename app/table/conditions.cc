#include "app/table/conditions.h"

#include <cmath>
#include <map>

namespace plumbline {
namespace {

constexpr double kStandstill = 1e-6;  // [rad] or [m]: less is no move, only the reading's noise

}  // namespace

std::vector<Conditions> ConditionsOf(const CellModel& cell, const MeasuredTable& table) {
  std::vector<Conditions> conditions;
  conditions.reserve(table.rows.size());
  const Conditions declared = DeclaredConditions(cell);
  std::map<std::string, std::size_t> last_of_session;
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    const MeasuredRow& row = table.rows[k];
    Conditions& moment = conditions.emplace_back(declared);
    moment.q = row.q;
    if (table.recorded.qd) moment.qd = row.qd;
    if (table.recorded.qdd) moment.qdd = row.qdd;
    if (table.recorded.tau) moment.tau = row.tau;
    if (table.recorded.payload) moment.payload_kg = row.payload_kg;
    if (table.recorded.time) moment.t_s = row.t_s;
    if (table.recorded.temperature) moment.temp_C = row.temp_C;
    moment.row = static_cast<double>(k + 1);
    for (std::size_t i = 0; i < table.further.size(); ++i) {
      moment.further.push_back({table.further[i], row.further[i]});
    }
    const auto before = last_of_session.find(row.session);
    if (before != last_of_session.end()) {
      const Conditions& last = conditions[before->second];
      moment.last_move = row.q - last.q;
      moment.approach = last.approach.size() > 0 ? last.approach : JointVector::Zero(row.q.size());
      for (Eigen::Index i = 0; i < row.q.size(); ++i) {
        if (std::abs(moment.last_move[i]) > kStandstill) {
          moment.approach[i] = moment.last_move[i] > 0 ? 1.0 : -1.0;
        }
      }
    }
    last_of_session[row.session] = k;
  }
  return conditions;
}

}  // namespace plumbline
