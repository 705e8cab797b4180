#include "app/base/config/posture_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "app/base/config/limits.h"
#include "app/base/config/point_solutions.h"
#include "app/base/config/toml_reader.h"
#include "app/base/config/unlikely_values.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::config {
namespace {

// Angles as written in a file, whose unit is still to be determined: degrees, or radians by
// mistake.

/// Range of angles that are read in either unit.
constexpr NumberRange kAsWritten{-100000, 100000};

/// Roll, pitch and yaw as written in the file.
struct WrittenRotation {
  std::vector<double> angles = {0, 0, 0};

  /// Zero if the key is missing.
  static WrittenRotation Of(const TomlTable& table, std::string_view key);
  Mat3 Rotation(bool radians) const;
  /// What to write if the angles are radians: "[90, 0, -45]".
  std::string InDegrees() const;
};

/// True if the angles, read as radians, are within one turn, and are not all zero.
bool CouldBeRadians(const std::vector<double>& angles) {
  constexpr double kMaxAngle_rad = 2 * std::numbers::pi + 1e-3;
  const auto small = [](double angle) { return std::abs(angle) <= kMaxAngle_rad; };
  const auto zero = [](double angle) { return angle == 0; };
  return std::all_of(angles.begin(), angles.end(), small) &&
         !std::all_of(angles.begin(), angles.end(), zero);
}

WrittenRotation WrittenRotation::Of(const TomlTable& table, std::string_view key) {
  return {table.Numbers(key, kAsWritten, 3).value_or(std::vector<double>{0, 0, 0})};
}

Mat3 WrittenRotation::Rotation(bool radians) const {
  const Vec3 rpy(angles[0], angles[1], angles[2]);
  return RotationFromRollPitchYaw(radians ? rpy : Vec3(kRadPerDeg * rpy));
}

std::string WrittenRotation::InDegrees() const {
  std::string text;
  for (const double angle : angles) {
    text += fmt::format("{}{:.5g}", text.empty() ? "" : ", ", angle / kRadPerDeg);
  }
  return "[" + text + "]";
}

/// Bounds the run time: searching for an unreachable point takes milliseconds, and more failures
/// than these have a common cause.
constexpr std::size_t kMaxProblems = 50;

/// A posture this close to near_deg proves that the angles were interpreted as intended [rad] or
/// [m]. The bound for "another posture" is too wide for that: a small rotation misread as a large
/// one can end up within it by chance.
constexpr double kProof = 10 * kRadPerDeg;

/// Bit mask of the angles that are interpreted as radians.
enum Interpretation {
  kNearInRad = 1,
  kPointInRad = 2,
  kFrameInRad = 4,
  kBaseInRad = 8,
  kInterpretations = 16
};

Vec3 PlaceOf(const TomlTable& table) {
  return table.Vector3("xyz_mm", kPlaceRange).value_or(Vec3::Zero());
}

class PostureCheck {
 public:
  PostureCheck(const TomlTable& root, const std::optional<TomlTable>& robot,
               const MachineConfig& config)
      : root_(root), robot_(robot), config_(config), machine_(config) {
    for (const TomlTable& table : root.Tables("frame")) {
      frames_.push_back({table, table.String("name").value_or(""), PlaceOf(table),
                         WrittenRotation::Of(table, "rpy_deg")});
    }
    if (robot_) base_ = WrittenRotation::Of(*robot_, "base_rpy_deg");
  }

  void Run(std::size_t max_points) {
    const std::vector<TomlTable> tables = root_.Tables("point");
    for (std::size_t k = 0; k < tables.size() && k < config_.points.size(); ++k) {
      if (k == max_points) {
        root_.AddWarning("point", fmt::format("only the postures of the first {} points were "
                                              "checked; run `plumbline check` for the other {}",
                                              max_points, config_.points.size() - max_points));
        return;
      }
      if (problems_ >= kMaxProblems) {
        root_.AddWarning("point", fmt::format("more than {} points are not reached as they were "
                                              "taught; the points after id {} were not checked. "
                                              "Fix these first, then check again",
                                              kMaxProblems, config_.points[k - 1].id));
        return;
      }
      CheckPoint(tables[k], config_.points[k]);
    }
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      if (!confirmed_.contains(k)) WarnAboutRadians(frames_[k].table, "rpy_deg");
    }
  }

