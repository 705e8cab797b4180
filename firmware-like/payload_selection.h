// Selection of the payload that the robot carries: as reported, by tool number, or fixed.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "firmware-like/loads/gravity.h"
#include "firmware-like/model/robot_state.h"

namespace plumbline {

/// Source of the payload's mass and centre of gravity.
struct PayloadPolicy {
  enum class Source { kRobot, kTable, kFixed };
  struct ToolLoad {
    int number = 0;
    double mass_kg = 0;
    std::optional<Vec3> cog_F;  ///< centre of gravity in F [m]; if absent, that of the cell
  };
  Source source = Source::kRobot;
  ToolLoad fixed;               ///< for kFixed
  std::vector<ToolLoad> table;  ///< for kTable, selected by the controller's tool number
};

/// A number that the controller reports, or should report, and that the cell does not declare.
struct UndeclaredNumber {
  enum class Kind : std::uint8_t { kNone, kTool, kItem };
  Kind kind = Kind::kNone;
  std::optional<int> number{};  ///< absent if the controller reports none
  bool operator==(const UndeclaredNumber&) const = default;
};

/// The payload of the present cycle. Select() does not allocate.
class PayloadSelector {
 public:
  /// @param declared_cog_F  centre of gravity that the cell declares, in F [m]
  PayloadSelector(PayloadPolicy policy, const std::optional<Vec3>& declared_cog_F);

  /// Selects the payload by the policy, with the tool and the payload item that the controller
  /// reports.
  /// @param robot  the latest reading; nullptr if it is not trusted
  void Select(const model::RobotState* robot, const model::CellModel& cell);

  /// nullopt if mass or centre of gravity is unknown or implausible, or if the cell requires a tool
  /// or payload item that is not known, or not declared.
  const std::optional<loads::Payload>& present() const { return present_; }

  /// The number because of which there is no payload; kNone if there is another reason or none.
  const UndeclaredNumber& undeclared() const { return undeclared_; }

  /// The payload for a point or command, which may state its own mass. That mass is assumed to act
  /// at the centre of gravity declared by the cell or, if there is none, at that of the present
  /// load. Tool and payload item are those that the controller reports.
  std::optional<loads::Payload> WithMass(const std::optional<double>& own_mass_kg,
                                         const model::CellModel& cell) const;

 private:
  UndeclaredNumber UndeclaredBy(const model::CellModel& cell) const;
  std::optional<loads::Payload> WithToolAndItem(std::optional<loads::Payload> payload,
                                                const model::CellModel& cell) const;

  PayloadPolicy policy_;
  std::optional<Vec3> declared_cog_F_;
  std::optional<Vec3> cog_F_;  ///< of the present load [m]
  /// As the controller reports them; absent too if it is not trusted.
  std::optional<int> tool_number_, item_number_;
  UndeclaredNumber undeclared_;
  std::optional<loads::Payload> present_;
};

}  // namespace plumbline
