// Corrector of a dense sequence of poses, each solved from the one before.
#pragma once

#include <array>
#include <optional>
#include <string>

#include "firmware-like/correction/cell_corrector.h"

namespace plumbline::programs {

/// One row of a path: joints, or the pose of the tool's tip in the robot's base.
struct PathRow {
  std::optional<model::JointVector> q;  ///< [rad] or [m]; with a pose: near which it is reached
  std::optional<Pose> X_BT;
  loads::Payload payload;
  std::optional<double> temp_C, t_s;
};

struct CorrectedRow {
  correction::Correction correction;
  /// The command: of the tip without load, in B.
  Pose X_BT_command;
  std::string problem;    ///< not empty: why there is no correction
  bool searched = false;  ///< the posture was searched, because the row before did not lead to it
};

/// Not thread-safe. The rows are those of one motion: the first needs joints, or its posture must
/// be the only one.
///
/// The radius is computed where the arm has moved by more than kRadiusMove since it was last
/// computed, or the load or the temperature changes; between, it is that of a posture at most that
/// far away, over which it changes by a few percent.
class PathCorrector {
 public:
  static constexpr double kRadiusMove = 0.02;  // [rad] or [m] of any joint

  struct Options {
    bool radius = true;
    double utc_s = 0;                          ///< for rows without t_s
    std::optional<model::JointVector> near_q;  ///< posture near which the first row is
  };

  PathCorrector(const model::CellModel& cell, const correction::CorrectionLimits& limits,
                Options options);

  void Correct(const PathRow& row, CorrectedRow& corrected);

  const deflection::LoadedArm& arm() const { return corrector_.arm(); }

 private:
  model::JointVector Extrapolated() const;
  const model::JointVector& SagNear(const PathRow& row, const effects::Conditions& conditions,
                                    const model::JointVector& q);
  void Remember(const model::JointVector& actual, const model::JointVector& sag);
  bool FindPosture(const PathRow& row, const Pose& X_BT, CorrectedRow& corrected,
                   model::JointVector& q) const;
  void SetApproach(const model::JointVector& q, effects::Conditions& conditions);
  void StateRadius(const PathRow& row, const effects::Conditions& conditions,
                   CorrectedRow& corrected);

  correction::CellCorrector corrector_;
  Options options_;
  bool reads_approach_;
  std::optional<model::JointVector> last_;  ///< nominal or, without approach, commanded joints
  /// Actual joints of the last three rows, latest first: those that the solver iterates on.
  std::array<std::optional<model::JointVector>, 3> actual_;
  model::JointVector sag_;  ///< actual minus commanded, of the last row
  model::JointVector approach_;
  struct Stated {
    model::JointVector q;
    loads::Payload payload;
    std::optional<double> temp_C;
    double radius_m = 0;
    model::RadiusBasis basis = model::RadiusBasis::kUnknown;
    bool extrapolated = false;
  };
  std::optional<Stated> stated_;
};

/// Whether effects of the cell depend on how a posture was approached.
bool ReadsApproach(const deflection::LoadedArm& arm);

}  // namespace plumbline::programs
