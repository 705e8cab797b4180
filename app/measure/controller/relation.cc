#include "app/measure/controller/relation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

using Kind = RelationKind;

constexpr std::array<const char*, kRelationKinds> kNames = {"nominal",
                                                            "measurement_frame",
                                                            "factory_table",
                                                            "rounded_table",
                                                            "table_value",
                                                            "adjusted_table",
                                                            "length_scale",
                                                            "cell_deflection",
                                                            "joint_compliance",
                                                            "hidden_tool",
                                                            "other_tool",
                                                            "flange",
                                                            "base",
                                                            "mirrored_axis",
                                                            "joint_unit",
                                                            "length_unit",
                                                            "angle_unit",
                                                            "coupling",
                                                            "zero_offset",
                                                            "axis_sign",
                                                            "joint_order",
                                                            "angle_convention",
                                                            "inverse_rotation",
                                                            "inverse_pose",
                                                            "quaternion_order",
                                                            "time_shift"};

// Prior standard deviations: how large what happens in practice is.
constexpr double kTableLength_m = 3e-3, kTableAngle = 3e-3;  // calibrations of single arms
constexpr double kOneLength_m = 0.05;
constexpr double kScale = 1e-2;
constexpr double kZero = 1.0;
constexpr double kRatio = 1.0;
constexpr double kToolPlace_m = 0.2, kBasePlace_m = 1.0, kFrameTurn = 1.5;
constexpr double kLead_s = 0.1;
constexpr double kSag_m = 1e-2;  // tip displacement by one joint's compliance

constexpr int kTableParameters = 5;    // a, d, alpha, theta, beta of a joint
constexpr double kParallelAxes = 0.5;  // sine of the angle between two axes: 30 deg

/// Prior standard deviations of a calibrated table: four values of a joint determine the next axis.
/// Between parallel axes beta takes the place of d, which is that of the next joint; elsewhere beta
/// is a turn of the joint before or after it [S. Hayati, IEEE CDC (1983) 1477]. The frame beyond
/// the last axis, or in modified tables before the first one, has no such neighbour and keeps all
/// five.
std::vector<double> TablePrior(const model::Robot& robot) {
  const auto n = robot.joints.size();
  const bool modified = robot.convention == model::DhConvention::kProximal;
  std::vector<double> all;
  for (std::size_t i = 0; i < n; ++i) {
    const bool outermost = modified ? i == 0 : i + 1 == n;
    const bool parallel = std::abs(std::sin(robot.joints[i].alpha_rad)) < kParallelAxes;
    all.insert(all.end(),
               {kTableLength_m, outermost || !parallel ? kTableLength_m : kFixedValue, kTableAngle,
                kTableAngle, outermost || parallel ? kTableAngle : kFixedValue});
  }
  return all;
}

double Radius(const RelationContext& context) {
  return context.arm.chain().Reach() + deflection::FarthestTip_F(context.cell).norm();
}

bool Revolute(const RelationContext& context, int joint) {
  return context.arm.chain().type(joint) == model::JointType::kRevolute;
}

double Rounded(double value, double step) {
  return step * std::round(value / step);
}

/// Torques of the joints in a posture of a changed robot [N m].
model::JointVector TorquesAt(const RelationContext& context, const kinematics::Chain& chain,
                             const model::JointVector& q, const loads::Payload& payload) {
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  model::JointVector tau;
  const model::Robot& robot = context.cell.robot;
  context.arm.loads().Torques<double>(posture, robot.X_WB.R.transpose() * robot.g_W, payload, tau);
  return tau;
}

/// Largest torque of each joint in the postures of the sample.
model::JointVector LargestTorques(const RelationContext& context, const ControllerSample& sample) {
  model::JointVector largest = model::JointVector::Zero(context.cell.robot.size());
  for (const ControllerPosture& posture : sample.postures) {
    const model::JointVector tau =
        TorquesAt(context, context.arm.chain(), posture.q, LoadOf(posture));
    largest = largest.cwiseMax(tau.cwiseAbs());
  }
  return largest;
}

