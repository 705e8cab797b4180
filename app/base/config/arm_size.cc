#include "app/base/config/arm_size.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "firmware-like/kinematics/inverse.h"
#include "firmware-like/loads/gravity.h"

namespace plumbline::config {
namespace {

// With so many samples, the largest reach and torques are within 5 % of the true ones.
constexpr int kSampledPostures = 512;
constexpr int kFirstSpread = 8;  // RestartPosture() mirrors its seed at smaller indices
constexpr double kStandardGravity_m_s2 = 9.80665;

// 0.6 written for 600 gives a length below a millimetre. Calibrated tables contain such lengths
// where the nominal one is zero, but then many of them.
constexpr double kMetresWritten_m = 0.002;
constexpr int kMaxSuspectLengths = 2;
constexpr double kShortestPart_m = 0.03;

// Mass of the links over the reach cubed [kg/m^3]: 13 (UR10) to 128 (IRB 120) for the supplied
// cells, 7 to 260 in data sheets from light cobots to small bench arms. Grams written for kilograms
// are outside the limits below.
constexpr double kLightestArm = 1.5, kHeaviestArm = 1500;
// Mass of one link over that of all others; a cast first link can weigh as much as all others.
constexpr double kHeaviestLink = 6;

// Wind-up at the largest gross gravity torque (links and rated payload): 1.05 to 6.7 mrad for the 5
// to 95 % quantiles of industrial arms and cobots, up to 16 for torque-sensing arms. An error by a
// factor of 1000 is always outside these limits; a factor of 20 does not prove a mistake.
constexpr double kStiffest_rad = 0.05e-3, kSoftest_rad = 60e-3;
// Axes that carry little gravity are not sized by it: wrists have 0.02 to 0.85 of joint 2's
// stiffness, so the same torque would wind them up by up to 300 mrad.
constexpr double kCarriesGravity = 0.3, kSoftestOther_rad = 1;
// Gross torque over that of the links alone, from the payload's share of 43 to 59 %.
constexpr double kGrossTorque = 2;

// Rated payload over reach cubed: 5 (long-reach arms) to 30 (heavy-payload arms).
constexpr double kHeaviestLoad_kg_m3 = 30;
constexpr double kOverload = 2;
constexpr double kLongestTool = 3;  // tool over reach

/// The figures above apply to arms of at least four revolute joints. Fewer joints make a positioner
/// of any shape, and a prismatic axis changes the arm's size.
bool IsArm(const model::Robot& robot) {
  return robot.size() >= 4 && robot.size() <= model::kMaxJoints &&
         std::all_of(robot.joints.begin(), robot.joints.end(), [](const model::Joint& joint) {
           return joint.type == model::JointType::kRevolute;
         });
}

/// The length if the number in the file was metres instead of millimetres.
double ReadAsMetres(double length_m) {
  return std::abs(length_m) * 1e3;
}

/// True for a length that, read as metres, would be plausible for this arm.
bool CouldBeMetres(double length_m, double longest_m) {
  return length_m != 0 && std::abs(length_m) < kMetresWritten_m &&
         ReadAsMetres(length_m) >= kShortestPart_m && ReadAsMetres(length_m) <= 1.2 * longest_m;
}

double LongestLength(const model::Robot& robot) {
  double longest_m = 0;
  for (const model::Joint& joint : robot.joints) {
    longest_m = std::max({longest_m, std::abs(joint.a_m), std::abs(joint.d_m)});
  }
  return longest_m;
}

void WarnAboutLengths(const std::vector<TomlTable>& joints, const model::Robot& robot) {
  const double longest_m = LongestLength(robot);
  struct SuspectLength {
    const TomlTable* table;
    const char* key;
    double length_m;
  };
  std::vector<SuspectLength> suspects;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const model::Joint& joint = robot.joints[i];
    if (CouldBeMetres(joint.a_m, longest_m)) suspects.push_back({&joints[i], "a_mm", joint.a_m});
    if (CouldBeMetres(joint.d_m, longest_m)) suspects.push_back({&joints[i], "d_mm", joint.d_m});
  }
  if (suspects.size() > kMaxSuspectLengths) return;
  for (const SuspectLength& suspect : suspects) {
    suspect.table->AddWarning(
        suspect.key,
        fmt::format(
            "is less than {:g} mm on an arm whose longest length is {:.0f} mm; it "
            "looks like metres: if so, write {:.6g}; an imported or calibrated arm may have "
            "such a length",
            kMetresWritten_m / kMetrePerMm, longest_m / kMetrePerMm,
            suspect.length_m / kMetrePerMm * 1e3));
  }
}

/// Warns about a centre of mass within two millimetres of the frame at the far end of its link.
void WarnAboutCentres(const std::vector<TomlTable>& joints, const model::Robot& robot) {
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const model::Joint& joint = robot.joints[i];
    const double length_m = std::hypot(joint.a_m, joint.d_m);
    if (!joint.link_com_m || length_m < kShortestPart_m) continue;
    const Vec3& com_m = *joint.link_com_m;
    const bool metres = com_m.norm() > 0 && com_m.norm() < kMetresWritten_m &&
                        ReadAsMetres(com_m.norm()) >= kShortestPart_m &&
                        ReadAsMetres(com_m.norm()) <= length_m + LongestLength(robot);
    if (!metres) continue;
    const Vec3 meant_mm = com_m / kMetrePerMm * 1e3;
    joints[i].AddWarning(
        "link_com_mm",
        fmt::format("puts the centre of mass of a link of {:.0f} mm within {:.2g} mm of its far "
                    "end; it looks like metres: write [{:.6g}, {:.6g}, {:.6g}]",
                    length_m / kMetrePerMm, com_m.norm() / kMetrePerMm, meant_mm.x(), meant_mm.y(),
                    meant_mm.z()));
  }
}

