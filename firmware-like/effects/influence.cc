#include "firmware-like/effects/influence.h"

#include <array>
#include <charconv>

#include "firmware-like/geometry/angle.h"

namespace plumbline {
namespace {

/// A column with one value a joint: prefix, number, suffix; and its SI value's factor to the file.
struct JointColumn {
  std::string_view prefix, suffix;
  JointVector Conditions::*values;
  double from_SI;
};

constexpr std::array kJointColumns = {
    JointColumn{"q", "_deg", &Conditions::q, kDegPerRad},
    JointColumn{"q", "_mm", &Conditions::q, 1e3},
    JointColumn{"qd", "_deg_s", &Conditions::qd, kDegPerRad},
    JointColumn{"qd", "_mm_s", &Conditions::qd, 1e3},
    JointColumn{"qdd", "_deg_s2", &Conditions::qdd, kDegPerRad},
    JointColumn{"qdd", "_mm_s2", &Conditions::qdd, 1e3},
    JointColumn{"tau", "_Nm", &Conditions::tau, 1},
};

/// The joint (0-based) of a column such as "q3_deg"; nothing where it is no such column.
std::optional<int> JointOf(std::string_view column, const JointColumn& pattern) {
  if (!column.starts_with(pattern.prefix) || !column.ends_with(pattern.suffix)) return std::nullopt;
  if (column.size() <= pattern.prefix.size() + pattern.suffix.size()) return std::nullopt;
  const char* begin = column.data() + pattern.prefix.size();
  const char* end = column.data() + column.size() - pattern.suffix.size();
  int number = 0;
  const auto [stop, error] = std::from_chars(begin, end, number);
  if (error != std::errc() || stop != end || number < 1) return std::nullopt;
  return number - 1;
}

}  // namespace

std::optional<double> Conditions::Signal(std::string_view column) const {
  if (column == "t_s") return t_s;
  if (column == "temp_C") return temp_C;
  if (column == "payload_kg") return payload_kg;
  if (column == "row") return row;
  for (const JointColumn& pattern : kJointColumns) {
    const std::optional<int> joint = JointOf(column, pattern);
    if (!joint) continue;
    const JointVector& values = this->*pattern.values;
    if (*joint >= values.size()) return std::nullopt;
    return values[*joint] * pattern.from_SI;
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

Conditions DeclaredConditions(const CellModel& cell) {
  Conditions conditions;
  conditions.robot = std::make_shared<const Robot>(cell.robot);
  conditions.reference_temperature_C = cell.measurement.reference_temperature_C;
  conditions.camera = cell.measurement.X_WC.has_value();
  return conditions;
}

}  // namespace plumbline