bool HasPayload(const ControllerSample& sample) {
  return std::all_of(sample.postures.begin(), sample.postures.end(),
                     [](const ControllerPosture& posture) { return posture.payload.has_value(); });
}

void AddOrders(int joints, std::vector<Relation>& all) {
  const auto add = [&](const std::vector<int>& order) {
    const auto same = [&](const Relation& one) { return one.order == order; };
    if (std::none_of(all.begin(), all.end(), same))
      all.push_back({.kind = Kind::kJointOrder, .order = order});
  };
  std::vector<int> plain(static_cast<std::size_t>(joints));
  std::iota(plain.begin(), plain.end(), 0);
  for (std::size_t i = 0; i < plain.size(); ++i) {
    for (std::size_t j = i + 1; j < plain.size(); ++j) {
      std::vector<int> order = plain;
      std::swap(order[i], order[j]);
      add(order);
    }
  }
  for (const int by : {1, joints - 1}) {
    std::vector<int> order = plain;
    std::rotate(order.begin(), order.begin() + by, order.end());
    add(order);
  }
  add({plain.rbegin(), plain.rend()});
}

void AddOfJoints(const RelationContext& context, std::vector<Relation>& all) {
  const int n = context.cell.robot.size();
  for (int i = 0; i < n; ++i) {
    all.push_back({.kind = Kind::kZeroOffset, .joint = i});
    all.push_back({.kind = Kind::kAxisSign, .joint = i});
    for (int which = 0; which < 2; ++which)
      all.push_back({.kind = Kind::kTableValue, .joint = i, .other = which});
    for (int j = 0; j < n; ++j) {
      if (i == j || !Revolute(context, i) || !Revolute(context, j)) continue;
      std::vector<model::JointCoupling> couplings = context.cell.robot.couplings;
      couplings.push_back({i, j, 1.0});
      if (std::ssize(kinematics::CouplingOrder(n, couplings)) == n)  // no cycle
        all.push_back({.kind = Kind::kCoupling, .joint = i, .other = j});
    }
  }
}

/// Whether a relation changes the arm, which the cell's own deflection is computed with.
bool OfArm(Kind kind) {
  constexpr std::array kKinds = {Kind::kFactoryTable,  Kind::kRoundedTable, Kind::kTableValue,
                                 Kind::kAdjustedTable, Kind::kLengthScale,  Kind::kCoupling,
                                 Kind::kZeroOffset,    Kind::kAxisSign};
  return std::find(kKinds.begin(), kKinds.end(), kind) != kKinds.end();
}

}  // namespace

std::string RelationNames(const std::vector<Relation>& relations) {
  std::vector<std::string> names;
  for (const Relation& one : relations) {
    std::string& name = names.emplace_back(NameOf(one.kind));
    if (one.joint >= 0) name += fmt::format(" {}", one.joint + 1);
    if (one.other >= 0) name += fmt::format("{}{}", one.joint >= 0 ? " of " : " ", one.other + 1);
    if (one.value != 0) name += fmt::format(" {:g}", one.value);
    if (!one.order.empty()) name += fmt::format(" {}", fmt::join(one.order, " "));
  }
  return fmt::format("{}", fmt::join(names, ", "));
}

loads::Payload LoadOf(const ControllerPosture& posture) {
  loads::Payload payload = posture.payload.value_or(loads::Payload());
  payload.tool = posture.tool;
  return payload;
}

Pose ToolOf(const ControllerPosture& posture, const RelationContext& context) {
  if (posture.of_flange) return Pose();
  return posture.X_FT.value_or(context.arm.X_FT(posture.tool));
}

const char* NameOf(RelationKind kind) {
  return kNames[static_cast<std::size_t>(kind)];
}

