#include "app/measure/diagnosis/hypotheses/mistakes.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "app/measure/diagnosis/hypotheses/unit_segment.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/joint_columns.h"

namespace plumbline::measure {
namespace {

// Mistakes in rows on artefacts.

constexpr std::size_t kMaxSwapped = 12;

void ReverseGauge(ArtefactIndex gauge, Dataset& data) {
  for (const RowIndex row : data.row_indices()) {
    const Observation& observation = data.observations[row];
    std::optional<double>& gauge_m = data.table.rows[row.offset()].gauge_m;
    if (observation.kind == ObservationKind::kGauge && observation.artefact == gauge && gauge_m)
      *gauge_m *= -1;
  }
}

void AddReversedGauge(ArtefactIndex index, const std::string& name,
                      std::vector<Mistake>& mistakes) {
  Mistake& mistake = mistakes.emplace_back();
  mistake.sentence = fmt::format("the gauge {} reads with the opposite sign", name);
  mistake.remedy = "reverse its direction in the cell, or the sign of gauge_mm";
  mistake.undo = [index](Dataset& data) { ReverseGauge(index, data); };
  mistake.subtle = true;
  mistake.affects = [name](const MeasuredRow& row) { return row.artefact == name; };
}

void AddSwapped(const model::CellModel& cell, ArtefactIndex one, ArtefactIndex other,
                std::vector<Mistake>& mistakes) {
  const model::Artefact& a = cell.artefacts[one.offset()];
  const model::Artefact& b = cell.artefacts[other.offset()];
  if (a.kind != b.kind) return;
  Mistake& mistake = mistakes.emplace_back();
  mistake.sentence = fmt::format("{} and {} are swapped", a.name, b.name);
  mistake.remedy = "check their places in the cell against their names in the rows";
  mistake.undo = [one, other](Dataset& data) {
    std::swap(data.cell.artefacts[one.offset()], data.cell.artefacts[other.offset()]);
  };
}

/// Adds gauges that read with the opposite sign, and pairs of artefacts of one kind whose declared
/// positions are swapped (of at most 12 artefacts).
void AddArtefactMistakes(const Dataset& data, std::vector<Mistake>& mistakes) {
  std::vector<ArtefactIndex> placed;
  for (const ArtefactIndex index : data.used_artefacts.indices()) {
    if (!data.used_artefacts[index]) continue;
    const model::Artefact& artefact = data.cell.artefacts[index.offset()];
    if (artefact.kind == model::ArtefactKind::kGauge) {
      AddReversedGauge(index, artefact.name, mistakes);
    }
    if (artefact.place) placed.push_back(index);
  }
  if (placed.size() > kMaxSwapped) return;
  for (std::size_t k = 0; k < placed.size(); ++k) {
    for (std::size_t l = k + 1; l < placed.size(); ++l) {
      AddSwapped(data.cell, placed[k], placed[l], mistakes);
    }
  }
}

constexpr double kMinSpread_rad =
    0.5;  // minimum range of a joint whose sign is tested with a small residual

using Undo = std::function<void(Dataset&)>;

Undo OnPoints(std::function<Vec3(const Vec3&)> map) {
  return [map = std::move(map)](Dataset& data) {
    for (MeasuredRow& row : data.table.rows) {
      if (row.measured_W) row.measured_W = map(*row.measured_W);
    }
  };
}

constexpr double kLeastMove = 1e-6;  // [rad] or [m]

/// Sets the joint values of a row's conditions from the row and from its last move, as the
/// controller reports them.
void SetJoints(const model::JointVector& move, RowIndex row, Dataset& data) {
  const MeasuredRow& measured = data.measured(row);
  const model::Robot& robot = data.cell.robot;
  effects::Conditions& conditions = data.conditions[row];
  conditions.q = effects::OfDrives(robot, measured.q);
  conditions.qd = effects::OfDrives(robot, measured.qd);
  conditions.qdd = effects::OfDrives(robot, measured.qdd);
  conditions.last_move = effects::OfDrives(robot, move);
  for (Eigen::Index i = 0; i < conditions.last_move.size(); ++i) {
    const double moved = conditions.last_move[i];
    if (std::abs(moved) > kLeastMove) conditions.approach[i] = moved > 0 ? 1 : -1;
  }
}

Undo OnJoints(std::function<void(model::JointVector&)> map) {
  return [map = std::move(map)](Dataset& data) {
    for (const RowIndex row : data.row_indices()) {
      model::JointVector& q = data.table.rows[row.offset()].q;
      map(q);
      data.conditions[row].q = effects::OfDrives(data.cell.robot, q);
    }
  };
}

/// Reverses the sign of a joint in all its recorded quantities.
Undo ReverseSign(int joint) {
  return [joint](Dataset& data) {
    const auto reverse = [joint](model::JointVector& of_joints) {
      if (joint < of_joints.size()) of_joints[joint] *= -1;
    };
    for (const RowIndex row : data.row_indices()) {
      MeasuredRow& measured = data.table.rows[row.offset()];
      effects::Conditions& conditions = data.conditions[row];
      model::JointVector move = conditions.Reported(conditions.last_move);
      for (model::JointVector* joints : {&measured.q, &measured.qd, &measured.qdd, &measured.tau,
                                         &conditions.tau, &conditions.approach, &move}) {
        reverse(*joints);
      }
      SetJoints(move, row, data);
    }
  };
}

Undo OnPayload(double factor) {
  return [factor](Dataset& data) {
    for (const RowIndex row : data.row_indices()) {
      *data.table.rows[row.offset()].payload_kg *= factor;
      data.conditions[row].payload_kg *= factor;
      data.payloads[row].mass_kg *= factor;
    }
  };
}

/// A length that rows measure: its columns, and the change of a row by a factor.
struct MeasuredLength {
  const char* columns;
  void (*scale)(MeasuredRow& row, double factor);
  bool (*recorded)(const MeasuredRow& row);
};

constexpr MeasuredLength kMeasuredLengths[] = {
    {"x_mm, y_mm, z_mm",
     [](MeasuredRow& row, double factor) {
       if (row.measured_W) *row.measured_W *= factor;
     },
     [](const MeasuredRow& row) { return row.measured_W.has_value(); }},
    {"range_mm",
     [](MeasuredRow& row, double factor) {
       if (row.range_m) *row.range_m *= factor;
     },
     [](const MeasuredRow& row) { return row.range_m.has_value(); }},
    {"gauge_mm",
     [](MeasuredRow& row, double factor) {
       if (row.gauge_m) *row.gauge_m *= factor;
     },
     [](const MeasuredRow& row) { return row.gauge_m.has_value(); }},
};

/// A wrong unit or conversion of the joints of one type; multiplying by `factor` corrects it.
struct JointUnit {
  model::JointType type;
  double factor;
  bool holds;  ///< the columns hold `mistake`; else they are it
  const char* mistake;
  const char* remedy;
};

constexpr JointUnit kJointUnits[] = {
    {model::JointType::kRevolute, kDegPerRad, true, "radians", "write degrees (times 57.2958)"},
    {model::JointType::kRevolute, kRadPerDeg, false,
     "multiplied by 57.2958: degrees converted to degrees once more", "divide by 57.2958"},
    {model::JointType::kRevolute, 1e-3 * kDegPerRad, true, "milliradians",
     "write degrees (times 0.0572958)"},
    {model::JointType::kRevolute, 360, true, "turns", "write degrees (times 360)"},
    {model::JointType::kPrismatic, 1000, true, "metres", "write millimetres (times 1000)"},
    {model::JointType::kPrismatic, 10, true, "centimetres", "write millimetres (times 10)"},
    {model::JointType::kPrismatic, 25.4, true, "inches", "write millimetres (times 25.4)"},
    {model::JointType::kPrismatic, 1e-3, true, "micrometres", "write millimetres (times 0.001)"},
    {model::JointType::kPrismatic, 1000 * kRadPerDeg, false,
     "17.4533 times too small: metres, taken for radians and multiplied by 180/pi",
     "write millimetres (times 17.4533)"},
    {model::JointType::kPrismatic, kRadPerDeg, false,
     "multiplied by 57.2958: taken for radians and converted to degrees", "divide by 57.2958"},
    {model::JointType::kPrismatic, kDegPerRad, false,
     "divided by 57.2958: taken for degrees and converted to radians", "multiply by 57.2958"},
};

void AddJointUnits(const Dataset& data, std::vector<Mistake>& mistakes) {
  for (const JointUnit& unit : kJointUnits) {
    std::vector<std::string> columns;
    std::vector<int> joints;
    for (int i = 0; i < data.cell.robot.size(); ++i) {
      if (data.cell.robot.joints[i].type != unit.type) continue;
      columns.push_back(model::JointColumnName(model::JointQuantity::kPosition, unit.type, i));
      joints.push_back(i);
    }
    if (joints.empty()) continue;
    const Undo undo = OnJoints([joints, factor = unit.factor](model::JointVector& q) {
      for (const int i : joints) q[i] *= factor;
    });
    const bool one = columns.size() == 1;
    const char* const verb = unit.holds ? (one ? "holds" : "hold") : (one ? "is" : "are");
    mistakes.push_back(
        {fmt::format("{} {} {}", fmt::join(columns, ", "), verb, unit.mistake), unit.remedy, undo});
  }
}

void AddUnits(const Dataset& data, std::vector<Mistake>& mistakes) {
  const std::pair<double, const char*> units[] = {
      {25.4, "inches"}, {1000, "metres"}, {10, "centimetres"}, {1e-3, "micrometres"}};
  const std::vector<MeasuredRow>& rows = data.table.rows;
  for (const MeasuredLength& length : kMeasuredLengths) {
    if (std::ranges::none_of(rows, length.recorded)) continue;
    for (const auto& [factor, unit] : units) {
      const Undo undo = [factor = factor, scale = length.scale](Dataset& changed) {
        for (MeasuredRow& row : changed.table.rows) scale(row, factor);
      };
      mistakes.push_back({fmt::format("{} {} {}", length.columns,
                                      length.columns[0] == 'x' ? "hold" : "holds", unit),
                          fmt::format("write millimetres (times {:g})", factor), undo});
    }
  }
  AddJointUnits(data, mistakes);
}

/// Source and sign of each measured axis.
struct AxisMap {
  std::array<int, 3> from;
  std::array<int, 3> sign;
};

std::string SentenceOf(const AxisMap& map) {
  constexpr const char* kAxes = "xyz";
  std::vector<int> moved, turned;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    if (map.from[at] != axis) moved.push_back(axis);
    if (map.sign[at] < 0) turned.push_back(axis);
  }
  if (moved.size() == 2 && turned.empty()) {
    return fmt::format("{} and {} are swapped", kAxes[moved[0]], kAxes[moved[1]]);
  }
  if (moved.empty() && turned.size() == 1) {
    return fmt::format("the sign of {} is reversed (mirrored)", kAxes[turned[0]]);
  }
  std::string text;
  for (int axis = 0; axis < 3; ++axis) {
    const auto at = static_cast<std::size_t>(axis);
    text += fmt::format("{}{} is {}{}", axis == 0 ? "" : ", ", kAxes[axis],
                        map.sign[at] < 0 ? "-" : "", kAxes[map.from[at]]);
  }
  return text + " of the file";
}

void AddAxes(const Dataset& data, std::vector<Mistake>& mistakes) {
  if (data.ranges()) return;
  if (data.frames_free()) {
    mistakes.push_back(
        {"one measured axis is mirrored, or two are swapped (the measured frame is left-handed)",
         "check the signs and the order of x_mm, y_mm, z_mm",
         OnPoints([](const Vec3& p) { return Vec3(-p); })});
    return;
  }
  std::array<int, 3> from = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      AxisMap map{from, {}};
      Mat3 M = Mat3::Zero();
      for (std::size_t axis = 0; axis < 3; ++axis) {
        map.sign[axis] = (signs & (1 << axis)) != 0 ? -1 : 1;
        M(static_cast<int>(axis), from[axis]) = map.sign[axis];
      }
      if (M.isIdentity()) continue;
      mistakes.push_back({SentenceOf(map),
                          M.determinant() > 0
                              ? "write them in the cell's frame, or declare frame = \"unaligned\""
                              : "check the signs and the order of x_mm, y_mm, z_mm",
                          OnPoints([M](const Vec3& p) { return Vec3(M * p); })});
    }
  } while (std::next_permutation(from.begin(), from.end()));
}

