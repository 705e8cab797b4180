#include "app/measure/controller/relation_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

using Kind = RelationKind;

constexpr double kSigmas = 2;        // of stated deviations
constexpr double kUpsideDown = 0.1;  // [rad] from half a turn about a horizontal axis
constexpr double kPlain = 1e-3;      // of a ratio that is a whole number
constexpr double kNoTurn = 2e-4;     // [rad] of a tool
constexpr double kShownLength_m = 1e-9, kShownAngle = 1e-12;

/// A decimal number with a point and without superfluous zeros, as TOML wants it.
std::string Decimal(double value, int digits) {
  std::string text = fmt::format("{:.{}f}", value, digits);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text += '0';
  return text == "-0.0" ? "0.0" : text;
}
std::string Mm(double value_m) {
  return Decimal(kMmPerMetre * value_m, 6);
}
std::string Deg(double value_rad) {
  return Decimal(kDegPerRad * value_rad, 8);
}
std::string MmRow(const Vec3& p) {
  return fmt::format("[{}, {}, {}]", Mm(p.x()), Mm(p.y()), Mm(p.z()));
}
std::string DegRow(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", Deg(v.x()), Deg(v.y()), Deg(v.z()));
}

/// First parameter of the k-th relation.
std::size_t PlaceOf(const HypothesisFit& fit, std::size_t k, const RelationContext& context,
                    const ControllerSample& sample) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < k; ++i)
    at += ParametersOf(fit.hypothesis[i], context, sample).prior_sd.size();
  return at;
}

double Deviation(const HypothesisFit& fit, std::size_t at) {
  const auto k = static_cast<int>(at);
  return kSigmas * std::sqrt(std::max(0.0, fit.covariance(k, k)));
}

/// The ratio, exact if it is a whole number within what the data can tell.
double PlainRatio(double ratio) {
  const double whole = std::round(ratio);
  return std::abs(ratio - whole) < kPlain ? whole : ratio;
}

bool IsUpsideDown(const Mat3& R) {
  return std::acos(std::clamp(-R(2, 2), -1.0, 1.0)) < kUpsideDown;
}

std::string FrameText(const char* what, std::span<const double> v) {
  const Vec3 p(v[0], v[1], v[2]), turn(v[3], v[4], v[5]);
  return fmt::format("{} of ({:.2f}, {:.2f}, {:.2f}) mm and {:.3f} deg", what, kMmPerMetre * p.x(),
                     kMmPerMetre * p.y(), kMmPerMetre * p.z(), kDegPerRad * turn.norm());
}

