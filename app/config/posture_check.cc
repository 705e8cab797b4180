#include "app/config/posture_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <numbers>
#include <set>

#include "app/config/limits.h"
#include "app/config/plausibility.h"
#include "app/config/point_solutions.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline {
namespace {

constexpr double kLargestInRadians = 2 * std::numbers::pi + 1e-3;
constexpr NumberRange kAsWritten{-100000, 100000};
/// A search for a point that is not reached takes milliseconds, and a file with more such points
/// than these has one cause, not fifty.
constexpr std::size_t kMostProblems = 50;

/// So near to near_deg a posture proves that the angles were read as they were meant [rad] or [m]:
/// a small turn that is read as a large one comes within the bound of another posture by chance.
constexpr double kProof = 10 * kRadPerDeg;

/// Which angles are read as radians; bits.
enum Reading { kNearInRad = 1, kPointInRad = 2, kFrameInRad = 4, kBaseInRad = 8, kReadings = 16 };

bool CouldBeRadians(const std::vector<double>& angles) {
  const auto small = [](double angle) { return std::abs(angle) <= kLargestInRadians; };
  const auto zero = [](double angle) { return angle == 0; };
  return std::all_of(angles.begin(), angles.end(), small) &&
         !std::all_of(angles.begin(), angles.end(), zero);
}

std::string ListText(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) {
    text += fmt::format("{}{:.5g}", text.empty() ? "" : ", ", value);
  }
  return "[" + text + "]";
}

Vec3 PlaceOf(const TomlTable& table) {
  return table.Vector3("xyz_mm", kPlaceRange).value_or(Vec3::Zero());
}

/// A turn as the file has it, in the unit that is to be found out.
struct WrittenTurn {
  std::vector<double> angles = {0, 0, 0};

  static WrittenTurn Of(const TomlTable& table, std::string_view key) {
    return {table.Numbers(key, kAsWritten, 3).value_or(std::vector<double>{0, 0, 0})};
  }
  Mat3 Rotation(bool radians) const {
    const Vec3 rpy(angles[0], angles[1], angles[2]);
    return RotationFromRollPitchYaw(radians ? rpy : Vec3(kRadPerDeg * rpy));
  }
  std::string InDegrees() const {
    std::vector<double> degrees;
    for (const double angle : angles) degrees.push_back(angle / kRadPerDeg);
    return ListText(degrees);
  }
};

class PostureCheck {
 public:
  PostureCheck(const TomlTable& root, const std::optional<TomlTable>& robot,
               const MachineConfig& config)
      : root_(root), robot_(robot), config_(config), machine_(config) {
    for (const TomlTable& table : root.Tables("frame")) {
      frames_.push_back({table, table.String("name").value_or(""), PlaceOf(table),
                         WrittenTurn::Of(table, "rpy_deg")});
    }
    if (robot_) base_ = WrittenTurn::Of(*robot_, "base_rpy_deg");
  }

  void Run(std::size_t most) {
    const std::vector<TomlTable> tables = root_.Tables("point");
    for (std::size_t k = 0; k < tables.size() && k < config_.points.size(); ++k) {
      if (k == most) {
        root_.AddWarning("point", fmt::format("the postures of the first {} points were checked "
                                              "here; `plumbline check` checks the other {}, too",
                                              most, config_.points.size() - most));
        return;
      }
      if (problems_ >= kMostProblems) {
        root_.AddWarning("point", fmt::format("more than {} points are not reached as they were "
                                              "taught; those after id {} are not checked until "
                                              "these are settled",
                                              kMostProblems, config_.points[k - 1].id));
        return;
      }
      CheckPoint(tables[k], config_.points[k]);
    }
    for (std::size_t k = 0; k < frames_.size(); ++k) {
      if (!confirmed_.contains(k)) WarnOfRadians(frames_[k].table, "rpy_deg");
    }
  }

 private:
  struct Frame {
    TomlTable table;
    std::string name;
    Vec3 p_WO;
    WrittenTurn turn;
  };

  /// A point under one reading of its angles, and what came of it.
  struct Outcome {
    Correction correction;
    JointDistance farthest;  ///< of the posture found, from near_deg
    bool reached = false;
    bool as_taught = false;  ///< reached, and where near_deg is given, near it
  };