/// Measurements shifted by one row.
void AddShiftedRows(const Dataset& data, std::vector<Mistake>& mistakes) {
  if (data.rows() < 8) return;
  for (const int shift : {-1, 1}) {
    const Undo undo = [shift](Dataset& changed) {
      std::vector<MeasuredRow>& rows = changed.table.rows;
      const std::vector<MeasuredRow> old = rows;
      const auto count = static_cast<int>(rows.size());
      for (int k = 0; k < count; ++k) {
        const auto at = static_cast<std::size_t>(std::clamp(k + shift, 0, count - 1));
        MeasuredRow& row = rows[k];
        // Rows of another kind keep their measurement.
        if (row.measured_W && old[at].measured_W) row.measured_W = old[at].measured_W;
        if (row.range_m && old[at].range_m) row.range_m = old[at].range_m;
      }
    };
    mistakes.push_back(
        {fmt::format("each row holds the measurement of the row {}",
                     shift > 0 ? "before" : "after"),
         "put the measurement and the joint readings of the same moment into one row", undo});
    mistakes.back().needs_all_rows = true;
  }
}

void AddJoints(const Dataset& data, std::vector<Mistake>& mistakes) {
  const int count = data.cell.robot.size();
  for (int i = 0; i < count; ++i) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const MeasuredRow& row : data.table.rows) {
      low = std::min(low, row.q[i]);
      high = std::max(high, row.q[i]);
    }
    Mistake sign{fmt::format("the sign of joint q{} is reversed", i + 1),
                 "check its sign in the cell, or in the recording", ReverseSign(i)};
    sign.subtle = i == count - 1 && high - low > kMinSpread_rad;
    mistakes.push_back(sign);
  }
  for (int i = 0; i < count; ++i) {
    if (!IsRevolute(data, i)) continue;
    for (const double turn_deg : {90.0, -90.0, 180.0}) {
      mistakes.push_back({fmt::format("joint q{} is offset by {:.0f} deg", i + 1, turn_deg),
                          "check theta_offset_deg", OnJoints([i, turn_deg](model::JointVector& q) {
                            q[i] += turn_deg * kRadPerDeg;
                          })});
    }
  }
  for (int i = 0; i + 1 < count; ++i) {
    if (IsRevolute(data, i) != IsRevolute(data, i + 1)) continue;
    mistakes.push_back({fmt::format("the columns of q{} and q{} are swapped", i + 1, i + 2),
                        "check the header against the recording",
                        OnJoints([i](model::JointVector& q) { std::swap(q[i], q[i + 1]); })});
  }
}