 private:
  struct Frame {
    TomlTable table;
    std::string name;
    Vec3 p_WO;
    WrittenRotation rotation;
  };

  /// Solution of a point under one interpretation of its angles.
  struct Outcome {
    correction::Correction correction;
    correction::JointDistance farthest;  ///< largest joint distance of the solution from near_deg
    bool reached = false;
    bool as_taught = false;  ///< reached, and close to near_deg if that is given
  };

  void CheckPoint(const TomlTable& table, const correction::AssemblyPoint& point) {
    const std::vector<PointLoad> loads = LoadsOf(config_, point);
    const auto known = std::find_if(loads.begin(), loads.end(),
                                    [](const PointLoad& load) { return load.payload.has_value(); });
    // These two have warnings of their own.
    if (known == loads.end()) return;
    if (IsPointInMetres(PlaceOf(table))) return;
    const std::size_t frame = FrameOf(table);
    const Outcome outcome =
        Solve(machine_, point, *known->payload, correction::BranchSearch::kThorough);
    if (outcome.correction.code == correction::CorrectionCode::kTorquesUnknown)
      return;  // concerns all points
    if (outcome.as_taught) {
      if (point.near_q) {
        confirmed_.insert(frame);
      } else if (!point.orientation_free) {
        WarnAboutRadians(table, "rpy_deg");  // the intended posture is unknown
      }
      return WarnAboutOtherLoads(table, point, loads, outcome.correction);
    }
    ++problems_;
    const int in_radians = FindInterpretation(table, point, frame, *known->payload, outcome);
    if (in_radians != 0) return WarnAboutRadiansProven(table, point, frame, in_radians, outcome);
    WarnAboutRadians(table, "rpy_deg");
    WarnAboutRadians(table, "near_deg");
    if (outcome.reached) {
      WarnAboutPosture(table, point, outcome);
    } else {
      WarnAboutFailure(table, point, known->name, outcome.correction);
    }
  }

  std::size_t FrameOf(const TomlTable& table) const {
    const std::string name = table.String("frame").value_or("measurement");
    const auto found = std::find_if(frames_.begin(), frames_.end(),
                                    [&](const Frame& frame) { return frame.name == name; });
    return static_cast<std::size_t>(found - frames_.begin());
  }

  /// Solves with increasing search effort until the solution is close enough to near_deg.
  static Outcome Solve(Machine& machine, const correction::AssemblyPoint& point,
                       const loads::Payload& payload, correction::BranchSearch hardest) {
    const model::JointVector seed = SeedOf(machine.chain(), point);
    Outcome outcome;
    for (const correction::BranchSearch search :
         {correction::BranchSearch::kNone, correction::BranchSearch::kBrief,
          correction::BranchSearch::kThorough}) {
      outcome.correction = machine.Preview(point, payload, seed, search);
      outcome.reached = outcome.correction.code == correction::CorrectionCode::kOk;
      if (point.near_q && outcome.reached) {
        outcome.farthest =
            correction::FarthestFromTaught(machine.chain(), *point.near_q, outcome.correction.q);
      }
      outcome.as_taught =
          outcome.reached && !correction::IsOtherPosture(machine.chain(), outcome.farthest);
      if (outcome.as_taught || search == hardest) break;
    }
    return outcome;
  }

