#include "app/programs/brands/rapid_posture.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "firmware-like/geometry/units.h"
#include "firmware-like/kinematics/inverse.h"

namespace plumbline::programs::rapid {

namespace {

constexpr double kQuarter = 90 * kRadPerDeg;
/// A taught pose is rounded, and its joints on a nominal arm differ a little: what lies this close
/// to a limit between two configurations may be either.
constexpr double kMargin_rad = 0.1 * kRadPerDeg;
constexpr double kMargin_m = 1e-3;

/// The quantities whose signs make cfx.
struct Sides {
  double front_m;      ///< of the wrist centre in front of axis 1
  double lower_arm_m;  ///< of the wrist centre in front of the lower arm
  double axis_5_rad;
};

/// The point of axis 4 that is nearest to axis 5.
Vec3 WristCentre(const kinematics::Posture& posture) {
  const Vec3 a = posture.axis_B[3], b = posture.axis_B[4];
  const Vec3 between = posture.point_B[4] - posture.point_B[3];
  const double cosine = a.dot(b);
  const double along = (between.dot(a) - between.dot(b) * cosine) / (1 - cosine * cosine);
  return posture.point_B[3] + along * a;
}

std::optional<Sides> SidesOf(const kinematics::Chain& chain, const model::JointVector& q) {
  if (chain.size() != 6 || q.size() != 6) return std::nullopt;
  for (int i = 0; i < 6; ++i) {
    if (chain.type(i) != model::JointType::kRevolute) return std::nullopt;
  }
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  const Vec3 &axis_1 = posture.axis_B[0], &axis_2 = posture.axis_B[1];
  constexpr double kParallel = 0.999, kSquare = 0.05;
  // Axes 2 and 3 are parallel, axes 4 and 5 meet at right angles: an arm with a wrist centre.
  if (std::abs(axis_2.dot(posture.axis_B[2])) < kParallel ||
      std::abs(posture.axis_B[3].dot(posture.axis_B[4])) > kSquare) {
    return std::nullopt;
  }
  const Vec3 wrist = WristCentre(posture);
  // Axis 2 leans the arm forward when it turns in its positive direction.
  const Vec3 forward = axis_2.cross(axis_1).normalized();
  const Vec3 lower_arm = posture.point_B[2] - posture.point_B[1];
  const Vec3 in_front = axis_2.cross(lower_arm);
  if (!(in_front.norm() > kMargin_m)) return std::nullopt;
  return Sides{forward.dot(wrist - posture.point_B[0]),
               in_front.normalized().dot(wrist - posture.point_B[1]), q[4]};
}

/// Whether posture `sides` may have this cfx, with the margins above.
bool MayHave(const Sides& sides, int cfx) {
  const auto on_side = [](double value, bool negative, double margin) {
    return negative ? value < margin : value > -margin;
  };
  return cfx >= 0 && cfx < 8 && on_side(sides.front_m, cfx & 4, kMargin_m) &&
         on_side(sides.lower_arm_m, cfx & 2, kMargin_m) &&
         on_side(sides.axis_5_rad, cfx & 1, kMargin_rad);
}

std::optional<int> WholeNumber(const std::string& text) {
  double value = 0;  // the controller also writes 0.0 or -1E0
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc{} || read.ptr != text.data() + text.size() || std::abs(value) > 1e6 ||
      value != std::round(value)) {
    return std::nullopt;
  }
  return static_cast<int>(value);
}

/// The joint whose quarter turns a field counts; -1 for cfx.
int JointOf(const std::string& key) {
  return key == "cf1" ? 0 : key == "cf4" ? 3 : key == "cf6" ? 5 : -1;
}

bool InQuarter(double q_rad, int quarter) {
  return q_rad > quarter * kQuarter - kMargin_rad && q_rad < (quarter + 1) * kQuarter + kMargin_rad;
}

/// Whether cf1, cf4 and cf6 may be those of a posture.
bool QuartersAgree(const Configuration& stated, const model::JointVector& q) {
  return std::all_of(stated.fields.begin(), stated.fields.end(), [&](const auto& field) {
    const int joint = JointOf(field.key);
    const auto number = WholeNumber(field.text);
    return joint < 0 || joint >= q.size() || !number || InQuarter(q[joint], *number);
  });
}

std::optional<int> StatedCfx(const Configuration& stated) {
  for (const auto& field : stated.fields) {
    if (field.key == "cfx") return WholeNumber(field.text);
  }
  return std::nullopt;
}

/// Whether another posture of the same flange pose agrees with cf1, cf4 and cf6.
bool AnotherAgrees(const Configuration& stated, const kinematics::Chain& chain,
                   const model::JointVector& q) {
  constexpr int kStarts = 24, kIterations = 60;
  constexpr double kSame_rad = 1e-4;
  kinematics::Posture at_q;
  chain.Evaluate(q, at_q);
  const kinematics::PoseTarget target{at_q.X_BF()};
  const auto flange = [&](const model::JointVector& theta, kinematics::Posture& posture) {
    chain.Evaluate(theta, posture);
    return posture.X_BF();
  };
  for (int start = 0; start < kStarts; ++start) {
    model::JointVector other = kinematics::RestartPosture(chain, q, start);
    if (!kinematics::SolvePose(chain, target, flange, kIterations, other).converged) continue;
    kinematics::WrapIntoLimits(chain, q, other);
    // The same posture with whole turns of axis 4 or 6 has other quarters.
    if ((other - q).cwiseAbs().maxCoeff() > kSame_rad && QuartersAgree(stated, other)) return true;
  }
  return false;
}

/// Whether the stated cfx means this posture, whose quarters are those of `quarters`.
bool CfxMeans(int cfx, const Configuration& quarters, const kinematics::Chain& chain,
              const model::JointVector& q) {
  const auto sides = SidesOf(chain, q);
  if (!sides || MayHave(*sides, cfx)) return true;
  return !AnotherAgrees(quarters, chain, q);
}

}  // namespace

std::optional<int> CfxOf(const kinematics::Chain& chain, const model::JointVector& q) {
  const auto sides = SidesOf(chain, q);
  if (!sides) return std::nullopt;
  return (sides->front_m < 0 ? 4 : 0) + (sides->lower_arm_m < 0 ? 2 : 0) +
         (sides->axis_5_rad < 0 ? 1 : 0);
}

bool AgreesWithConfdata(const Configuration& stated, const kinematics::Chain& chain,
                        const model::JointVector& q) {
  if (!QuartersAgree(stated, q)) return false;
  const auto cfx = StatedCfx(stated);
  return !cfx || CfxMeans(*cfx, stated, chain, q);
}

std::vector<std::string> ConfdataOf(const Configuration& stated, const kinematics::Chain& chain,
                                    const model::JointVector& q) {
  std::vector<std::string> texts;
  Configuration quarters = stated;
  for (auto& field : quarters.fields) {
    const int joint = JointOf(field.key);
    const auto number = WholeNumber(field.text);
    if (joint >= 0 && joint < q.size() && number && !InQuarter(q[joint], *number)) {
      field.text = std::to_string(static_cast<int>(std::floor(q[joint] / kQuarter)));
    }
  }
  for (const auto& field : quarters.fields) {
    const auto cfx = field.key == "cfx" ? WholeNumber(field.text) : std::nullopt;
    const auto now = cfx && !CfxMeans(*cfx, quarters, chain, q) ? CfxOf(chain, q) : std::nullopt;
    texts.push_back(now ? std::to_string(*now) : field.text);
  }
  return texts;
}

}  // namespace plumbline::programs::rapid