/// The ratio that the cell declares for two joints; 0 if none.
double DeclaredRatio(const model::JointCoupling& pair, const model::Robot& robot) {
  for (const model::JointCoupling& coupling : robot.couplings) {
    if (coupling.joint == pair.joint && coupling.of == pair.of) return coupling.ratio;
  }
  return 0;
}

/// Adds to the ratio of a coupling of the cell, or couples the joints.
void Couple(const model::JointCoupling& added, model::Robot& robot) {
  for (model::JointCoupling& coupling : robot.couplings) {
    if (coupling.joint == added.joint && coupling.of == added.of) {
      coupling.ratio += added.ratio;
      return;
    }
  }
  robot.couplings.push_back(added);
}

void CoupleRows(const model::JointCoupling& added, Dataset& data) {
  Couple(added, data.cell.robot);
  std::shared_ptr<const model::Robot> before, after;
  for (const RowIndex row : data.row_indices()) {
    effects::Conditions& conditions = data.conditions[row];
    const model::JointVector move = conditions.Reported(conditions.last_move);
    if (conditions.robot && conditions.robot != before) {
      before = conditions.robot;
      model::Robot coupled = *before;
      coupled.couplings = data.cell.robot.couplings;
      after = std::make_shared<const model::Robot>(std::move(coupled));
    }
    if (conditions.robot) conditions.robot = after;
    SetJoints(move, row, data);
  }
}

