// Correction of the points of a program, each once, in the context in which the program uses it.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/programs/brand.h"
#include "app/programs/correction/number_text.h"
#include "app/programs/correction/stated_context.h"
#include "app/programs/flow/flow.h"
#include "firmware-like/correction/cell_corrector.h"
#include "firmware-like/correction/point_posture.h"

namespace plumbline::programs {

struct CorrectionSettings {
  StatedContext stated;
  EntryState entry;
  std::optional<model::JointVector> start_q;  ///< posture where a program is started
  correction::CorrectionLimits limits;
  bool joints = false;               ///< correct joint targets, too
  bool external_axes_still = false;  ///< external axes do not move the robot's base
  double offset_bound_m = 2e-5;      ///< see below
  std::optional<double> temp_C;
  double utc_s = 0;
  /// The payload under which the points were taught by hand: the target is then where the tool was,
  /// bent by that load. Absent: the target is the pose that the program states.
  std::optional<StatedPayload> taught_under;
};

/// What became of one point.
struct PointCorrection {
  std::size_t point = 0;  ///< index in Program::points
  /// Why it stays as it is, and the line that is the reason; empty: corrected.
  std::string reason;
  Place reason_place;

  // Of a corrected point:
  MotionContext context;
  Pose taught, corrected;             ///< in its base, as written in the file [m]
  Vec3 translation_B = Vec3::Zero();  ///< of the command [m]
  double rotation_rad = 0;
  double radius_m = 0;  ///< 95 %, of the loaded tool point
  model::RadiusBasis basis = model::RadiusBasis::kUnknown;
  bool extrapolated = false;
  model::JointVector q_taught, q_command;  ///< nominal and commanded joints [rad] or [m]
  double singular_value = 0;
  correction::JointDistance limit;          ///< see correction::NearestLimit()
  Vec3 target_B = Vec3::Zero();             ///< where the tool point shall be [m]
  Vec3 before_B = Vec3::Zero();             ///< where it lands with the taught numbers [m]
  Vec3 after_B = Vec3::Zero();              ///< where it lands with the numbers written [m]
  double rounding_m = 0, rounding_rad = 0;  ///< written minus exact command
  std::vector<std::string> notes;
  std::vector<Edit> edits;  ///< empty if no digit changes
};

/// Deviation of the tool point from the programmed path between the ends of one motion.
struct SegmentDeviation {
  std::size_t motion = 0;  ///< index in Flow::motions
  double length_m = 0;
  double ends_m = 0;     ///< at its ends
  double largest_m = 0;  ///< between them
  int inserted = 0;      ///< motions that were inserted
  std::string note;      ///< why it could not be refined; empty otherwise
};

struct ProgramCorrection {
  Flow flow;
  std::vector<PointCorrection> points;  ///< one for each point of the program, in order
  std::vector<SegmentDeviation> segments;
  std::vector<Edit> insertions;  ///< of intermediate motions
};

/// Corrects the points of a program.
///
/// A point is corrected if all its uses are motions whose context is known and agrees, and gets one
/// reason otherwise. Its target is the programmed pose of the tool point,
///   X_BP = X_BU X_U X_UP X_P        X_U, X_P: constant offsets in the base and in the tool
/// and the corrected point is the one from which the same offsets lead to the command that brings
/// the loaded tool there. A point that is used with several offsets has the correction of the
/// first, if those of the others differ by no more than CorrectionSettings::offset_bound_m.
///
/// Effects that depend on the direction of approach get it from the motion before, if that is the
/// same at all uses; otherwise they add nothing, and the point has a note.
class ProgramCorrector {
 public:
  /// Called with the share that is done, 0..1; false ends the correction.
  using ProgressFunction = std::function<bool(double)>;

  /// The arguments must outlive the object.
  /// @param cell  as deflection::CellOfPoints returns it
  ProgramCorrector(const Brand& brand, const Program& program, const model::CellModel& cell,
                   const CorrectionSettings& settings);
  ~ProgramCorrector();

  ProgramCorrection Correct(const ProgressFunction& progress = {});

  /// Compares the loaded tool's path between the corrected points with the programmed one, for
  /// linear and circular motions whose start is known, and with a bound inserts linear motions
  /// until the deviation is below it.
  void CheckSegments(const std::optional<double>& bound_m, ProgramCorrection& correction);

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace plumbline::programs