  void CheckPoint(const TomlTable& table, const AssemblyPoint& point) {
    const std::vector<PointLoad> loads = LoadsOf(config_, point);
    const auto known = std::find_if(loads.begin(), loads.end(),
                                    [](const PointLoad& load) { return load.payload.has_value(); });
    if (known == loads.end()) return;  // warned of where the centre of gravity is missing
    if (IsPointInMetres(PlaceOf(table))) return;  // likewise
    const std::size_t frame = FrameOf(table);
    const Outcome outcome = Solve(machine_, point, *known->payload, BranchSearch::kThorough);
    if (outcome.correction.code == CorrectionCode::kTorquesUnknown) return;  // of the whole cell
    if (outcome.as_taught) {
      if (point.near_q) {
        confirmed_.insert(frame);
      } else if (!point.orientation_free) {
        WarnOfRadians(table, "rpy_deg");  // nothing tells which posture was meant
      }
      return WarnOfOtherLoads(table, point, loads, outcome.correction);
    }
    ++problems_;
    const int reading = FindReading(table, point, frame, *known->payload, outcome);
    if (reading != 0) return WarnOfReading(table, point, frame, reading, outcome);
    WarnOfRadians(table, "rpy_deg");
    WarnOfRadians(table, "near_deg");
    if (outcome.reached) {
      WarnOfPosture(table, point, outcome);
    } else {
      WarnOfFailure(table, point, known->name, outcome.correction);
    }
  }

  std::size_t FrameOf(const TomlTable& table) const {
    const std::string name = table.String("frame").value_or("measurement");
    const auto found = std::find_if(frames_.begin(), frames_.end(),
                                    [&](const Frame& frame) { return frame.name == name; });
    return static_cast<std::size_t>(found - frames_.begin());
  }

  /// The nearest posture, or one of the nearest: as soon as one is near enough, the search ends.
  static Outcome Solve(Machine& machine, const AssemblyPoint& point, const Payload& payload,
                       BranchSearch hardest) {
    const JointVector seed = SeedOf(machine.chain(), point);
    Outcome outcome;
    for (const BranchSearch search :
         {BranchSearch::kNone, BranchSearch::kBrief, BranchSearch::kThorough}) {
      outcome.correction = machine.Preview(point, payload, seed, search);
      outcome.reached = outcome.correction.code == CorrectionCode::kOk;
      if (point.near_q && outcome.reached) {
        outcome.farthest = FarthestFromTaught(machine.chain(), *point.near_q, outcome.correction.q);
      }
      outcome.as_taught = outcome.reached && !IsOtherPosture(machine.chain(), outcome.farthest);
      if (outcome.as_taught || search == hardest) break;
    }
    return outcome;
  }

  /// The fewest angles that, read as radians, let the arm reach the point as it was taught; 0:
  /// none.
  int FindReading(const TomlTable& table, const AssemblyPoint& point, std::size_t frame,
                  const Payload& payload, const Outcome& as_written) {
    const WrittenTurn turn = WrittenTurn::Of(table, "rpy_deg");
    const bool framed = frame < frames_.size();
    const bool in_base = table.String("frame").value_or("") == "base";
    int possible = 0;
    if (NearInRadians(table)) possible |= kNearInRad;
    if (!point.orientation_free && CouldBeRadians(turn.angles)) possible |= kPointInRad;
    if (framed && CouldBeRadians(frames_[frame].turn.angles)) possible |= kFrameInRad;
    if (robot_ && !in_base && CouldBeRadians(base_.angles)) possible |= kBaseInRad;
    if (!point.near_q) {  // reached or not is little evidence: the number must look like radians
      if (!LookLikeRadians(turn.angles)) possible &= ~kPointInRad;
      if (framed && !LookLikeRadians(frames_[frame].turn.angles)) possible &= ~kFrameInRad;
      if (!LookLikeRadians(base_.angles)) possible &= ~kBaseInRad;
    }
    for (int count = 1; count <= std::popcount(static_cast<unsigned>(possible)); ++count) {
      for (int reading = 1; reading < kReadings; ++reading) {
        if ((reading & ~possible) != 0) continue;
        if (std::popcount(static_cast<unsigned>(reading)) != count) continue;
        // Without near_deg a point that is reached as written proves nothing.
        if (as_written.reached && !point.near_q) continue;
        if (Explains(table, point, frame, payload, reading)) return reading;
      }
    }
    return 0;
  }

