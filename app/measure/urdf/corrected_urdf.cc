#include "app/measure/urdf/corrected_urdf.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/config/xml_document.h"
#include "app/measure/urdf/chain_difference.h"
#include "app/measure/urdf/dh_table.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/chain.h"
#include "firmware-like/model/link_twist.h"

namespace plumbline::measure {
namespace {

constexpr int kComparedPostures = 1000;
constexpr double kSamePlace_m = 1e-6;
constexpr double kSameAngle_rad = 1e-6;
constexpr double kUnchanged = 1e-12;  // m or rad; what is below keeps its text

Pose TurnAbout(const Vec3& axis, double angle_rad) {
  return {Eigen::AngleAxisd(angle_rad, axis).toRotationMatrix(), Vec3::Zero()};
}
Pose Shift(double x, double y, double z) {
  return {Mat3::Identity(), Vec3(x, y, z)};
}
Pose Twist(const model::Joint& row) {
  return {model::LinkTwist(row), Vec3::Zero()};
}

/// K_0 .. K_n of a table: the fixed transforms before, between and after the joints.
std::vector<Pose> FixedTransforms(const model::Robot& robot, const Pose& X_base_B) {
  const auto turned = [](const model::Joint& row) {
    return TurnAbout(Vec3::UnitZ(), row.theta_offset_rad) * Shift(0, 0, row.d_m);
  };
  std::vector<Pose> K{X_base_B};
  for (const model::Joint& row : robot.joints) {
    if (robot.convention == model::DhConvention::kDistal) {
      K.push_back(turned(row) * Shift(row.a_m, 0, 0) * Twist(row));
    } else {
      // Rx(alpha) Tx(a) = Tx(a) Rx(alpha)
      K.back() = K.back() * Shift(row.a_m, 0, 0) * Twist(row) * turned(row);
      K.emplace_back();
    }
  }
  return K;
}

/// Rotations A_i from z to the direction in which the table's joint moves positively.
std::vector<Pose> AxisTurns(const JointChain& chain, const model::Robot& robot) {
  std::vector<Pose> A;
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    A.push_back(AxisFrame(robot.joints[i].sign * chain.joints[i].axis));
  }
  return A;
}

Pose FlangeAt(const model::Robot& robot, const model::JointVector& q) {
  kinematics::Posture posture;
  kinematics::Chain(robot).Evaluate(q, posture);
  return posture.X_BF();
}

/// Checks that chain and table describe one arm; returns the robot base in the base link.
Result<Pose> CommonBase(const JointChain& chain, const model::Robot& declared) {
  if (declared.joints.size() != chain.joints.size()) {
    return Error{fmt::format(
        "has {} moving joints from {} to {}, but the cell has {}; choose --base and --tip as for "
        "import-urdf",
        chain.joints.size(), chain.base, chain.tip, declared.joints.size())};
  }
  for (std::size_t i = 0; i < chain.joints.size(); ++i) {
    if (chain.joints[i].type == declared.joints[i].type) continue;
    return Error{
        fmt::format("joint {} is not of the type of the cell's joint {}; the cell must be "
                    "imported from this file",
                    chain.joints[i].name, i + 1)};
  }
  const model::JointVector zero = model::JointVector::Zero(declared.size());
  model::Robot based = declared;
  based.X_WB = TipPose(chain, zero) * FlangeAt(declared, zero).Inverse();
  const ChainDifference difference =
      DifferenceOf(chain, based, RandomPostures(declared, kComparedPostures));
  if (difference.distance_m > kSamePlace_m || difference.angle_rad > kSameAngle_rad) {
    return Error{fmt::format(
        "describes another arm than the cell: the tips are up to {:.3f} mm and {:.4f} deg apart. "
        "Export into the file that the cell was imported from, with the same --base and --tip",
        1e3 * difference.distance_m, kDegPerRad * difference.angle_rad)};
  }
  return based.X_WB;
}

MovedOrigin Moved(const UrdfJoint& joint, const Pose& X) {
  MovedOrigin moved{joint.name, X, (X.p - joint.X_PJ.p).norm(), 0};
  moved.angle_rad = VectorFromRotation(joint.X_PJ.R.transpose() * X.R).norm();
  return moved;
}

void AddIfMoved(const UrdfJoint& joint, const Pose& X, std::vector<MovedOrigin>& origins) {
  const MovedOrigin moved = Moved(joint, X);
  if (moved.distance_m > kUnchanged || moved.angle_rad > kUnchanged) origins.push_back(moved);
}

/// Distributes the corrected transforms between moving joints over the URDF's joints: fixed joints
/// stay, but for the first one after the last moving joint.
CorrectedOrigins OriginsFrom(const std::vector<const UrdfJoint*>& path, const JointChain& chain,
                             const std::vector<Pose>& between, const Pose& X_base_B) {
  CorrectedOrigins corrected{{}, 0, 0, X_base_B};
  Pose fixed;  // since the last moving joint
  std::size_t next = 0;
  const UrdfJoint* first_fixed = nullptr;
  Pose after_first;  // of the fixed joints after `first_fixed`
  for (const UrdfJoint* joint : path) {
    if (joint->Moves()) {
      const ChainJoint& of_chain = chain.joints[next];
      const Pose rising = JointMotion(of_chain.type, of_chain.axis, -of_chain.rising);
      AddIfMoved(*joint, fixed.Inverse() * between[next++] * rising, corrected.origins);
      fixed = after_first = Pose();
      first_fixed = nullptr;
      continue;
    }
    if (first_fixed != nullptr) after_first = after_first * joint->X_PJ;
    if (first_fixed == nullptr) first_fixed = joint;
    fixed = fixed * joint->X_PJ;
  }
  const Pose& X_last_tip = between[next];
  if (first_fixed != nullptr) {
    AddIfMoved(*first_fixed, X_last_tip * after_first.Inverse(), corrected.origins);
  } else {
    corrected.tip_left_m = X_last_tip.p.norm();
    corrected.tip_left_rad = VectorFromRotation(X_last_tip.R).norm();
  }
  return corrected;
}

std::string Triple(const Vec3& v) {
  std::string text;
  for (const double value : v) {
    std::string number = fmt::format("{:.13f}", value);
    number.erase(number.find_last_not_of('0') + 1);
    if (number.back() == '.') number.pop_back();
    if (number == "-0") number = "0";
    text += (text.empty() ? "" : " ") + number;
  }
  return text;
}

/// A part of a text to be replaced.
struct TextEdit {
  std::size_t at = 0, length = 0;
  std::string replacement;
};

TextEdit EditOf(const config::XmlDocument& document, std::string_view text,
                const MovedOrigin& moved) {
  const std::string tag = fmt::format("<origin xyz=\"{}\" rpy=\"{}\"", Triple(moved.X_PJ.p),
                                      Triple(RollPitchYawFromRotation(moved.X_PJ.R)));
  const pugi::xml_node joint =
      document.root().find_child_by_attribute("joint", "name", moved.joint.c_str());
  const pugi::xml_node origin = joint.child("origin");
  if (!origin) {
    const auto [at, length] = document.StartTag(joint);
    return {at + length, 0, tag + "/>"};
  }
  const auto [at, length] = document.StartTag(origin);
  const bool closed = text.substr(at, length).ends_with("/>");
  return {at, length, tag + (closed ? "/>" : ">")};
}

}  // namespace