std::string OneText(const Relation& one, std::span<const double> v, std::span<const double> dev,
                    const RelationContext& context) {
  const int joint = one.joint + 1, other = one.other + 1;
  const model::Joint* const row =
      one.joint >= 0 ? &context.cell.robot.joints[static_cast<std::size_t>(one.joint)] : nullptr;
  switch (one.kind) {
    case Kind::kNominal:
      return "the cell's own table, rigid";
    case Kind::kDeclaredFrame:
      return "the cell's own table, rigid, with poses in the measurement frame";
    case Kind::kFactoryTable:
      return "the given factory table";
    case Kind::kRoundedTable:
      return fmt::format("the cell's table with lengths rounded to {:g} mm",
                         kMmPerMetre * one.value);
    case Kind::kTableValue: {
      const double now = (one.other == 0 ? row->a_m : row->d_m);
      return fmt::format("{} of joint {} as {:.4f} mm instead of {:.4f} mm (± {:.4f} mm)",
                         one.other == 0 ? "a" : "d", joint, kMmPerMetre * (now + v[0]),
                         kMmPerMetre * now, kMmPerMetre * dev[0]);
    }
    case Kind::kAdjustedTable:
      return "a table that differs from the nominal one by small amounts in several joints, which "
             "no simpler relation explains: a factory calibration or absolute accuracy that this "
             "cell does not have";
    case Kind::kLengthScale:
      return fmt::format("all lengths of the table times {:.6f} (± {:.6f})", 1 + v[0], dev[0]);
    case Kind::kCellDeflection:
      return "the deflection by load and gravity that this cell corrects";
    case Kind::kJointCompliance: {
      std::vector<std::string> parts;
      for (std::size_t i = 0; i < v.size(); ++i) {
        if (std::abs(v[i]) > 1.5 * dev[i] && std::abs(v[i]) > 0)
          parts.push_back(fmt::format("joint {} {:.2g} rad/(N m)", i + 1, v[i]));
      }
      return fmt::format(
          "joints that yield under gravity ({}): a model with deflection, such as "
          "absolute accuracy",
          fmt::join(parts, ", "));
    }
    case Kind::kHiddenTool:
      return FrameText("a further transform at the flange", v);
    case Kind::kOtherTool: {
      const auto number = context.cell.ToolAt(one.other).number;
      return number ? fmt::format("the tip of tool {}", *number) : "the tip of the cell's tool";
    }
    case Kind::kFlange:
      return "the flange, without a tool";
    case Kind::kBase:
      return FrameText(IsUpsideDown(RotationFromVector(Vec3(v[3], v[4], v[5])))
                           ? "an upside-down base (ceiling), a transform"
                           : "another base, a transform",
                       v);
    case Kind::kMirroredAxis:
      return fmt::format("{} of the position counted backwards", "xyz"[one.other]);
    case Kind::kJointUnit:
      return one.value < 1 ? "joints in degrees that were read as radians"
                           : "joints in radians that were read as degrees";
    case Kind::kLengthUnit:
      return fmt::format("positions in another unit: they are {:g} times as long", one.value);
    case Kind::kAngleUnit:
      return one.value < 1 ? "an orientation in degrees that was read as radians"
                           : "an orientation in radians that was read as degrees";
    case Kind::kCoupling:
      return fmt::format("joint {} counted against joint {} (ratio {:+.4f} ± {:.4f})", joint, other,
                         v[0], dev[0]);
    case Kind::kZeroOffset:
      return row->type == model::JointType::kRevolute
                 ? fmt::format("another zero of joint {}: {:+.4f} deg (± {:.4f} deg)", joint,
                               kDegPerRad * v[0] * row->sign, kDegPerRad * dev[0])
                 : fmt::format("another zero of joint {}: {:+.4f} mm (± {:.4f} mm)", joint,
                               kMmPerMetre * v[0] * row->sign, kMmPerMetre * dev[0]);
    case Kind::kAxisSign:
      return fmt::format("joint {} counted in the other direction", joint);
    case Kind::kJointOrder: {
      std::vector<int> order;
      for (const int k : one.order) order.push_back(k + 1);
      return fmt::format("joints in another order: the readings are those of joints {}",
                         fmt::join(order, ", "));
    }
    case Kind::kAngleConvention: {
      const AngleConvention& convention = AngleConventions()[static_cast<std::size_t>(one.other)];
      return fmt::format("the orientation as {} ({})", convention.name, convention.text);
    }
    case Kind::kInverseRotation:
      return "the orientation of the base in the tool instead of the tool in the base";
    case Kind::kInversePose:
      return "the pose of the base in the tool instead of the tool in the base";
    case Kind::kQuaternionOrder:
      return "a quaternion with the scalar last";
    case Kind::kTimeShift:
      return fmt::format("joints that are {:.1f} ms older than the pose (± {:.1f} ms)", 1e3 * v[0],
                         1e3 * dev[0]);
  }
  return "";
}

ControllerSample EmptySample() {
  return {};
}

std::size_t CountOf(const Relation& relation, const RelationContext& context) {
  return ParametersOf(relation, context, EmptySample()).prior_sd.size();
}

/// Changed keys of the rows of joints.
void AddJointLines(const model::Robot& before, const model::Robot& after,
                   std::vector<CellLines>& all) {
  for (std::size_t i = 0; i < after.joints.size(); ++i) {
    const model::Joint &a = before.joints[i], &b = after.joints[i];
    CellLines lines{fmt::format("[robot], joint {}", i + 1), {}, {}};
    const auto add = [&](const char* key, double from, double to, const std::string& text,
                         double least) {
      if (std::abs(from - to) > least) lines.lines.push_back(fmt::format("{} = {}", key, text));
    };
    add("a_mm", a.a_m, b.a_m, Mm(b.a_m), kShownLength_m);
    add("alpha_deg", a.alpha_rad, b.alpha_rad, Deg(b.alpha_rad), kShownAngle);
    add("beta_deg", a.beta_rad, b.beta_rad, Deg(b.beta_rad), kShownAngle);
    add("d_mm", a.d_m, b.d_m, Mm(b.d_m), kShownLength_m);
    add("theta_offset_deg", a.theta_offset_rad, b.theta_offset_rad, Deg(b.theta_offset_rad),
        kShownAngle);
    if (a.sign != b.sign) lines.lines.push_back(fmt::format("sign = {}", b.sign));
    if (!lines.lines.empty()) all.push_back(lines);
  }
}