RelationContext::RelationContext(const model::CellModel& cell_in) : cell(cell_in), arm(cell) {}

std::vector<Relation> RelationsOf(const RelationContext& context, const ControllerSample& sample) {
  const model::CellModel& cell = context.cell;
  std::vector<Relation> all = {{.kind = Kind::kNominal}};
  const bool moved_base =
      cell.robot.X_WB.p.norm() > 1e-9 || VectorFromRotation(cell.robot.X_WB.R).norm() > 1e-9;
  if (moved_base) all.push_back({.kind = Kind::kDeclaredFrame});
  if (context.factory) all.push_back({.kind = Kind::kFactoryTable});
  for (const double step : {1e-4, 5e-4, 1e-3, 5e-3, 1e-2})
    all.push_back({.kind = Kind::kRoundedTable, .value = step});
  all.push_back({.kind = Kind::kAdjustedTable});
  all.push_back({.kind = Kind::kLengthScale});
  const bool deflects = std::any_of(cell.robot.joints.begin(), cell.robot.joints.end(),
                                    [](const model::Joint& joint) {
                                      return joint.compliance_rad_per_Nm.has_value();
                                    }) ||
                        cell.any_tool_bends() || !cell.effects.empty();
  if (deflects && !context.arm.torques_missing() && (HasPayload(sample) || !cell.payload_cog_F))
    all.push_back({.kind = Kind::kCellDeflection});
  if (context.arm.loads().known(0) || context.arm.loads().known(1))
    all.push_back({.kind = Kind::kJointCompliance});
  all.push_back({.kind = Kind::kHiddenTool});
  all.push_back({.kind = Kind::kBase});
  const auto in_any = [&](auto&& holds) {
    return std::any_of(sample.postures.begin(), sample.postures.end(), holds);
  };
  for (int tool = 0; tool < cell.tools(); ++tool) {
    if (in_any([tool](const ControllerPosture& posture) {
          return tool != posture.tool || posture.X_FT || posture.of_flange;
        })) {
      all.push_back({.kind = Kind::kOtherTool, .other = tool});
    }
  }
  if (in_any([](const ControllerPosture& posture) { return !posture.of_flange; }))
    all.push_back({.kind = Kind::kFlange});
  for (int axis = 0; axis < 3; ++axis) all.push_back({.kind = Kind::kMirroredAxis, .other = axis});
  for (const double factor : {kRadPerDeg, kDegPerRad})
    all.push_back({.kind = Kind::kJointUnit, .value = factor});
  for (const double factor : {1e3, 1e-3, 25.4, 1 / 25.4})
    all.push_back({.kind = Kind::kLengthUnit, .value = factor});
  if (sample.with_orientation) {
    for (const double factor : {kRadPerDeg, kDegPerRad}) {
      if (sample.convention >= 0) all.push_back({.kind = Kind::kAngleUnit, .value = factor});
    }
    for (int k = 0; sample.convention >= 0 && k < std::ssize(AngleConventions()); ++k) {
      if (k != sample.convention) all.push_back({.kind = Kind::kAngleConvention, .other = k});
    }
    if (sample.convention < 0) all.push_back({.kind = Kind::kQuaternionOrder});
    all.push_back({.kind = Kind::kInverseRotation});
    all.push_back({.kind = Kind::kInversePose});
  }
  AddOfJoints(context, all);
  AddOrders(cell.robot.size(), all);
  const bool moving = std::all_of(
      sample.postures.begin(), sample.postures.end(),
      [](const ControllerPosture& posture) { return posture.qd.size() == posture.q.size(); });
  if (moving) all.push_back({.kind = Kind::kTimeShift});
  return all;
}

