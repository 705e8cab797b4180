// Inputs of the model beside the joints: their values at the rows, what was measured of them, and
// how far a row lies beyond that.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

/// Inputs along which the error of a prediction grows, beside the posture.
enum class Input { kTorque, kPayload, kTemperature, kTime };
inline constexpr int kInputs = 4;

/// Squared distances beyond what was measured, in units of the measured ranges; see InputRanges.
using BeyondRanges = Eigen::Array<double, kInputs, 1>;

/// Values of the inputs at one row. What is absent was not recorded.
struct RowInputs {
  model::JointVector tau;  ///< gravity torques [N m] or forces [N]
  std::optional<double> payload_kg, temp_C, t_s;
};

/// Units of distance. A torque is counted in ranges of that joint, at least a tenth of the largest
/// range of any joint, times the joint's lever over the root of the sum of squares of all levers,
/// so that the sum of squares over the joints is a displacement of the tip; a payload in ranges, 0
/// kg included, or in mean gaps between several measured loads; a temperature in ranges of at least
/// 5 K; a time in time spans.
struct InputUnits {
  std::vector<double> per_Nm{};  ///< of each joint; 0: its torque is not known
  double per_kg = 1, per_K = 1, per_s = 1;
};

/// Inputs of every row, under the loads and frames of a model.
struct InputsOfRows {
  PerRow<RowInputs> rows;
  InputUnits units;
};

/// @param levers  of each joint, as a share; 0: its torque is not known
InputUnits UnitsOf(const PerRow<RowInputs>& inputs, const FitRows& rows,
                   const std::vector<double>& levers);

/// @param weights  of the robust fit: rejected rows do not count for the units
InputsOfRows InputsOf(const Dataset& data, const Model& model, const PerRow<double>& weights);

/// What some rows show of the inputs. Torques include 0, and their range leaves out the two largest
/// and the two smallest of at least five values: what one or two poses show does not determine how
/// a joint yields.
class InputRanges {
 public:
  /// @param rows  those that determine the ranges
  InputRanges(const InputsOfRows& inputs, const FitRows& rows);

  BeyondRanges Beyond(const RowInputs& row) const;
  /// States the ranges in a domain; torques only with their growth, since a range that leaves out
  /// rows is no limit.
  /// @param growth_m   standard deviation per axis and unit, one per input; absent if not known
  /// @param with_time  whether the error grows with time
  void StateIn(model::Domain& domain, const std::optional<BeyondRanges>& growth_m,
               bool with_time) const;

 private:
  InputUnits units_;
  std::vector<model::Interval> torques_;  ///< of each joint
  std::optional<model::MeasuredRange> payload_kg_, temp_C_, t_s_;
};

}  // namespace plumbline::measure