/// Adds axes that the controller counts against another link than the one before: the ground, or
/// the base of a parallelogram.
void AddCouplings(const Dataset& data, std::vector<Mistake>& mistakes) {
  for (const model::JointCoupling& pair : PossibleCouplings(data)) {
    for (const double ratio : {1.0, -1.0}) {
      mistakes.push_back(CouplingMistake(data, {pair.joint, pair.of, ratio}));
    }
  }
}

Mat3 Rotation(double angle_rad, const Vec3& axis) {
  return RotationFromVector(angle_rad * axis);
}

void AddCell(const Dataset& data, std::vector<Mistake>& mistakes) {
  const bool distal = data.cell.robot.convention == model::DhConvention::kDistal;
  mistakes.push_back({fmt::format("the DH table uses the {} convention",
                                  distal ? "proximal (\"mdh\")" : "distal (\"dh\")"),
                      "check convention in [robot]", [distal](Dataset& changed) {
                        changed.cell.robot.convention =
                            distal ? model::DhConvention::kProximal : model::DhConvention::kDistal;
                      }});
  if (data.frames_free()) return;
  const Pose& X_WB = data.cell.robot.X_WB;
  const Vec3 rpy = RollPitchYawFromRotation(X_WB.R);
  const auto turned = [&](const std::string& sentence, const Mat3& R) {
    if (R.isApprox(X_WB.R, 1e-6)) return;
    mistakes.push_back({sentence, "write base_rpy_deg as R = Rz(yaw) Ry(pitch) Rx(roll)",
                        [R](Dataset& changed) { changed.cell.robot.X_WB.R = R; }});
  };
  const Vec3 x = Vec3::UnitX(), y = Vec3::UnitY(), z = Vec3::UnitZ();
  turned("base_rpy_deg holds angles about the moving axes x, y, z (R = Rx Ry Rz)",
         Rotation(rpy[0], x) * Rotation(rpy[1], y) * Rotation(rpy[2], z));
  turned("base_rpy_deg holds yaw, pitch, roll (A, B, C: in reverse order)",
         Rotation(rpy[0], z) * Rotation(rpy[1], y) * Rotation(rpy[2], x));
  turned("base_rpy_deg holds Euler angles about z, y, z",
         Rotation(rpy[0], z) * Rotation(rpy[1], y) * Rotation(rpy[2], z));
  turned("base_rpy_deg holds Euler angles about z, x, z",
         Rotation(rpy[0], z) * Rotation(rpy[1], x) * Rotation(rpy[2], z));
  turned("base_rpy_deg holds a rotation vector", RotationFromVector(rpy));
  const Vec3 as_degrees = rpy / kRadPerDeg;
  turned("base_rpy_deg holds radians",
         Rotation(as_degrees[2], z) * Rotation(as_degrees[1], y) * Rotation(as_degrees[0], x));
  const Pose inverse = X_WB.Inverse();
  if (!inverse.p.isApprox(X_WB.p, 1e-6) || !inverse.R.isApprox(X_WB.R, 1e-6)) {
    mistakes.push_back(
        {"base_xyz_mm and base_rpy_deg hold the pose of the instrument in the base frame",
         "declare the base in the measurement frame, the inverse of it",
         [inverse](Dataset& changed) { changed.cell.robot.X_WB = inverse; }});
  }
}

