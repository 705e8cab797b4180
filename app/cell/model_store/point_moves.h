// Displacement of the configured points' corrected commands between two models.
#pragma once

#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "firmware-like/machine.h"

namespace plumbline::cell {

/// One point with one load: its commanded position with each of the two models.
struct PointMove {
  int id = 0;
  std::string name;
  double payload_kg = 0;
  std::optional<int> tool_number{};  ///< if the cell has several tools
  correction::CorrectionCode code_before = correction::CorrectionCode::kPending,
                             code_after = correction::CorrectionCode::kPending;
  Vec3 before_B = Vec3::Zero(),
       after_B = Vec3::Zero();  ///< commanded positions in B [m], valid if kOk
  /// Inputs of a point in the range that the model before was fitted to, and outside that of the
  /// other; empty if there are none.
  std::string leaves_range{};

  bool Compared() const {
    return code_before == correction::CorrectionCode::kOk &&
           code_after == correction::CorrectionCode::kOk;
  }
  double Distance_m() const { return (after_B - before_B).norm(); }
};

/// A load that the robot has reported.
struct ReportedLoad {
  double mass_kg = 0;
  std::optional<Vec3> cog_F;  ///< if absent, as declared in the cell
};

/// What a model changes of the configured points.
struct PointMoves {
  std::vector<PointMove> all;      ///< in configured order; each point with each of its loads
  std::vector<std::string> notes;  ///< assumptions and limitations of these numbers
  /// The largest residual that either model explains [m]; absent if neither was fitted.
  std::optional<double> explained_m;
  std::string frame{};  ///< that the points are in, see config::PointFrameText

  /// The largest displacement; nullptr if no point can be compared.
  const PointMove* Largest() const;
};

/// A model may move a point by this multiple of the largest residual that it explains.
inline constexpr double kMovePerResidual = 3;

/// Why a person must confirm that `after` comes into force (`plumbline model apply N --force`), one
/// sentence each: a point loses its correction, moves by more than kMovePerResidual times the
/// largest residual that either model explains, or leaves the range that its model was fitted to.
/// The same for `apply`, `rollback`, a reload and an automatic application.
std::vector<std::string> Objections(const PointMoves& moves);

/// Corrects every configured point with both cells, under each load that it may be reached with:
/// its own payload_kg, otherwise that of [payload]: the fixed mass, or each tool's. If the robot
/// reports the mass, it is not known beforehand; the loads are then `reported`, no load, and the
/// limits of the range that either cell was fitted to. If the cells have several tools: with the
/// one that was mounted when the point was taught (TaughtTool), or with each. Temperatures are not
/// known here and count as absent; the time is `utc_s`.
/// @param config  supplies points, limits and [payload]; its cell is not used
/// @param before  used as CellOfPoints(), like `after`
/// @param step    progress callback, called before each point and load, which takes up to tens of
///                milliseconds
/// @param stop    if requested, the remaining points are left out
PointMoves ComputePointMoves(const MachineConfig& config, const model::CellModel& before,
                             const model::CellModel& after, double utc_s,
                             const std::vector<ReportedLoad>& reported = {},
                             const std::function<void()>& step = {},
                             const std::stop_token& stop = {});

/// A table of the displacements, the largest one, points that cannot be compared and why, and
/// notes.
/// @param configuration  path of the file that defines the points
std::string TextOf(const PointMoves& moves, const std::string& configuration);

}  // namespace plumbline::cell
