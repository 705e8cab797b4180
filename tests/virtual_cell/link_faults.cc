#include "tests/virtual_cell/link_faults.h"

#include <fmt/core.h>

#include <limits>
#include <sstream>

namespace virtual_cell {

void LinkFaults::Corrupt(ReportedState& state) const {
  if (joint >= 1 && joint <= state.q.size()) state.q[joint - 1] = joint_rad;
  if (jump) state.tip_B.x() += 10;
  if (nan) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    state.q.setConstant(none);
    state.tip_B.setConstant(none);
    state.tip_rotation.setConstant(none);
  }
}

std::string SetFault(const std::string& words, double now_s, LinkFaults& faults) {
  std::istringstream line(words);
  std::string name, value;
  line >> name >> value;
  const bool on = value == "on", off = value == "off";
  const auto number = [&value](double& result) {
    std::istringstream text(value);
    return static_cast<bool>(text >> result) && text.eof() && result >= 0;
  };
  const auto set = [&](bool& flag) -> std::string {
    if (!on && !off) return fmt::format("fault {} needs on or off", name);
    flag = on;
    return "";
  };
  if (name == "nan") return set(faults.nan);
  if (name == "jump") return set(faults.jump);
  if (name == "exception") return set(faults.exception);
  if (name == "reset" || name == "half-close") {
    (name == "reset" ? faults.reset_now : faults.half_close_now) = true;
    return "";
  }
  double amount = 0;
  if (name == "joint" && off) {
    faults.joint = 0;
    return "";
  }
  if (name == "joint" && number(amount) && amount >= 1 && (line >> faults.joint_rad)) {
    faults.joint = static_cast<int>(amount);
    return "";
  }
  if (name == "stall" && number(amount)) {
    faults.stalled_until_s = now_s + amount;
    return "";
  }
  if (name == "delay" && number(amount)) {
    faults.delay_s = amount;
    return "";
  }
  return fmt::format(
      "fault '{}' is not one of: stall SECONDS, delay SECONDS, reset, half-close, nan on|off, "
      "jump on|off, exception on|off, joint NUMBER RAD, joint off",
      words);
}

}  // namespace virtual_cell