bool Has(const HypothesisFit& fit, Kind kind) {
  return std::any_of(fit.hypothesis.begin(), fit.hypothesis.end(),
                     [&](const Relation& one) { return one.kind == kind; });
}

}  // namespace

std::string RelationText(const HypothesisFit& fit, const RelationContext& context) {
  std::vector<std::string> parts;
  std::size_t at = 0;
  for (const Relation& one : fit.hypothesis) {
    const std::size_t count = CountOf(one, context);
    std::vector<double> deviations;
    for (std::size_t k = at; k < at + count; ++k) deviations.push_back(Deviation(fit, k));
    parts.push_back(OneText(one, std::span(fit.values.data() + at, count), deviations, context));
    at += count;
  }
  return fmt::format("{}", fmt::join(parts, ", and "));
}

std::vector<CellLines> LinesOf(const HypothesisFit& fit, const RelationContext& context,
                               const ControllerSample& sample, model::CellModel& cell) {
  std::vector<CellLines> all;
  ControllerModel model = NominalModel(context);
  for (std::size_t k = 0; k < fit.hypothesis.size(); ++k) {
    const Relation& one = fit.hypothesis[k];
    const std::size_t at = PlaceOf(fit, k, context, sample);
    std::vector<double> values(fit.values.data() + at,
                               fit.values.data() + at + CountOf(one, context));
    if (one.kind == Kind::kCoupling) values[0] = PlainRatio(values[0]);
    Apply(one, values, context, sample, model);
    switch (one.kind) {
      case Kind::kCellDeflection:
      case Kind::kJointCompliance:
        all.push_back({"",
                       {},
                       "the controller's pose already contains deflection: switch its absolute "
                       "accuracy off, or let it correct alone and remove compliance_rad_per_Nm and "
                       "[[effect]] from the cell"});
        break;
      case Kind::kFactoryTable:
        all.push_back({"",
                       {},
                       "use the factory table as the cell: plumbline import-urdf TABLE --output "
                       "cell.toml"});
        break;
      case Kind::kAdjustedTable:
        all.push_back({"",
                       {},
                       "export the controller's factory table and use it as the cell: plumbline "
                       "import-urdf TABLE --output cell.toml (of a UR: ur_calibration); "
                       "--factory-table TABLE confirms it. Without one, the rows below come near"});
        break;
      case Kind::kOtherTool:
        all.push_back({"",
                       {},
                       "select the same tool in the controller and in Plumbline: the tool number "
                       "of the controller, or robot profile [tool_number]"});
        break;
      case Kind::kFlange:
        all.push_back(
            {"robot profile, [tcp]", {"of = \"flange\""}, "or select the tool in the controller"});
        break;
      case Kind::kMirroredAxis:
        all.push_back({"robot profile, [tcp.position]",
                       {},
                       fmt::format("the scale of {} is negative: correct the program that fills "
                                   "the register, or the file",
                                   "xyz"[one.other])});
        break;
      case Kind::kJointUnit:
        all.push_back({"robot profile, [[joints]]",
                       {one.value < 1 ? "unit = \"deg\"" : "unit = \"rad\""},
                       "in a file: name the columns by their unit"});
        break;
      case Kind::kLengthUnit:
        all.push_back({"robot profile, [tcp.position]",
                       {},
                       fmt::format("multiply scale by {:g}, or correct unit; in a file: name the "
                                   "columns by their unit",
                                   one.value)});
        break;
      case Kind::kAngleUnit:
        all.push_back({"robot profile, [tcp.orientation]",
                       {one.value < 1 ? "unit = \"deg\"" : "unit = \"rad\""},
                       "in a file: name the columns by their unit"});
        break;
      case Kind::kAngleConvention: {
        const AngleConvention& convention = AngleConventions()[static_cast<std::size_t>(one.other)];
        if (one.other <= kZyzAngles) {
          all.push_back({"robot profile, [tcp.orientation]",
                         {fmt::format("convention = \"{}\"", convention.name)},
                         "in a file: --orientation"});
        } else {
          all.push_back({"",
                         {},
                         fmt::format("no robot profile has {}: let the robot program copy another "
                                     "form; in a file: --orientation",
                                     convention.text)});
        }
        break;
      }
      case Kind::kInverseRotation:
      case Kind::kInversePose:
      case Kind::kQuaternionOrder:
        all.push_back({"", {}, "correct the program or file that reports the pose"});
        break;
      case Kind::kJointOrder: {
        std::vector<int> order;
        for (const int joint : one.order) order.push_back(joint + 1);
        all.push_back({"robot profile, [[joints]]",
                       {},
                       fmt::format("exchange the addresses: the registers listed now are those of "
                                   "joints {}",
                                   fmt::join(order, ", "))});
        break;
      }
      case Kind::kTimeShift:
        all.push_back({"",
                       {},
                       "compare joints and pose at standstill only; read them in one [[read]] "
                       "block"});
        break;
      default:
        break;
    }
  }
  cell = context.cell;
  const bool tables = !Has(fit, Kind::kFactoryTable);
  if (tables) {
    AddJointLines(context.cell.robot, model.robot, all);
    cell.robot = model.robot;
  }
  if (model.robot.couplings != context.cell.robot.couplings) {
    auto& couplings = cell.robot.couplings;
    const auto empty = [](const model::JointCoupling& one) { return one.ratio == 0; };
    couplings.erase(std::remove_if(couplings.begin(), couplings.end(), empty), couplings.end());
    all.push_back({"[robot]", {fmt::format("coupling = {}", CouplingText(cell.robot))}, ""});
  }
  if (Has(fit, Kind::kBase)) {
    const Vec3 turn = RollPitchYawFromRotation(model.X_RB.R);
    all.push_back(
        {"",
         {},
         fmt::format("the controller reports poses in a frame in which the arm's base is at {} mm, "
                     "turned by {} deg (roll, pitch, yaw): select the robot's own base or world in "
                     "the controller, or let its program report poses in it. base_xyz_mm and "
                     "base_rpy_deg of the cell stay as they are: they place the arm in the "
                     "measurement frame, in which gravity_m_s2 is given",
                     MmRow(model.X_RB.p), DegRow(turn))});
  }
  if (Has(fit, Kind::kHiddenTool)) {
    const ControllerPosture& first = sample.postures.front();
    const Pose X_FT = model.X_FH * (model.X_FT ? *model.X_FT : ToolOf(first, context));
    const bool of_cell = std::all_of(
        sample.postures.begin(), sample.postures.end(), [&](const ControllerPosture& posture) {
          return posture.tool == first.tool && !posture.X_FT && !posture.of_flange;
        });
    model::Tool& tool = cell.ToolAt(first.tool);
    const double turned = VectorFromRotation(X_FT.R).norm();
    if (tool.rigid && turned < kNoTurn && of_cell) {
      tool.tcp_F = X_FT.p;
      all.push_back({"[tool]", {fmt::format("tcp_mm = {}", MmRow(X_FT.p))}, ""});
    } else {
      const Vec3 turn = RollPitchYawFromRotation(X_FT.R);
      all.push_back({"",
                     {},
                     fmt::format("the controller's tool is at {} mm, turned by {} deg (roll, "
                                 "pitch, yaw); a cell's tool is not turned: set the controller's "
                                 "tool to that of the cell, or read it by [tool_offset] of the "
                                 "robot profile",
                                 MmRow(X_FT.p), DegRow(turn))});
    }
  }
  return all;
}

