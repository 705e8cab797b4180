#include "app/measure/urdf/right_angles.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "app/measure/urdf/chain_difference.h"
#include "app/measure/urdf/dh_table.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

constexpr int kPostures = 1000;
constexpr int kFewestDecimals = 2;
constexpr double kLeastMove_m = 1e-7;

}  // namespace

std::optional<double> RoundedRightAngle(double angle) {
  const double exact = std::round(angle / (std::numbers::pi / 2)) * (std::numbers::pi / 2);
  const std::string text = fmt::format("{}", angle);  // the shortest text of this value
  const std::size_t point = text.find('.');
  if (exact == 0 || exact == angle || point == std::string::npos) return std::nullopt;
  const auto decimals = static_cast<int>(text.size() - point) - 1;
  if (decimals < kFewestDecimals || text.find('e') != std::string::npos) return std::nullopt;
  // Rounded, it is at most half a unit of the last decimal away; cut off, less than one unit short.
  const double short_by = (std::abs(exact) - std::abs(angle)) * std::pow(10.0, decimals);
  return short_by >= -0.5 && short_by < 1 ? std::optional(exact) : std::nullopt;
}

std::optional<config::Fault> RoundedAnglesNote(const UrdfFile& urdf, const std::string& file,
                                               const JointChain& chain, Rising rising) {
  UrdfFile meant = urdf;
  const UrdfJoint* worst = nullptr;  // as written
  double written = 0, farthest = 0;
  int count = 0;
  for (const UrdfJoint* on_chain : PathOf(urdf, chain.base, chain.tip)) {
    UrdfJoint& joint = meant.joints[static_cast<std::size_t>(on_chain - urdf.joints.data())];
    for (double& angle : joint.rpy) {
      const std::optional<double> exact = RoundedRightAngle(angle);
      if (!exact) continue;
      ++count;
      if (std::abs(*exact - angle) > farthest) {
        farthest = std::abs(*exact - angle), written = angle, worst = on_chain;
      }
      angle = *exact;
    }
    joint.X_PJ.R = RotationFromRollPitchYaw(joint.rpy);
  }
  if (worst == nullptr) return std::nullopt;
  config::FaultList known;
  const auto exact = ChainFromUrdf(meant, file, chain.base, chain.tip, rising, known);
  if (!exact) return std::nullopt;
  ChainDifference moved;
  for (const model::JointVector& q : RandomPostures(RobotFromChain(chain), kPostures)) {
    moved.Add(TipPose(chain, q), TipPose(*exact, q));
  }
  if (moved.distance_m < kLeastMove_m) return std::nullopt;
  return config::Fault{
      config::Fault::Severity::kWarning, file, worst->line, "joint " + worst->name + ".origin.rpy",
      fmt::format(
          "{} looks like a rounded right angle{}. Converted as written; if exact right angles are "
          "meant, the flange is up to {:.2g} mm and {:.2g} deg away: write {:.17g}",
          written, count == 1 ? "" : fmt::format(", one of {} on the way to {}", count, chain.tip),
          kMmPerMetre * moved.distance_m, kDegPerRad * moved.angle_rad,
          *RoundedRightAngle(written))};
}

}  // namespace plumbline::measure
