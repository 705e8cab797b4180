#include "firmware-like/model/joint_columns.h"

#include <algorithm>
#include <charconv>

namespace plumbline::model {
namespace {

/// The joint number between prefix and "_unit", made 0-based; nullopt if the name does not match.
std::optional<int> JointIn(std::string_view name, const JointColumnForm& form) {
  if (!name.starts_with(form.prefix) || !name.ends_with(form.unit)) return std::nullopt;
  if (name.size() <= form.prefix.size() + 1 + form.unit.size()) return std::nullopt;
  const char* const begin = name.data() + form.prefix.size();
  const char* const end = name.data() + name.size() - form.unit.size() - 1;
  int number = 0;
  const auto [stop, error] = std::from_chars(begin, end, number);
  if (error != std::errc() || stop != end || *end != '_' || number < 1) return std::nullopt;
  return number - 1;
}

}  // namespace

double CouplingRatioToSI(const Robot& robot, const JointCoupling& coupling) {
  const auto to_SI = [&](int joint) { return PositionForm(robot.joints[joint].type).to_SI; };
  return to_SI(coupling.joint) / to_SI(coupling.of);
}

std::string JointColumnName(JointQuantity quantity, JointType type, int joint) {
  const JointColumnForm& form = FormOf(quantity, type);
  std::string name(form.prefix);
  name += std::to_string(joint + 1);
  name += '_';
  name += form.unit;
  return name;
}

std::optional<JointColumn> JointColumnFromName(std::string_view name) {
  for (const JointColumnForm& form : kJointColumnForms) {
    if (const std::optional<int> joint = JointIn(name, form)) return JointColumn{&form, *joint};
  }
  return std::nullopt;
}

bool ResemblesJointColumn(std::string_view name) {
  const auto opens = [name](const JointColumnForm& form) {
    const std::size_t at = form.prefix.size();
    return name.starts_with(form.prefix) && name.size() > at && name[at] >= '0' && name[at] <= '9';
  };
  return std::any_of(kJointColumnForms.begin(), kJointColumnForms.end(), opens);
}

}  // namespace plumbline::model
