// How far the corrected commands of the configured points move from one model to another.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "firmware-like/machine.h"

namespace plumbline {

/// One point with one load: where it is commanded to by either model.
struct PointMove {
  int id = 0;
  std::string name;
  double payload_kg = 0;
  CorrectionCode code_before = CorrectionCode::kPending, code_after = CorrectionCode::kPending;
  Vec3 before_B = Vec3::Zero(),
       after_B = Vec3::Zero();  ///< commanded positions in B [m], where kOk

  bool Compared() const {
    return code_before == CorrectionCode::kOk && code_after == CorrectionCode::kOk;
  }
  double Distance_m() const { return (after_B - before_B).norm(); }
};

/// What the robot is known to have reported as its load.
struct ReportedLoad {
  double mass_kg = 0;
  std::optional<Vec3> cog_F;  ///< absent: where the cell declares it
};

struct PointMoves {
  std::vector<PointMove> all;      ///< in configured order; a point with each load in question
  std::vector<std::string> notes;  ///< what these numbers rest on, and what they leave out

  /// The farthest; nullptr where no point can be compared.
  const PointMove* Largest() const;
};

/// Corrects every configured point by both cells, each with the loads it is to be reached with: its
/// own payload_kg, else what [payload] says: the fixed mass, or each tool's. Where the robot
/// reports the mass, which nobody knows beforehand: `reported`, nothing carried, and the ends of
/// what either cell was fitted to. Temperatures are not known here and count as absent; times are
/// `utc_s`.
/// @param config  its points, limits and [payload]; its cell is not read
/// @param step    called before each point with each load, which takes up to tens of milliseconds
PointMoves MovesOfPoints(const MachineConfig& config, const CellModel& before,
                         const CellModel& after, double utc_s,
                         const std::vector<ReportedLoad>& reported = {},
                         const std::function<void()>& step = {});

/// A table of the moves, the largest, the points that cannot be compared and why, and the notes.
/// @param configuration  the file that the points are from
std::string TextOf(const PointMoves& moves, const std::string& configuration);

}  // namespace plumbline