/// Warns about a centre of mass that is farther from the frame of its link than the stretched arm
/// is long; robots with sliding axes may have longer links than their table shows.
void WarnAboutFarCentres(const std::vector<TomlTable>& joints, const model::Robot& robot) {
  constexpr double kLongestLink_m = 10;
  double stretched_m = 0;
  for (const model::Joint& joint : robot.joints) {
    stretched_m += std::hypot(joint.a_m, joint.d_m);
  }
  const double farthest_m = IsArm(robot) ? stretched_m : std::max(kLongestLink_m, stretched_m);
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const std::optional<Vec3>& com_m = robot.joints[i].link_com_m;
    if (!com_m || com_m->norm() <= farthest_m) continue;
    joints[i].AddWarning(
        "link_com_mm",
        fmt::format("puts the centre of mass {:.3g} m from the frame of its link; the lengths of "
                    "the whole arm add up to {:.3g} m. Probably the unit is wrong; write mm, in "
                    "the frame of the link",
                    com_m->norm(), stretched_m));
  }
}

void WarnAboutMasses(const std::vector<TomlTable>& joints, const model::Robot& robot,
                     const ArmSize& size) {
  double total_kg = 0;
  for (const model::Joint& joint : robot.joints) total_kg += joint.link_mass_kg.value_or(0);
  const bool all =
      std::all_of(robot.joints.begin(), robot.joints.end(),
                  [](const model::Joint& joint) { return joint.link_mass_kg.has_value(); });
  if (total_kg == 0) return;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double mass_kg = robot.joints[i].link_mass_kg.value_or(0);
    if (!all || mass_kg <= kHeaviestLink * (total_kg - mass_kg)) continue;
    return joints[i].AddWarning(
        "link_mass_kg",
        fmt::format("is {:.2g} times the mass of all other links ({:.3g} kg); "
                    "write kg; if it is grams, write {:.6g}",
                    mass_kg / (total_kg - mass_kg), total_kg - mass_kg, 1e-3 * mass_kg));
  }
  const double cube_m3 = std::pow(size.reach_m, 3);
  const bool heavy = total_kg > kHeaviestArm * cube_m3;
  if (!heavy && !(all && total_kg < kLightestArm * cube_m3)) return;
  joints[0].AddWarning(
      "link_mass_kg",
      fmt::format("and those of the other joints add up to {:.4g} kg; arms that reach {:.2f} m "
                  "weigh {:.2g} to {:.2g} kg. Check that the masses are in kg and of this arm",
                  total_kg, size.reach_m, kLightestArm * cube_m3, kHeaviestArm * cube_m3));
}

void WarnAboutCompliances(const std::vector<TomlTable>& joints, const model::Robot& robot,
                          const ArmSize& size) {
  if (!size.link_torque) return;
  const double most_Nm = size.link_torque->maxCoeff();
  if (most_Nm <= 0) return;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const double compliance = robot.joints[i].compliance_rad_per_Nm.value_or(0);
    if (compliance <= 0) continue;
    const double own_Nm = (*size.link_torque)[static_cast<Eigen::Index>(i)];
    const bool carries = own_Nm >= kCarriesGravity * most_Nm;
    const double torque_Nm = kGrossTorque * (carries ? own_Nm : most_Nm);
    const double windup_rad = compliance * torque_Nm;
    const bool soft = windup_rad > (carries ? kSoftest_rad : kSoftestOther_rad);
    if (!soft && windup_rad >= kStiffest_rad) continue;
    joints[i].AddWarning(
        "compliance_rad_per_Nm",
        fmt::format("winds this axis up by {:.3g} mrad at {:.3g} N m, {}; typical are 1 to 7 "
                    "mrad, at most {:g}. Probably the unit is wrong (too {}: Nm/rad inverted, kNm, "
                    "mNm, arcmin?); write rad/(N m), about {:.1g}",
                    1e3 * windup_rad, torque_Nm,
                    carries ? "its largest gravity torque with a rated payload"
                            : "the arm's largest gravity torque",
                    1e3 * (carries ? kSoftest_rad : kSoftestOther_rad), soft ? "soft" : "stiff",
                    2.8e-3 / torque_Nm));
  }
}

