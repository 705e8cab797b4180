// Corrections of the configured points, recomputed only when their inputs change.
#pragma once

#include <optional>
#include <vector>

#include "firmware-like/correction/cell_corrector.h"
#include "firmware-like/payload_selection.h"
#include "firmware-like/snapshot.h"

namespace plumbline {

/// Inputs of the corrections of one cycle.
struct PointInputs {
  const std::vector<correction::AssemblyPoint>& points;
  const model::CellModel& cell;
  const PayloadSelector& payload;
  const model::JointVector&
      q;  ///< of the robot [rad] or [m]: seed for points without taught joints
  std::optional<double> temp_C;
  double utc_s = 0;  ///< UTC since 1970
  double now_s = 0;  ///< monotonic
  bool robot_trusted = false;
  bool lens_missing = false;  ///< a required camera has no valid lens: points are withdrawn
};

/// Inverse-kinematics branch, solution and radius of each configured point, carried from cycle to
/// cycle. A search for a branch and a radius cost more than a correction, so only a few of each are
/// computed per cycle, round-robin. Not thread-safe; Refresh() does not allocate.
class PointCorrections {
 public:
  explicit PointCorrections(std::size_t points)
      : branches_(points), radii_(points), shown_(points) {}

  /// Until SetTaughtBranch() is called for this point, it is pending and its branch is not
  /// searched.
  void MarkPending(std::size_t index) { branches_[index].search_pending = true; }
  /// @param found  the branch's joints [rad] or [m]; nullopt if none was found: Refresh() then
  ///               searches for one
  void SetTaughtBranch(std::size_t index, const std::optional<model::JointVector>& found);
  /// Starts from a solution with its radius, so that the point can be valid in the first cycle.
  void Adopt(std::size_t index, const correction::CellCorrector& corrector,
             const loads::Payload& payload, const effects::Conditions& conditions,
             const correction::Correction& solution);

  /// Solves each point whose inputs have changed, and states its radius. A point without a branch
  /// is searched for again after a pause that grows with each failure.
  /// @param results  one per point; a point that has no correction keeps its last values
  /// @return         how many results differ from the previous call, apart from `sequence`
  std::size_t Refresh(const PointInputs& inputs, correction::CellCorrector& corrector,
                      std::vector<PointResult>& results);

  /// The latest solution of a point: commanded joints [rad] or [m].
  const std::optional<model::JointVector>& solution(std::size_t index) const {
    return branches_[index].solution;
  }
  /// The payload that a valid point was solved for.
  loads::Payload SolvedPayload(std::size_t index) const;

 private:
  /// The inputs of a point's correction that may change from cycle to cycle. The robot's joints are
  /// not an input.
  struct CorrectionInputs {
    double mass_kg = 0;
    Vec3 cog_F = Vec3::Zero();
    int tool = 0;  ///< index among the cell's tools
    std::optional<double> temp_C, t_s;
    bool operator==(const CorrectionInputs&) const = default;
  };
  /// Inverse-kinematics branch of one point and the correction solved on it.
  struct Branch {
    bool search_pending = false;  ///< a background worker is searching for the branch
    std::optional<model::JointVector> solution;  ///< the latest; seed of the next
    struct Search {
      correction::CorrectionCode result =
          correction::CorrectionCode::kPending;  ///< of the latest failed search
      double pause_s = 0;                        ///< between the latest search and the next
      double next_s = 0;                         ///< earliest time of the next search
    } search;
    /// Inputs that `correction` was solved for; it is reused until they change.
    std::optional<CorrectionInputs> inputs;
    correction::Correction correction;  ///< without radius
  };
  /// Radius at a point and the inputs it was computed for; until it is refreshed, its basis is
  /// unknown.
  struct Radius {
    model::StatedRadius stated;
    std::optional<CorrectionInputs> inputs;
    bool extrapolated = false;
    model::JointVector q;  ///< commanded joints [rad] or [m]
  };

  /// What identifies the values of a result: the others change only together with these.
  struct Shown {
    bool valid = false, ever_valid = false, extrapolated = false;
    correction::CorrectionCode code = correction::CorrectionCode::kPending;
    std::uint32_t solutions = 0;
    double radius_m = 0;
    model::RadiusBasis basis = model::RadiusBasis::kUnknown;
    bool operator==(const Shown&) const = default;
  };
  static Shown ShownOf(const PointResult& result);

  static CorrectionInputs InputsOf(const correction::CellCorrector& corrector,
                                   const loads::Payload& payload,
                                   const effects::Conditions& conditions);
  /// True if the inputs are so similar that a radius computed for one also applies to the other.
  static bool SameForRadius(const CorrectionInputs& a, const CorrectionInputs& b);
  static bool Holds(const Radius& radius, const CorrectionInputs& now,
                    const correction::Correction& correction);
  /// Why a point cannot be corrected now, whatever its solution; kOk if it can.
  correction::CorrectionCode Obstacle(const PointInputs& inputs, std::size_t index,
                                      const std::optional<loads::Payload>& payload) const;
  void RefreshPoint(std::size_t index, const PointInputs& inputs,
                    const correction::CellCorrector& corrector, PointResult& result);
  /// Searches the branch nearest to the taught joints or to the robot, unless the cycle's searches
  /// are used up or the point is to pause; then the code is that of its latest search.
  void SearchBranch(std::size_t index, const PointInputs& inputs, const loads::Payload& payload,
                    const effects::Conditions& conditions,
                    const correction::CellCorrector& corrector, correction::Correction& correction);
  void RefreshRadii(const PointInputs& inputs, correction::CellCorrector& corrector,
                    std::vector<PointResult>& results);

  std::vector<Branch> branches_;  ///< one per point
  std::vector<Radius> radii_;     ///< one per point
  std::vector<Shown> shown_;      ///< of each point's latest result
  int searches_left_ = 0;         ///< in this cycle
  std::size_t next_search_ = 0;   ///< the point that may search first in the next cycle
  std::size_t next_radius_ = 0;
};

}  // namespace plumbline