bool CellCanHold(const HypothesisFit& fit) {
  return !Has(fit, Kind::kBase);
}

namespace {

std::string FindingOfRows(const Identification& found, const RelationContext& context) {
  switch (found.verdict) {
    case Identification::Verdict::kTooFew:
      return fmt::format(
          "{} postures are too few, or the arm hardly moved: {} well apart are "
          "needed, 10 to 20 are better",
          found.postures, kFewestPostures);
    case Identification::Verdict::kNone:
      return fmt::format(
          "no known relation explains the controller's pose, which is {:.2f} mm and "
          "{:.3f} deg from the cell's table",
          kMmPerMetre * found.nominal.held_out.distance_m,
          kDegPerRad * found.nominal.held_out.angle_rad);
    case Identification::Verdict::kNotClear: {
      std::vector<std::string> rivals;
      for (std::size_t k = 0; k < found.rivals.size() && k < 3; ++k)
        rivals.push_back(RelationText(found.rivals[k], context));
      return fmt::format("not clear what the controller's pose is: {}; or {}",
                         RelationText(found.best, context), fmt::join(rivals, "; or "));
    }
    case Identification::Verdict::kNamed:
      break;
  }
  return fmt::format("the controller's pose is {}", RelationText(found.best, context));
}

}  // namespace