void AddPayload(const Dataset& data, std::vector<Mistake>& mistakes) {
  if (!UsesPayload(data)) return;
  constexpr double kOtherScale = 1.12;  // the rows distinguish scales that differ by this factor
  const std::pair<double, const char*> units[] = {{0.45359237, "pounds"}, {1 / 9.80665, "newtons"}};
  for (const auto& [factor, unit] : units) {
    Mistake mistake{fmt::format("payload_kg holds {}", unit),
                    fmt::format("write kilograms (times {:.4g})", factor), OnPayload(factor)};
    mistake.subtle = true;
    mistake.alternatives = {OnPayload(factor / kOtherScale), OnPayload(factor * kOtherScale)};
    mistakes.push_back(mistake);
  }
}

/// Payloads recorded one row too late or too early. The last value continues at the end.
void AddShiftedPayloads(const Dataset& data, std::vector<Mistake>& mistakes) {
  constexpr int kMinChanges = 4;
  constexpr int kMaxCopiedRows = 10000;  // a judgement; trying these copies the rows
  int changes = 0;
  for (int k = 1; k < data.rows(); ++k) {
    if (data.measured(RowIndex(k)).payload_kg != data.measured(RowIndex(k - 1)).payload_kg) {
      ++changes;
    }
  }
  if (!UsesPayload(data) || changes < kMinChanges || data.rows() > kMaxCopiedRows) return;
  for (const int shift : {-1, 1}) {
    const Undo undo = [shift](Dataset& changed) {
      const std::vector<MeasuredRow> old = changed.table.rows;
      for (const RowIndex row : changed.row_indices()) {
        const int from = std::clamp(row.value() + shift, 0, changed.rows() - 1);
        const double payload_kg = *old[RowIndex(from).offset()].payload_kg;
        changed.table.rows[row.offset()].payload_kg = payload_kg;
        changed.conditions[row].payload_kg = payload_kg;
        changed.payloads[row].mass_kg = payload_kg;
      }
    };
    Mistake mistake{fmt::format("payload_kg changes one row {}", shift > 0 ? "late" : "early"),
                    "record the payload that the robot carries at the moment of measurement", undo};
    mistake.subtle = mistake.needs_all_rows = true;
    mistakes.push_back(mistake);
  }
}