  bool Explains(const TomlTable& table, AssemblyPoint point, std::size_t frame,
                const Payload& payload, int reading) {
    if ((reading & kNearInRad) != 0) point.near_q = NearInRadians(table);
    Pose X_WB = config_.cell.robot.X_WB;
    if ((reading & kBaseInRad) != 0) X_WB.R = base_.Rotation(true);
    const Pose X_OP = {WrittenTurn::Of(table, "rpy_deg").Rotation((reading & kPointInRad) != 0),
                       PlaceOf(table)};
    if (frame < frames_.size()) {
      const Frame& of = frames_[frame];
      point.X_WP = Pose{of.turn.Rotation((reading & kFrameInRad) != 0), of.p_WO} * X_OP;
    } else if (table.String("frame").value_or("") == "base") {
      point.X_WP = X_WB * X_OP;
    } else {
      point.X_WP = X_OP;
    }
    if ((reading & kBaseInRad) == 0) return Proves(machine_, point, payload);
    MachineConfig other = config_;
    other.cell.robot.X_WB = X_WB;
    Machine machine(other);
    return Proves(machine, point, payload);
  }

  static bool Proves(Machine& machine, const AssemblyPoint& point, const Payload& payload) {
    const Outcome outcome = Solve(machine, point, payload, BranchSearch::kBrief);
    return outcome.as_taught && outcome.farthest.distance <= kProof;
  }

  /// near_deg read as radians, in SI; nothing where it cannot be meant so.
  std::optional<JointVector> NearInRadians(const TomlTable& table) const {
    const auto values = table.Numbers("near_deg", kAsWritten);
    const Chain& chain = machine_.chain();
    if (!values || static_cast<int>(values->size()) != chain.size()) return std::nullopt;
    std::vector<double> angles;
    JointVector q(chain.size());
    for (int i = 0; i < chain.size(); ++i) {
      const double value = (*values)[static_cast<std::size_t>(i)];
      const bool prismatic = chain.type(i) == JointType::kPrismatic;
      q[i] = prismatic ? value * kMetrePerMm : value;
      if (!prismatic) angles.push_back(value);
    }
    if (!CouldBeRadians(angles) || !chain.WithinLimits(q)) return std::nullopt;
    return q;
  }

  double InFileUnit(int joint, double value) const {
    return value / PositionForm(machine_.chain().type(joint)).to_SI;
  }
  std::string_view UnitOf(int joint) const {
    return PositionForm(machine_.chain().type(joint)).unit;
  }
  std::string JointsText(const JointVector& q) const {
    std::string text;
    for (int i = 0; i < q.size(); ++i) {
      text += fmt::format("{}{:.1f}", i == 0 ? "" : ", ", InFileUnit(i, q[i]));
    }
    return "[" + text + "]";
  }

  /// "the posture that reaches it is 90 deg away from near_deg on q4".
  std::string WhatIsWrong(const Outcome& outcome) const {
    if (!outcome.reached) {
      return std::string("no corrected point: ") + Describe(outcome.correction.code);
    }
    return fmt::format("the posture that reaches it is {:.0f} {} away from near_deg on q{}",
                       InFileUnit(outcome.farthest.joint, outcome.farthest.distance),
                       UnitOf(outcome.farthest.joint), outcome.farthest.joint + 1);
  }