  /// The smallest set of angles that, interpreted as radians, lets the arm reach the point as it
  /// was taught; 0 if there is none.
  int FindInterpretation(const TomlTable& table, const correction::AssemblyPoint& point,
                         std::size_t frame, const loads::Payload& payload,
                         const Outcome& as_written) {
    const WrittenRotation rotation = WrittenRotation::Of(table, "rpy_deg");
    const bool framed = frame < frames_.size();
    const bool in_base = table.String("frame").value_or("") == "base";
    int possible = 0;
    if (NearInRadians(table)) possible |= kNearInRad;
    if (!point.orientation_free && CouldBeRadians(rotation.angles)) possible |= kPointInRad;
    if (framed && CouldBeRadians(frames_[frame].rotation.angles)) possible |= kFrameInRad;
    if (robot_ && !in_base && CouldBeRadians(base_.angles)) possible |= kBaseInRad;
    if (!point.near_q) {  // reachability alone is weak evidence: the numbers must look like radians
      if (!LookLikeRadians(rotation.angles)) possible &= ~kPointInRad;
      if (framed && !LookLikeRadians(frames_[frame].rotation.angles)) possible &= ~kFrameInRad;
      if (!LookLikeRadians(base_.angles)) possible &= ~kBaseInRad;
    }
    for (int count = 1; count <= std::popcount(static_cast<unsigned>(possible)); ++count) {
      for (int in_radians = 1; in_radians < kInterpretations; ++in_radians) {
        if ((in_radians & ~possible) != 0) continue;
        if (std::popcount(static_cast<unsigned>(in_radians)) != count) continue;
        // Without near_deg, a point that is reached as written gives no evidence.
        if (as_written.reached && !point.near_q) continue;
        if (Explains(table, point, frame, payload, in_radians)) return in_radians;
      }
    }
    return 0;
  }

  bool Explains(const TomlTable& table, correction::AssemblyPoint point, std::size_t frame,
                const loads::Payload& payload, int in_radians) {
    if ((in_radians & kNearInRad) != 0) point.near_q = NearInRadians(table);
    Pose X_WB = config_.cell.robot.X_WB;
    if ((in_radians & kBaseInRad) != 0) X_WB.R = base_.Rotation(true);
    const Pose X_OP = {
        WrittenRotation::Of(table, "rpy_deg").Rotation((in_radians & kPointInRad) != 0),
        PlaceOf(table)};
    if (frame < frames_.size()) {
      const Frame& of = frames_[frame];
      point.X_WP = Pose{of.rotation.Rotation((in_radians & kFrameInRad) != 0), of.p_WO} * X_OP;
    } else if (table.String("frame").value_or("") == "base") {
      point.X_WP = X_WB * X_OP;
    } else {
      point.X_WP = X_OP;
    }
    if ((in_radians & kBaseInRad) == 0) return Proves(machine_, point, payload);
    MachineConfig other = config_;
    other.cell.robot.X_WB = X_WB;
    Machine machine(other);
    return Proves(machine, point, payload);
  }

  static bool Proves(Machine& machine, const correction::AssemblyPoint& point,
                     const loads::Payload& payload) {
    const Outcome outcome = Solve(machine, point, payload, correction::BranchSearch::kBrief);
    return outcome.as_taught && outcome.farthest.distance <= kProof;
  }

  /// near_deg interpreted as radians, in SI; nullopt if that is impossible.
  std::optional<model::JointVector> NearInRadians(const TomlTable& table) const {
    const auto values = table.Numbers("near_deg", kAsWritten);
    const kinematics::Chain& chain = machine_.chain();
    if (!values || static_cast<int>(values->size()) != chain.size()) return std::nullopt;
    std::vector<double> angles;
    model::JointVector q(chain.size());
    for (int i = 0; i < chain.size(); ++i) {
      const double value = (*values)[static_cast<std::size_t>(i)];
      const bool prismatic = chain.type(i) == model::JointType::kPrismatic;
      q[i] = prismatic ? value * kMetrePerMm : value;
      if (!prismatic) angles.push_back(value);
    }
    if (!CouldBeRadians(angles) || !chain.WithinLimits(q)) return std::nullopt;
    return q;
  }

  double InFileUnit(int joint, double value) const {
    return value / model::PositionForm(machine_.chain().type(joint)).to_SI;
  }
  std::string_view UnitOf(int joint) const {
    return model::PositionForm(machine_.chain().type(joint)).unit;
  }
  std::string JointsText(const model::JointVector& q) const {
    std::string text;
    for (int i = 0; i < q.size(); ++i) {
      text += fmt::format("{}{:.1f}", i == 0 ? "" : ", ", InFileUnit(i, q[i]));
    }
    return "[" + text + "]";
  }

  /// "the nearest posture that reaches it is 90 deg from near_deg on q4".
  std::string Problem(const Outcome& outcome) const {
    if (!outcome.reached) {
      return std::string("no corrected point: ") + Describe(outcome.correction.code);
    }
    return fmt::format("the nearest posture that reaches it is {:.0f} {} from near_deg on q{}",
                       InFileUnit(outcome.farthest.joint, outcome.farthest.distance),
                       UnitOf(outcome.farthest.joint), outcome.farthest.joint + 1);
  }

