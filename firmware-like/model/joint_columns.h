// Names and units of joint columns in data files: q3_deg, qd3_deg_s, qdd3_deg_s2, tau3_Nm; for a
// prismatic joint q3_mm, qd3_mm_s, qdd3_mm_s2, tau3_N. Joint numbers start at 1.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/geometry/units.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::model {

enum class JointQuantity { kPosition, kVelocity, kAcceleration, kTorque };

/// Column name and unit of one quantity for one joint type. The name is prefix, joint number, "_",
/// unit.
struct JointColumnForm {
  JointQuantity quantity;
  JointType type;
  std::string_view prefix;
  std::string_view unit;
  double to_SI = 1;    ///< SI value = file value * to_SI
  double from_SI = 1;  ///< file value = SI value * from_SI
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

/// Form of the position column: deg, or mm for a prismatic joint.
constexpr const JointColumnForm& PositionForm(JointType type) {
  return FormOf(JointQuantity::kPosition, type);
}

/// Factor to SI of a coupling's ratio in files, which is in units of its joint's position column
/// per unit of the other joint's.
double CouplingRatioToSI(const Robot& robot, const JointCoupling& coupling);

/// @param joint  0-based
std::string JointColumnName(JointQuantity quantity, JointType type, int joint);

/// A joint column parsed from its name.
struct JointColumn {
  const JointColumnForm* form = nullptr;
  int joint = 0;  ///< 0-based; may exceed the number of joints of the cell
};

/// Parses a column name. Does not allocate.
/// @return  nullopt if it is not the name of a joint column
std::optional<JointColumn> JointColumnFromName(std::string_view name);

/// True if the name was probably meant as a joint column: a known prefix followed by a digit.
bool ResemblesJointColumn(std::string_view name);

}  // namespace plumbline::model