void AddFrames(const Dataset& data, std::vector<Mistake>& mistakes) {
  if (!data.tip_free()) {
    Mistake tip{"", "correct tcp_mm (or the tool's length), or declare tool = \"unknown\"",
                [](Dataset& changed) { changed.cell.measurement.tool_known = false; }};
    tip.fits_tip = true;
    mistakes.push_back(tip);
  }
  if (!data.frames_free()) {
    Mistake base{"", "correct base_xyz_mm and base_rpy_deg, or declare frame = \"unaligned\"",
                 [](Dataset& changed) { changed.cell.measurement.frame_known = false; }};
    base.fits_base = true;
    mistakes.push_back(base);
  }
}

}  // namespace

Mistake CouplingMistake(const Dataset& data, const model::JointCoupling& coupling) {
  constexpr double kNone = 1e-3;
  const int joint = coupling.joint + 1, of = coupling.of + 1;
  const double declared = DeclaredRatio(coupling, data.cell.robot);
  const double ratio = declared + coupling.ratio;
  Mistake mistake{"", "", [coupling](Dataset& changed) { CoupleRows(coupling, changed); }};
  if (declared != 0 && std::abs(ratio) < kNone) {
    mistake.sentence =
        fmt::format("joint q{} does not turn with q{}, as the cell declares", joint, of);
    mistake.remedy = fmt::format(
        "remove the [[robot.coupling]] with joint = {}, of = {} from the cell", joint, of);
    return mistake;
  }
  const bool whole = std::abs(std::abs(ratio) - 1) < kNone;
  const std::string axis = fmt::format("the axis is at q{} {} {}q{}", joint, ratio > 0 ? "+" : "-",
                                       whole ? "" : fmt::format("{:.4g} ", std::abs(ratio)), of);
  if (declared != 0) {
    mistake.sentence = fmt::format(
        "the ratio by which joint q{} turns with q{} is {:.4g}, not {:.4g} as the cell declares "
        "({})",
        joint, of, ratio, declared, axis);
    mistake.remedy = fmt::format(
        "correct the ratio in the [[robot.coupling]] with joint = {}, of = {}", joint, of);
    return mistake;
  }
  mistake.sentence =
      fmt::format("joint q{} also turns with q{} ({}; {})", joint, of,
                  whole ? fmt::format("q{} is counted against the ground or another link", joint)
                        : "a belt, gears or a parallelogram drive it",
                  axis);
  mistake.remedy = fmt::format(
      "declare it in the cell: [[robot.coupling]] with joint = {}, of = {}, ratio = {:.4g}; or "
      "record the angle between the links",
      joint, of, ratio);
  return mistake;
}

std::vector<model::JointCoupling> PossibleCouplings(const Dataset& data) {
  const model::Robot& robot = data.cell.robot;
  std::vector<model::JointCoupling> pairs;
  for (int joint = 0; joint < robot.size(); ++joint) {
    for (int of = 0; of < robot.size(); ++of) {
      if (!IsRevolute(data, joint) || !IsRevolute(data, of)) continue;
      model::Robot coupled = robot;
      Couple({joint, of, 1}, coupled);
      if (std::ssize(kinematics::CouplingOrder(robot.size(), coupled.couplings)) < robot.size()) {
        continue;
      }
      pairs.push_back({joint, of, 0});
    }
  }
  return pairs;
}

std::vector<Mistake> MistakesOf(const Dataset& data) {
  // First, because converting a whole column that is mostly in another unit almost fits, too.
  std::vector<Mistake> mistakes = UnitChanges(data);
  AddUnits(data, mistakes);
  AddAxes(data, mistakes);
  AddShiftedRows(data, mistakes);
  AddJoints(data, mistakes);
  AddCouplings(data, mistakes);
  AddCell(data, mistakes);
  AddPayload(data, mistakes);
  AddShiftedPayloads(data, mistakes);
  AddArtefactMistakes(data, mistakes);
  AddFrames(data, mistakes);
  return mistakes;
}

}  // namespace plumbline::measure