std::string FindingText(const Identification& found, const RelationContext& context) {
  std::string text = FindingOfRows(found, context);
  if (found.outlying.empty()) return text;
  std::vector<std::string> rows;
  for (const OutlyingRow& one : found.outlying) {
    rows.push_back(fmt::format("row {}{} ({:.2f} mm, {:.3f} deg)", one.row + 1,
                               one.line > 0 ? fmt::format(" in line {}", one.line) : "",
                               kMmPerMetre * one.error.distance_m,
                               kDegPerRad * one.error.angle_rad));
  }
  return text + fmt::format("; this is about the other {} rows, which {} not fit: {}",
                            found.postures, rows.size() > 1 ? "these do" : "this one does",
                            fmt::join(rows, ", "));
}

std::string FindingRemedy(const Identification& found, const RelationContext& context,
                          const ControllerSample& sample) {
  if (found.verdict == Identification::Verdict::kTooFew)
    return "move the robot to more postures, with every joint";
  if (found.verdict == Identification::Verdict::kNone)
    return "plumbline identify-controller shows what the difference follows";
  if (found.verdict == Identification::Verdict::kNotClear)
    return "plumbline identify-controller names postures that decide it";
  if (found.IsNominal()) return "";
  model::CellModel changed;
  std::string text;
  int rows = 0;
  for (const CellLines& one : LinesOf(found.best, context, sample, changed)) {
    if (++rows > 2) return text + "; plumbline identify-controller prints all of it";
    const std::string lines = fmt::format("{}", fmt::join(one.lines, ", "));
    if (!text.empty()) text += "; ";
    text += one.lines.empty() ? one.advice : fmt::format("{}: {}", one.place, lines);
  }
  return text;
}

std::vector<std::string> JointRows(const model::Robot& robot) {
  std::vector<std::string> rows;
  for (const model::Joint& joint : robot.joints) {
    const bool prismatic = joint.type == model::JointType::kPrismatic;
    std::string row = prismatic ? "{ type = \"prismatic\", " : "{ ";
    row += fmt::format("a_mm = {}, alpha_deg = {}, ", Mm(joint.a_m), Deg(joint.alpha_rad));
    if (joint.beta_rad != 0) row += fmt::format("beta_deg = {}, ", Deg(joint.beta_rad));
    if (joint.gamma_rad != 0) row += fmt::format("gamma_deg = {}, ", Deg(joint.gamma_rad));
    row += fmt::format("d_mm = {}, theta_offset_deg = {}, sign = {}", Mm(joint.d_m),
                       Deg(joint.theta_offset_rad), joint.sign);
    const auto limit = [&](const char* name, double value) {
      if (!std::isfinite(value)) return;
      row += fmt::format(", {}_{} = {}", name, prismatic ? "mm" : "deg",
                         prismatic ? Mm(value) : Deg(value));
    };
    limit("min", joint.min);
    limit("max", joint.max);
    if (joint.link_mass_kg)
      row += fmt::format(", link_mass_kg = {}", Decimal(*joint.link_mass_kg, 6));
    if (joint.link_com_m) row += fmt::format(", link_com_mm = {}", MmRow(*joint.link_com_m));
    if (joint.compliance_rad_per_Nm)
      row += fmt::format(", compliance_rad_per_Nm = {:e}", *joint.compliance_rad_per_Nm);
    rows.push_back(row + " }");
  }
  return rows;
}

std::string CouplingText(const model::Robot& robot) {
  std::vector<std::string> rows;
  for (const model::JointCoupling& one : robot.couplings) {
    rows.push_back(fmt::format(
        "{{ joint = {}, of = {}, ratio = {}{} }}", one.joint + 1, one.of + 1, Decimal(one.ratio, 8),
        one.drive == model::CouplingDrive::kReading ? ", drive = \"reading\"" : ""));
  }
  return fmt::format("[{}]", fmt::join(rows, ", "));
}

}  // namespace plumbline::measure