  void WarnAboutRadiansProven(const TomlTable& table, const correction::AssemblyPoint& point,
                              std::size_t frame, int in_radians, const Outcome& as_written) {
    const std::string with = std::popcount(static_cast<unsigned>(in_radians)) > 1
                                 ? " (together with the other keys reported for this point)"
                                 : "";
    const std::string taught = point.near_q ? " in the posture of near_deg" : "";
    const auto warn = [&](const TomlTable& of, const char* key, const std::string& degrees) {
      of.AddWarning(key,
                    fmt::format("is probably in radians: read as radians{}, the arm reaches point "
                                "{}{}; read as degrees, {}. Write {}",
                                with, point.id, taught, Problem(as_written), degrees));
    };
    if ((in_radians & kNearInRad) != 0) warn(table, "near_deg", JointsText(*NearInRadians(table)));
    if ((in_radians & kPointInRad) != 0) {
      warn(table, "rpy_deg", WrittenRotation::Of(table, "rpy_deg").InDegrees());
    }
    if ((in_radians & kFrameInRad) != 0 && confirmed_.insert(frame).second) {
      warn(frames_[frame].table, "rpy_deg", frames_[frame].rotation.InDegrees());
    }
    // If it looks like radians, the cell reader has already warned about it.
    if ((in_radians & kBaseInRad) != 0 && !base_warned_ && !LookLikeRadians(base_.angles)) {
      base_warned_ = true;
      warn(*robot_, "base_rpy_deg", base_.InDegrees());
    }
  }

  void WarnAboutPosture(const TomlTable& table, const correction::AssemblyPoint& point,
                        const Outcome& outcome) {
    const int joint = outcome.farthest.joint;
    table.AddWarning(
        "near_deg",
        fmt::format("is not near the posture that reaches the point: q{} is {:.1f} in near_deg, "
                    "but {:.1f} {} in the nearest posture that reaches the point. The daemon will "
                    "command {}. Read the joint values from the pendant where the point was "
                    "taught, or check the point's pose and frame",
                    joint + 1, InFileUnit(joint, (*point.near_q)[joint]),
                    InFileUnit(joint, outcome.correction.q[joint]), UnitOf(joint),
                    JointsText(outcome.correction.q)));
  }

  /// Warns if the arm reaches the point with one payload but not with another.
  void WarnAboutOtherLoads(const TomlTable& table, const correction::AssemblyPoint& point,
                           const std::vector<PointLoad>& loads,
                           const correction::Correction& reached) {
    for (const PointLoad& load : loads) {
      if (!load.payload) continue;
      const correction::Correction other =
          machine_.Preview(point, *load.payload, reached.q, correction::BranchSearch::kNone);
      if (other.code == correction::CorrectionCode::kOk) continue;
      ++problems_;
      return WarnAboutFailure(table, point, load.name, other);
    }
  }

  void WarnAboutFailure(const TomlTable& table, const correction::AssemblyPoint& point,
                        const std::string& load, const correction::Correction& correction) {
    using enum correction::CorrectionCode;
    if (correction.code == kUnreachable && IsFarAway(config_.cell, point))
      return;  // see WarnAboutUnlikelyPoint
    table.AddWarning("xyz_mm", fmt::format("has no corrected point with {} ({}): {}", load,
                                           Describe(correction.code),
                                           FailureAdvice(correction, config_.limits)));
  }

  const TomlTable& root_;
  const std::optional<TomlTable>& robot_;
  const MachineConfig& config_;
  Machine machine_;
  std::vector<Frame> frames_;
  WrittenRotation base_;
  std::set<std::size_t> confirmed_;  ///< frames whose angle unit is settled by a point
  bool base_warned_ = false;
  std::size_t problems_ = 0;
};

}  // namespace

void WarnAboutUnlikelyPostures(const TomlTable& root, const std::optional<TomlTable>& robot,
                               const MachineConfig& config, std::size_t max_points) {
  if (max_points > 0 && !config.points.empty()) PostureCheck(root, robot, config).Run(max_points);
}

}  // namespace plumbline::config
