// What an arm's own size and masses say of single values of its cell: another unit, another arm's.
#pragma once

#include <optional>
#include <vector>

#include "app/config/toml_reader.h"
#include "firmware-like/machine.h"

namespace plumbline {

/// An arm's size, from postures spread over its joint ranges.
struct ArmSize {
  double reach_m = 0;  ///< largest distance of the flange from the axis that carries most
  /// Largest gravity torque of the links alone, of each joint [N m]; where their masses are known
  /// and gravity is not zero.
  std::optional<JointVector> link_torque;

  /// The load for which such an arm is made [kg]. From the masses: on real arms the rated payload
  /// makes 43 to 59 % of the largest gravity torque about joint 2, so that it is close to
  /// T_links / (g reach). Without masses, the heaviest that arms of this reach are made for.
  double RatedLoad_kg() const;
};

ArmSize ArmSizeOf(const Robot& robot);

/// Lengths and centres of mass of single joints as if in metres, link masses that no arm of this
/// reach has, compliances a thousand times too soft or too stiff.
void WarnOfUnlikelyParts(const std::vector<TomlTable>& joints, const Robot& robot);

/// A tool several times as long as the arm.
void WarnOfLongTool(const TomlTable& root, const CellModel& cell);

/// Payloads of a configuration that, with the tool, are above twice what the arm is made for.
void WarnOfHeavyPayloads(const TomlTable& root, const MachineConfig& config);

}  // namespace plumbline
