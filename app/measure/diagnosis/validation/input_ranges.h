// Inputs of the model beside the joints: their values at the rows, what was measured of them, and
// how far a row lies beyond that.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

/// Inputs along which the error of a prediction grows, beside the distance of the posture. kRange:
/// the joints beyond their own measured ranges, where the laws of a joint are extrapolated.
enum class ModelInput { kRange, kTorque, kPayload, kTemperature, kTime };
inline constexpr int kInputs = 5;

/// Squared distances beyond what was measured, in the units of InputUnits.
using BeyondRanges = Eigen::Array<double, kInputs, 1>;

/// Values of the inputs at one row. What is absent was not recorded.
struct RowInputs {
  model::JointVector tau;              ///< gravity torques [N m] or forces [N]
  std::optional<ClusterIndex> pose{};  ///< visits of one pose share it; absent: a pose of its own
  std::optional<double> payload_kg, temp_C, t_s;
  model::JointVector q{};  ///< [rad] or [m]
};

/// Units of distance. A joint is counted in radians, times its lever over the longest
/// (PoseDistance::lever); a torque in ranges of that joint, at least a tenth of the largest range
/// of any joint, times the joint's lever over the root of the sum of squares of all levers, so that
/// the sum of squares over the joints is a displacement of the tip; a payload in mean gaps between
/// several measured loads, or in the only load; a temperature in ranges of at least 5 K; a time in
/// time spans.
struct InputUnits {
  std::vector<double> per_Nm{};  ///< of each joint; 0: its torque is not known
  double per_kg = 0;             ///< 0: all loads are 0 kg, and show nothing of others
  double per_K = 1, per_s = 1;
  std::vector<double> per_rad{};  ///< of each joint; per metre of a prismatic one
  std::vector<bool> turns{};      ///< of each joint: not prismatic
};

/// Inputs of every row, under the loads and frames of a model.
struct InputsOfRows {
  PerRow<RowInputs> rows;
  InputUnits units;
  /// Of each joint, the largest displacement of the tip per unit of torque by its compliance,
  /// declared or by the effects of the model [m/(N m)].
  std::vector<double> yield{};
};

/// @param levers  of each joint, as a share; 0: its torque is not known
InputUnits UnitsOf(const PerRow<RowInputs>& inputs, const FitRows& rows,
                   const std::vector<double>& levers);

/// @param weights  of the robust fit: rejected rows do not count for the units
InputsOfRows InputsOf(const Dataset& data, const Model& model, const PerRow<double>& weights);

/// What some rows show of the inputs. Torques include 0, and their range leaves out the two largest
/// and the two smallest of at least five poses: what one or two poses show does not determine how a
/// joint yields.
class InputRanges {
 public:
  /// @param rows  those that determine the ranges
  InputRanges(const InputsOfRows& inputs, const FitRows& rows);

  BeyondRanges Beyond(const RowInputs& row) const;
  /// Growths of the error.
  struct Growth {
    BeyondRanges per_unit_m;  ///< standard deviation per axis and unit, one per input
    /// Of a joint that the rows load in one direction only, at least, per unit [m]: no row tests
    /// how it yields in the other, so that its own deflection, too, may be wrong there as a whole.
    double untested_m = 0;
    bool with_time = false;  ///< whether the error grows with time
  };
  /// States the ranges in a domain. Without a growth, that of a torque is all that the rows had,
  /// since it is a limit then.
  void StateIn(model::Domain& domain, const std::optional<Growth>& growth) const;

 private:
  InputUnits units_;
  std::vector<double> yield_;
  std::vector<model::Interval> joints_, torques_, all_torques_;  ///< of each joint
  std::optional<model::MeasuredRange> payload_kg_, temp_C_, t_s_;
};

}  // namespace plumbline::measure
