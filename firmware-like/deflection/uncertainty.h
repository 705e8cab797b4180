// Covariance of the predicted tip, and the domain in which it holds.
#pragma once

#include <vector>

#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::deflection {

using statistics::RadiusHolding95Percent;

/// Covariance of the tip in B [m^2] due to the resolution of the joint registers: uniform within a
/// step, variance resolution^2 / 12.
/// @param resolution  of each joint [rad]
Mat3 ReadingCovariance(const LoadedArm& arm, const LoadedState& state, double resolution);

/// Scratch memory for EffectCovariance, sized for the effects of one arm.
struct EffectScratch {
  explicit EffectScratch(const LoadedArm& arm);
  std::vector<effects::Dual> values;
  /// d(influence)/d(parameter), one column per parameter of all effects in turn.
  Eigen::Matrix<double, effects::Influence<double>::kSize, Eigen::Dynamic> slopes;
  Eigen::Matrix<double, 3, Eigen::Dynamic> columns, weighted;
};

/// Covariance of the measured tip position in W [m^2] due to the parameter covariances of the
/// cell's effects:
///   C = share^2 sum_e J_e Sigma_e J_e^T
/// with J_e the derivative of the tip with respect to the parameters of effect e, and share the
/// part of the effects that applies at this distance from the fitted poses (loaded_arm.h). An
/// effect without a covariance contributes nothing. Zero if the deflected posture does not
/// converge.
Mat3 EffectCovariance(const LoadedArm& arm, const model::JointVector& q,
                      const loads::Payload& payload, const effects::Conditions& conditions);
/// The same without allocation.
Mat3 EffectCovariance(const LoadedArm& arm, const model::JointVector& q,
                      const loads::Payload& payload, const effects::Conditions& conditions,
                      EffectScratch& scratch);

/// Where and under what conditions the tip is predicted. What is absent or empty is unknown.
struct OperatingPoint {
  model::JointVector q;  ///< commanded [rad] or [m]
  std::optional<double> payload_kg{};
  std::optional<double> temp_C{};
  std::optional<double> t_s{};
  int tool = 0;              ///< index, see CellModel::ToolAt
  int item = 0;              ///< number of the payload item, or 0 for none
  model::JointVector tau{};  ///< gravity torques [N m], or forces [N] of prismatic joints
};

/// A load may exceed the largest one of the fitted rows by this share.
inline constexpr double kLoadTolerance = 0.02;

/// True if q, payload or temperature lie outside the domain of the model's fit, if a combination of
/// joints that hardly varied in the fitted rows leaves its range, if the load of a compliant joint
/// leaves its range (kLoadTolerance), or if the time lies outside the fitted time span
/// of a time-dependent effect, or no fitted row had this tool or payload item. Without a domain:
/// true if q is outside the joint limits.
bool OutsideDomain(const model::CellModel& cell, const OperatingPoint& at);

/// An input that lies outside the domain.
struct DomainExit {
  enum class Input {
    kJoint,             ///< its position [rad] or [m]
    kJointCombination,  ///< its sum [rad]
    kJointLoad,         ///< of a compliant joint [N m] or [N]
    kPayload,           ///< [kg]
    kPayloadLevel,      ///< between the two measured loads, `range` [kg]
    kTemperature,       ///< [degC]
    kTime,              ///< of an effect [s]
    kTool,
    kItem,
  };
  Input input = Input::kJoint;
  std::size_t index = 0;  ///< joint, combination or effect, from 0
  double value = 0;
  model::Interval range{};  ///< of the fitted rows; of a joint without a domain, its limits
};

/// Every input that lies outside the domain; empty if OutsideDomain() is false.
std::vector<DomainExit> DomainExits(const model::CellModel& cell, const OperatingPoint& at);

/// False if the cell has a domain and no fitted row had this tool. @param tool  index
bool ToolCovered(const model::CellModel& cell, int tool);

/// False if the cell has a domain and no fitted row carried this payload item, or, for an item
/// other than 0, if the domain does not name the items of the fitted rows. @param item  number; 0:
/// none
bool ItemCovered(const model::CellModel& cell, int item);

}  // namespace plumbline::deflection