  void WarnOfReading(const TomlTable& table, const AssemblyPoint& point, std::size_t frame,
                     int reading, const Outcome& as_written) {
    const std::string with = std::popcount(static_cast<unsigned>(reading)) > 1
                                 ? " (and so the others of this list that name the point)"
                                 : "";
    const std::string taught = point.near_q ? " in the posture of near_deg" : "";
    const auto warn = [&](const TomlTable& of, const char* key, const std::string& degrees) {
      of.AddWarning(key, fmt::format("is in radians: read so{}, the arm reaches point {}{}; read "
                                     "as degrees, {}. Write {}",
                                     with, point.id, taught, WhatIsWrong(as_written), degrees));
    };
    if ((reading & kNearInRad) != 0) warn(table, "near_deg", JointsText(*NearInRadians(table)));
    if ((reading & kPointInRad) != 0) {
      warn(table, "rpy_deg", WrittenTurn::Of(table, "rpy_deg").InDegrees());
    }
    if ((reading & kFrameInRad) != 0 && confirmed_.insert(frame).second) {
      warn(frames_[frame].table, "rpy_deg", frames_[frame].turn.InDegrees());
    }
    // By its look alone the cell's reader has warned of it.
    if ((reading & kBaseInRad) != 0 && !base_warned_ && !LookLikeRadians(base_.angles)) {
      base_warned_ = true;
      warn(*robot_, "base_rpy_deg", base_.InDegrees());
    }
  }

  void WarnOfPosture(const TomlTable& table, const AssemblyPoint& point, const Outcome& outcome) {
    const int joint = outcome.farthest.joint;
    table.AddWarning(
        "near_deg",
        fmt::format("is not the posture that reaches the point: q{}: near_deg says {:.1f}, the "
                    "nearest posture that reaches the point has {:.1f} {}. The daemon commands "
                    "{}. Read the joints at the pendant where the point was taught, or check the "
                    "point's pose and frame",
                    joint + 1, InFileUnit(joint, (*point.near_q)[joint]),
                    InFileUnit(joint, outcome.correction.q[joint]), UnitOf(joint),
                    JointsText(outcome.correction.q)));
  }

  /// Once the arm reaches the point with one payload: with each of the others as well?
  void WarnOfOtherLoads(const TomlTable& table, const AssemblyPoint& point,
                        const std::vector<PointLoad>& loads, const Correction& reached) {
    for (const PointLoad& load : loads) {
      if (!load.payload) continue;
      const Correction other =
          machine_.Preview(point, *load.payload, reached.q, BranchSearch::kNone);
      if (other.code == CorrectionCode::kOk) continue;
      ++problems_;
      return WarnOfFailure(table, point, load.name, other);
    }
  }

  void WarnOfFailure(const TomlTable& table, const AssemblyPoint& point, const std::string& load,
                     const Correction& correction) {
    std::string why;
    switch (correction.code) {
      case CorrectionCode::kUnreachable:
        if (IsFarAway(config_.cell, point)) return;  // said by WarnOfUnlikelyPoint
        why = "no posture brings the tool there. Check the pose, its frame and the robot's base";
        break;
      case CorrectionCode::kJointLimit:
        why =
            "every posture that reaches it breaks a joint limit. Check min_deg and max_deg, or "
            "move the station";
        break;
      case CorrectionCode::kSingular:
        why = fmt::format(
            "smallest singular value {:.3g}, below correction.min_singular_value "
            "{:.3g}. Tilt the tool or move the station",
            correction.singular_value, config_.limits.min_singular_value);
        break;
      case CorrectionCode::kTooLarge:
        why = fmt::format(
            "{:.1f} mm and {:.2f} deg, more than [correction] allows. Check payload, "
            "masses and compliances",
            correction.translation_B.norm() / kMetrePerMm,
            correction.rotation_B.norm() / kRadPerDeg);
        break;
      default:
        why = "check payload, masses and compliances";
    }
    table.AddWarning("xyz_mm", fmt::format("gets no corrected point with {} ({}): {}", load,
                                           Describe(correction.code), why));
  }

  const TomlTable& root_;
  const std::optional<TomlTable>& robot_;
  const MachineConfig& config_;
  Machine machine_;
  std::vector<Frame> frames_;
  WrittenTurn base_;
  std::set<std::size_t> confirmed_;  ///< frames whose unit a point has decided
  bool base_warned_ = false;
  std::size_t problems_ = 0;
};

}  // namespace

void WarnOfUnlikelyPostures(const TomlTable& root, const std::optional<TomlTable>& robot,
                            const MachineConfig& config, std::size_t most) {
  if (most > 0 && !config.points.empty()) PostureCheck(root, robot, config).Run(most);
}

}  // namespace plumbline