RelationParameters ParametersOf(const Relation& relation, const RelationContext& context,
                                const ControllerSample& sample) {
  const int n = context.cell.robot.size();
  const auto zeros = [](std::size_t count) {
    return std::vector<std::vector<double>>{std::vector<double>(count, 0.0)};
  };
  switch (relation.kind) {
    case Kind::kTableValue:
      return {{kOneLength_m}, zeros(1)};
    case Kind::kAdjustedTable: {
      RelationParameters all{TablePrior(context.cell.robot), {}};
      all.starts = zeros(all.prior_sd.size());
      return all;
    }
    case Kind::kLengthScale:
      return {{kScale}, zeros(1)};
    case Kind::kJointCompliance: {
      const model::JointVector largest = LargestTorques(context, sample);
      RelationParameters all;
      for (int i = 0; i < n; ++i) {
        const bool usable = context.arm.loads().known(i) && largest[i] > 0.5;
        all.prior_sd.push_back(usable ? kSag_m / Radius(context) / largest[i] : kFixedValue);
      }
      all.starts = zeros(all.prior_sd.size());
      return all;
    }
    case Kind::kHiddenTool:
    case Kind::kBase: {
      const double place_m = relation.kind == Kind::kBase ? kBasePlace_m : kToolPlace_m;
      return {{place_m, place_m, place_m, kFrameTurn, kFrameTurn, kFrameTurn}, zeros(6)};
    }
    case Kind::kCoupling:
      return {{kRatio}, {{1.0}, {-1.0}, {0.5}, {-0.5}, {0.0}}};
    case Kind::kZeroOffset: {
      RelationParameters all{{Revolute(context, relation.joint) ? kZero : kBasePlace_m}, {}};
      constexpr int kDirections = 24;
      for (int k = 0; k < kDirections; ++k) {
        all.starts.push_back(
            {std::remainder(2 * std::numbers::pi * k / kDirections, 2 * std::numbers::pi)});
        if (!Revolute(context, relation.joint)) break;
      }
      return all;
    }
    case Kind::kTimeShift:
      return {{kLead_s}, zeros(1)};
    default:
      return {{}, zeros(0)};
  }
}

ControllerModel NominalModel(const RelationContext& context) {
  ControllerModel model;
  model.robot = context.cell.robot;
  return model;
}

