// Postures to be measured first, chosen so that they identify the catalogue's effects best.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "app/measure/plan/safe_postures.h"
#include "firmware-like/result.h"

namespace plumbline::measure {

// D-optimal selection of rows.

/// Information matrix of a selection: identity (the prior) plus sum X_i^T X_i.
Eigen::MatrixXd Information(const std::vector<Eigen::MatrixXd>& rows,
                            const std::vector<int>& selected);

/// Indices of `count` different rows that maximise log det of their information: greedy, then
/// exchanges of single rows until no exchange gains, at most `passes` times through the selection.
/// @param rows  X_i, shape (numbers measured by row i, parameters); 0 <= count <= rows.size()
std::vector<int> DOptimalRows(const std::vector<Eigen::MatrixXd>& rows, int count, int passes);

/// log det of a positive definite matrix.
double LogDeterminant(const Eigen::MatrixXd& matrix);

struct PlanTask {
  int rows = 30;
  int candidates = 500;  ///< postures to choose from
  /// Artefacts of the cell that are to be touched; if empty, positions are measured.
  std::vector<std::string> artefacts;
  std::vector<double> payloads_kg;  ///< empty: without payload
  std::optional<int> tool_number;   ///< of the mounted [[tool]]; if absent, the cell's first
  std::vector<int> payload_items;   ///< numbers that can be carried, 0 for none; none if empty
  double sigma_m = 5e-5;            ///< of a measurement, if the cell declares none
  /// Speed limit of each joint [rad/s] or [m/s], for the order and the time; empty if not stated.
  model::JointVector joint_speeds;
  SafetyRules rules;
  int threads = 2;
};

struct PlannedRow {
  model::JointVector q;
  std::optional<double> payload_kg{};  ///< absent: no payloads are planned
  std::optional<int> tool_number;      ///< if the cell numbers its tools
  std::optional<int> payload_item;     ///< if the cell has payload items
  std::string artefact;                ///< empty if the position is measured
  Pose X_WT;                           ///< expected tip, without deflection
  /// The straight joint move from the previous row was found free of collisions; false for the
  /// first row, to which the robot comes from anywhere.
  bool move_checked = false;
};

/// Information of the rows on one effect: the median over its parameters of the standard deviation
/// after the measurement relative to the one before it (its plausible value); 1 if they show
/// nothing.
struct EffectDetermination {
  std::string id;
  int parameters = 0;
  double planned = 1;
  double random = 1;  ///< the same for as many random postures
};

struct MeasurementPlan {
  std::vector<PlannedRow> rows;  ///< by load, in an order with short moves (visit_order.h)
  int load_changes = 0;          ///< between rows with different payloads or payload items
  double path_share = 1;         ///< length of the path relative to that in the order of the choice
  std::optional<double> moves_s;  ///< duration of all moves; absent if no speeds were stated
  std::vector<EffectDetermination> effects;
  /// D-efficiency of the plan against random postures of the same number: the ratio of the
  /// geometric mean information about a parameter.
  double efficiency = 1;
  std::vector<std::string> excluded;  ///< effects that such rows cannot show, with the reason
  int candidates = 0;                 ///< safe postures found
};

/// D-optimal selection [Fedorov 1972]: the rows maximise
///   log det(P^-1 + sum_i X_i^T X_i)
/// with X_i the whitened derivatives of row i with respect to all parameters of the effects that
/// the rows can show, in units of their plausible values (prior P = 1), and to the nuisances (free
/// frames, unknown positions). Greedy choice, then exchanges of single rows until none gains.
/// Effects of the order of moves, of time and of speed are not planned for.
/// @return  an error if the cell has no such artefact, tool or payload item, if the position of an
///          artefact is unknown, or if too few safe postures are found
Result<MeasurementPlan> PlanMeasurements(const model::CellModel& cell, const PlanTask& task);

}  // namespace plumbline::measure
