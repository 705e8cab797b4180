// Plausibility checks of a cell against the arm's own size and masses: wrong units, another arm.
#pragma once

#include <optional>
#include <vector>

#include "app/base/config/toml_reader.h"
#include "firmware-like/machine.h"

namespace plumbline::config {

/// Size of an arm, sampled over postures spread across its joint ranges.
struct ArmSize {
  double reach_m = 0;  ///< largest distance of the flange from the axis with the largest torque
  /// Largest gravity torque of the links alone, per joint [N m]; absent if a link mass is unknown
  /// or gravity is zero.
  std::optional<model::JointVector> link_torque;

  /// Estimated rated payload of an arm of this size [kg]. With link masses: on real arms the rated
  /// payload causes 43 to 59 % of the largest gravity torque about joint 2, so it is close to
  /// T_links / (g reach). Without them: the heaviest rated payload of arms with this reach.
  double RatedLoad_kg() const;
};

ArmSize ArmSizeOf(const model::Robot& robot);

/// Warns about lengths and centres of mass of single joints that look like metres, link masses that
/// no arm of this reach has, and compliances that are probably in the wrong unit.
/// @param joints  the [[robot.joint]] tables, one for each of robot.joints
void WarnAboutUnlikelyParts(const std::vector<TomlTable>& joints, const model::Robot& robot);

/// Warns about a tool several times as long as the arm.
void WarnAboutLongTool(const TomlTable& root, const model::CellModel& cell);

/// Warns about configured payloads that, together with the tool, exceed twice the rated payload.
void WarnAboutHeavyPayloads(const TomlTable& root, const MachineConfig& config);

}  // namespace plumbline::config
