#include "firmware-like/effects/influence.h"

#include "firmware-like/model/joint_columns.h"

namespace plumbline::effects {
namespace {

model::JointVector ValuesOf(const Conditions& conditions, model::JointQuantity quantity) {
  switch (quantity) {
    case model::JointQuantity::kPosition:
      return conditions.Reported(conditions.q);
    case model::JointQuantity::kVelocity:
      return conditions.Reported(conditions.qd);
    case model::JointQuantity::kAcceleration:
      return conditions.Reported(conditions.qdd);
    case model::JointQuantity::kTorque:
      return conditions.tau;
  }
  return conditions.Reported(conditions.q);
}

}  // namespace

model::JointVector Conditions::Reported(const model::JointVector& of_drives) const {
  if (!robot || of_drives.size() != robot->size()) return of_drives;
  return model::ReportedFromDrives<double>(robot->couplings, of_drives);
}

std::optional<double> Conditions::Signal(std::string_view column) const {
  if (column == "t_s") return t_s;
  if (column == "temp_C") return temp_C;
  if (column == "payload_kg") return payload_kg;
  if (column == "row") return row;
  if (const std::optional<model::JointColumn> known = model::JointColumnFromName(column)) {
    const model::JointVector values = ValuesOf(*this, known->form->quantity);
    if (known->joint >= values.size()) return std::nullopt;
    return values[known->joint] * known->form->from_SI;
  }
  for (const RecordedValue& recorded : further) {
    if (recorded.column == column) return recorded.value;
  }
  return std::nullopt;
}

double ShareOfMove(const Conditions& conditions, int joint) {
  if (conditions.last_move.size() <= joint) return 0;
  const double leading = conditions.last_move.cwiseAbs().maxCoeff();
  return leading > 0 ? conditions.last_move[joint] / leading : 0;
}

Conditions DeclaredConditions(const model::CellModel& cell) {
  Conditions conditions;
  conditions.robot = std::make_shared<const model::Robot>(cell.robot);
  conditions.reference_temperature_C = cell.measurement.reference_temperature_C;
  conditions.camera = cell.measurement.X_WC.has_value();
  return conditions;
}

}  // namespace plumbline::effects
