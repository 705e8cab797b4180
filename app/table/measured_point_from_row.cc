#include "app/table/measured_point_from_row.h"

namespace plumbline::table {

model::MeasuredPoint MeasuredPointFromRow(const MeasuredRow& row, const RecordedColumns& recorded) {
  model::MeasuredPoint point;
  point.q = row.q;
  if (recorded.time) point.t_s = row.t_s;
  if (recorded.qd) point.qd = row.qd;
  if (recorded.qdd) point.qdd = row.qdd;
  if (recorded.tau) point.tau = row.tau;
  if (recorded.q_step) point.q_step_rad = row.q_step_rad;
  if (recorded.payload) point.payload_kg = row.payload_kg;
  if (recorded.temperature) point.temp_C = row.temp_C;
  if (recorded.position && row.has_point) point.measured_W = row.p_WT;
  if (recorded.range && row.has_range) point.range_m = row.range_m;
  if (recorded.orientation && row.has_orientation) point.orientation_W = row.q_WT;
  return point;
}

}  // namespace plumbline::table