void Apply(const Relation& relation, std::span<const double> values, const RelationContext& context,
           const ControllerSample& sample, ControllerModel& model) {
  std::vector<model::Joint>& joints = model.robot.joints;
  model::Joint* const joint =
      relation.joint >= 0 ? &joints[static_cast<std::size_t>(relation.joint)] : nullptr;
  const auto frame = [&values] {
    return Pose{RotationFromVector(Vec3(values[3], values[4], values[5])),
                Vec3(values[0], values[1], values[2])};
  };
  switch (relation.kind) {
    case Kind::kNominal:
      break;
    case Kind::kDeclaredFrame:
      model.X_RB = model.X_RB * context.cell.robot.X_WB;
      break;
    case Kind::kFactoryTable: {
      const model::Robot& table = *context.factory;
      model.X_RB = model.X_RB * table.X_WB;
      model.robot.convention = table.convention;
      for (std::size_t i = 0; i < joints.size(); ++i) {
        const model::Joint before = joints[i];
        joints[i] = table.joints[i];
        joints[i].link_mass_kg = before.link_mass_kg;
        joints[i].link_com_m = before.link_com_m;
      }
      break;
    }
    case Kind::kRoundedTable:
      for (model::Joint& one : joints) {
        one.a_m = Rounded(one.a_m, relation.value);
        one.d_m = Rounded(one.d_m, relation.value);
      }
      break;
    case Kind::kTableValue:
      (relation.other == 0 ? joint->a_m : joint->d_m) += values[0];
      break;
    case Kind::kAdjustedTable:
      for (std::size_t i = 0; i < joints.size(); ++i) {
        const auto value = values.subspan(i * kTableParameters, kTableParameters);
        joints[i].a_m += value[0];
        joints[i].d_m += value[1];
        joints[i].alpha_rad += value[2];
        joints[i].theta_offset_rad += value[3];
        joints[i].beta_rad += value[4];
      }
      break;
    case Kind::kLengthScale:
      for (model::Joint& one : joints) {
        one.a_m *= 1 + values[0];
        one.d_m *= 1 + values[0];
      }
      break;
    case Kind::kCellDeflection:
      model.cell_deflection = true;
      break;
    case Kind::kJointCompliance:
      model.compliance.resize(std::ssize(values));
      for (std::size_t i = 0; i < values.size(); ++i)
        model.compliance[static_cast<int>(i)] = values[i];
      break;
    case Kind::kHiddenTool:
      model.X_FH = model.X_FH * frame();
      break;
    case Kind::kOtherTool:
      model.X_FT = context.arm.X_FT(relation.other);
      break;
    case Kind::kFlange:
      model.X_FT = Pose();
      break;
    case Kind::kBase:
      model.X_RB = frame() * model.X_RB;
      break;
    case Kind::kMirroredAxis:
      model.mirrored_axis = relation.other;
      break;
    case Kind::kJointUnit:
      model.joint_factor = relation.value;
      break;
    case Kind::kLengthUnit:
      model.length_factor = relation.value;
      break;
    case Kind::kAngleUnit:
      model.angle_factor = relation.value;
      break;
    case Kind::kCoupling: {
      const auto same = [&](const model::JointCoupling& one) {
        return one.joint == relation.joint && one.of == relation.other;
      };
      auto& couplings = model.robot.couplings;
      const auto found = std::find_if(couplings.begin(), couplings.end(), same);
      if (found != couplings.end()) {
        found->ratio += values[0];
      } else {
        couplings.push_back({relation.joint, relation.other, values[0]});
      }
      break;
    }
    case Kind::kZeroOffset:
      (joint->type == model::JointType::kRevolute ? joint->theta_offset_rad : joint->d_m) +=
          values[0];
      break;
    case Kind::kAxisSign:
      joint->sign = -joint->sign;
      break;
    case Kind::kJointOrder:
      model.order = relation.order;
      break;
    case Kind::kAngleConvention:
      model.convention = relation.other;
      break;
    case Kind::kInverseRotation:
      model.inverse_rotation = true;
      break;
    case Kind::kInversePose:
      model.inverse_pose = true;
      break;
    case Kind::kQuaternionOrder:
      model.scalar_last = true;
      break;
    case Kind::kTimeShift:
      model.lead_s = values[0];
      break;
  }
  static_cast<void>(sample);
}

bool Exclude(const Relation& a, const Relation& b) {
  if (a.kind == Kind::kNominal || b.kind == Kind::kNominal) return true;
  const auto either = [&](std::initializer_list<Kind> kinds) {
    const auto has = [&](Kind kind) {
      return std::find(kinds.begin(), kinds.end(), kind) != kinds.end();
    };
    return has(a.kind) && has(b.kind);
  };
  if (a.kind == b.kind) {
    if (a.joint < 0) return true;
    return a.joint == b.joint && (a.kind != Kind::kCoupling || a.other == b.other) &&
           (a.kind != Kind::kTableValue || a.other == b.other);
  }
  return either({Kind::kFactoryTable, Kind::kRoundedTable, Kind::kTableValue, Kind::kAdjustedTable,
                 Kind::kLengthScale}) ||
         either({Kind::kCellDeflection, Kind::kJointCompliance}) ||
         either({Kind::kHiddenTool, Kind::kOtherTool, Kind::kFlange}) ||
         either({Kind::kBase, Kind::kDeclaredFrame}) ||
         either({Kind::kAngleConvention, Kind::kInverseRotation, Kind::kInversePose,
                 Kind::kQuaternionOrder}) ||
         (a.kind == Kind::kCellDeflection && OfArm(b.kind)) ||
         (b.kind == Kind::kCellDeflection && OfArm(a.kind));
}

}  // namespace plumbline::measure