Result<CorrectedOrigins> CorrectedOriginsOf(const UrdfFile& urdf, const JointChain& chain,
                                            const model::Robot& declared,
                                            const model::Robot& corrected) {
  const Result<Pose> base = CommonBase(chain, declared);
  if (!base) return base.failure();
  const std::vector<Pose> K = FixedTransforms(declared, *base);
  const std::vector<Pose> changed = FixedTransforms(corrected, *base);
  const std::vector<Pose> A = AxisTurns(chain, declared);
  const std::size_t n = chain.joints.size();
  std::vector<Pose> between;
  Pose S, A_before;  // S_i and A_i of the joint before
  for (std::size_t i = 0; i <= n; ++i) {
    const Pose& O = i < n ? chain.joints[i].X_prev : chain.X_last_tip;
    const Pose A_next = i < n ? A[i] : Pose();
    const Pose S_next = i < n ? K[i].Inverse() * S * A_before.Inverse() * O * A_next : Pose();
    between.push_back(A_before * S.Inverse() * changed[i] * S_next * A_next.Inverse());
    S = S_next;
    A_before = A_next;
  }
  return OriginsFrom(PathOf(urdf, chain.base, chain.tip), chain, between, *base);
}

std::string UrdfWithOrigins(std::string_view text, const std::vector<MovedOrigin>& origins) {
  config::FaultList ignored;  // the text has been read before
  const config::XmlDocument document(text, "", ignored);
  std::vector<TextEdit> edits;
  for (const MovedOrigin& moved : origins) edits.push_back(EditOf(document, text, moved));
  std::ranges::sort(edits, [](const TextEdit& a, const TextEdit& b) { return a.at > b.at; });
  std::string written(text);
  for (const TextEdit& edit : edits) written.replace(edit.at, edit.length, edit.replacement);
  return written;
}

}  // namespace plumbline::measure