void WarnAboutHeavyPayload(const TomlTable& table, const char* key, double mass_kg, double tool_kg,
                           const ArmSize& size) {
  const double rated_kg = size.RatedLoad_kg();
  if (mass_kg + tool_kg <= kOverload * rated_kg || mass_kg == 0) return;
  table.AddWarning(
      key, fmt::format(
               "{} more than twice the {:.3g} kg that an arm of {:.2f} m{} is rated for; "
               "check the payload, its unit (kg), and that [robot] describes this arm",
               tool_kg > 0 ? fmt::format("together with the tool's {:.3g} kg is", tool_kg) : "is",
               rated_kg, size.reach_m, size.link_torque ? " with these link masses" : ""));
}

}  // namespace

double ArmSize::RatedLoad_kg() const {
  if (!link_torque) return kHeaviestLoad_kg_m3 * std::pow(reach_m, 3);
  return link_torque->maxCoeff() / (kStandardGravity_m_s2 * reach_m);
}

ArmSize ArmSizeOf(const model::Robot& robot) {
  model::CellModel bare;
  bare.robot = robot;
  const kinematics::Chain chain(robot);
  const loads::GravityLoads loads(bare);
  const Vec3 g_B = robot.X_WB.R.transpose() * robot.g_W;
  const int n = chain.size();
  model::JointVector most = model::JointVector::Zero(n), reach = model::JointVector::Zero(n), tau;
  const model::JointVector zero = model::JointVector::Zero(n);
  kinematics::Posture posture;
  for (int k = 0; k < kSampledPostures; ++k) {
    chain.Evaluate(kinematics::RestartPosture(chain, zero, kFirstSpread + k), posture);
    loads.Torques<double>(posture, g_B, {}, tau);
    for (int i = 0; i < n; ++i) {
      const Vec3 away = posture.X_BF().p - posture.point_B[static_cast<std::size_t>(i)];
      reach[i] = std::max(reach[i], away.norm());
      if (chain.type(i) == model::JointType::kRevolute)
        most[i] = std::max(most[i], std::abs(tau[i]));
    }
  }
  ArmSize size;
  Eigen::Index carrier = n > 1 ? 1 : 0;
  if (loads.known(0) && robot.g_W.norm() > 0 && most.maxCoeff(&carrier) > 0) {
    size.link_torque = most;
  }
  size.reach_m = reach[carrier];
  return size;
}

void WarnAboutUnlikelyParts(const std::vector<TomlTable>& joints, const model::Robot& robot) {
  if (robot.size() > model::kMaxJoints) return;
  WarnAboutLengths(joints, robot);
  WarnAboutCentres(joints, robot);
  WarnAboutFarCentres(joints, robot);
  if (!IsArm(robot)) return;
  const ArmSize size = ArmSizeOf(robot);
  WarnAboutMasses(joints, robot, size);
  WarnAboutCompliances(joints, robot, size);
}

void WarnAboutLongTool(const TomlTable& root, const model::CellModel& cell) {
  const std::vector<TomlTable> tools = root.TableOrTables("tool");
  if (!IsArm(cell.robot)) return;
  const double reach_m = ArmSizeOf(cell.robot).reach_m;
  for (int k = 0; k < std::min(static_cast<int>(tools.size()), cell.tools()); ++k) {
    const model::Tool& tool = cell.ToolAt(k);
    const double tool_m = tool.tcp_F.norm();
    if (reach_m == 0 || tool_m <= kLongestTool * reach_m) continue;
    tools[static_cast<std::size_t>(k)].AddWarning(
        tool.rigid ? "tcp_mm" : "length_mm",
        fmt::format("gives a tool of {:.4g} m on an arm that reaches {:.3g} m; check that it is in "
                    "mm",
                    tool_m, reach_m));
  }
}

void WarnAboutHeavyPayloads(const TomlTable& root, const MachineConfig& config) {
  const model::CellModel& cell = config.cell;
  if (!IsArm(cell.robot)) return;
  const ArmSize size = ArmSizeOf(cell.robot);
  if (size.reach_m == 0) return;
  const double tool_kg = loads::GravityLoads(cell).tool_mass_kg();
  if (const auto payload = root.Table("payload")) {
    const bool fixed = config.payload.source == PayloadPolicy::Source::kFixed;
    if (fixed)
      WarnAboutHeavyPayload(*payload, "mass_kg", config.payload.fixed.mass_kg, tool_kg, size);
    const std::vector<TomlTable> tools = payload->Tables("tool");
    for (std::size_t k = 0; k < tools.size() && k < config.payload.table.size(); ++k) {
      WarnAboutHeavyPayload(tools[k], "mass_kg", config.payload.table[k].mass_kg, tool_kg, size);
    }
  }
  const std::vector<TomlTable> points = root.Tables("point");
  for (std::size_t k = 0; k < points.size() && k < config.points.size(); ++k) {
    WarnAboutHeavyPayload(points[k], "payload_kg", config.points[k].payload_kg.value_or(0), tool_kg,
                          size);
  }
}

}  // namespace plumbline::config
