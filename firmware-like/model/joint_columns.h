// Column grammar of joint values in files: q3_deg, qd3_deg_s, qdd3_deg_s2, tau3_Nm; of a prismatic
// joint q3_mm, qd3_mm_s, qdd3_mm_s2, tau3_N. Joints count from 1.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/geometry/angle.h"
#include "firmware-like/geometry/length.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline {

enum class JointQuantity { kPosition, kVelocity, kAcceleration, kTorque };

/// How one quantity of one type of joint is written: its name is prefix, joint number, "_", unit.
struct JointColumnForm {
  JointQuantity quantity;
  JointType type;
  std::string_view prefix;
  std::string_view unit;
  double to_SI = 1;    ///< a file's number times this is in SI
  double from_SI = 1;  ///< the reverse
};

inline constexpr std::array kJointColumnForms = {
    JointColumnForm{JointQuantity::kPosition, JointType::kRevolute, "q", "deg", kRadPerDeg,
                    kDegPerRad},
    JointColumnForm{JointQuantity::kPosition, JointType::kPrismatic, "q", "mm", kMetrePerMm,
                    kMmPerMetre},
    JointColumnForm{JointQuantity::kVelocity, JointType::kRevolute, "qd", "deg_s", kRadPerDeg,
                    kDegPerRad},
    JointColumnForm{JointQuantity::kVelocity, JointType::kPrismatic, "qd", "mm_s", kMetrePerMm,
                    kMmPerMetre},
    JointColumnForm{JointQuantity::kAcceleration, JointType::kRevolute, "qdd", "deg_s2", kRadPerDeg,
                    kDegPerRad},
    JointColumnForm{JointQuantity::kAcceleration, JointType::kPrismatic, "qdd", "mm_s2",
                    kMetrePerMm, kMmPerMetre},
    JointColumnForm{JointQuantity::kTorque, JointType::kRevolute, "tau", "Nm"},
    JointColumnForm{JointQuantity::kTorque, JointType::kPrismatic, "tau", "N"},
};

constexpr const JointColumnForm& FormOf(JointQuantity quantity, JointType type) {
  for (const JointColumnForm& form : kJointColumnForms) {
    if (form.quantity == quantity && form.type == type) return form;
  }
  return kJointColumnForms.front();  // the table has a form for each pair
}

/// A joint's position as files have it: deg, mm where it is prismatic.
constexpr const JointColumnForm& PositionForm(JointType type) {
  return FormOf(JointQuantity::kPosition, type);
}

/// @param joint  0-based
std::string JointColumnName(JointQuantity quantity, JointType type, int joint);

/// A column read back from its name.
struct JointColumn {
  const JointColumnForm* form = nullptr;
  int joint = 0;  ///< 0-based; need not be one of the cell's
};

/// @return  nothing where it is no such name. Allocates nothing.
std::optional<JointColumn> JointColumnFromName(std::string_view name);

/// Whether a name was meant as such a column: a prefix of the table and a digit.
bool ResemblesJointColumn(std::string_view name);

}  // namespace plumbline
