#include <catch2/catch.hpp>
#include <cmath>

#include "firmware-like/beam/beam.h"
#include "firmware-like/motion/motion_observer.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::dynamic_deflection_test {

using motion::DynamicDeflection;
using motion::DynamicModel;
using motion::JointMotion;

namespace {

constexpr double kStep_s = 1e-4, kTurn_rad = 1e-6;

JointMotion MotionAt(const model::JointVector& q, const model::JointVector& qd,
                     const model::JointVector& qdd) {
  JointMotion motion;
  motion.q = q;
  motion.qd = qd;
  motion.qdd = qdd;
  motion.qdd_covariance = motion::JointMatrix::Identity(q.size(), q.size());
  motion.freedom = 10;
  return motion;
}

struct PointMass {
  double kg;
  int link;  ///< counted from 0
  Vec3 p_L;
};

/// Links, tool in 200 slices, and payload.
std::vector<PointMass> MassesOf(const model::CellModel& cell, const loads::Payload& payload) {
  std::vector<PointMass> masses;
  const int last = cell.robot.size() - 1;
  for (int i = 0; i <= last; ++i) {
    const model::Joint& joint = cell.robot.joints[static_cast<std::size_t>(i)];
    masses.push_back({*joint.link_mass_kg, i, *joint.link_com_m});
  }
  const model::ToolSegment& tool = cell.tool.segments.front();
  constexpr int kSlices = 200;
  const double slice_m = tool.length_m / kSlices;
  for (int k = 0; k < kSlices; ++k) {
    masses.push_back({tool.material.density_kg_m3 * tool.section.area_m2 * slice_m, last,
                      Vec3(0, 0, (k + 0.5) * slice_m)});
  }
  masses.push_back({cell.tool.mount_mass_kg, last, Vec3(0, 0, tool.length_m / 2)});
  masses.push_back({payload.mass_kg, last, payload.cog_F});
  return masses;
}

Vec3 PlaceOf(const kinematics::Chain& chain, const PointMass& mass, const model::JointVector& q) {
  kinematics::Posture posture;
  chain.Evaluate(q, posture);
  return posture.X_BL[static_cast<std::size_t>(mass.link)] * mass.p_L;
}

/// Inertial torques by virtual work, -sum m (dp/dq_i) . (d2p/dt2), all derivatives as differences
/// of positions along the trajectory.
model::JointVector TorquesByVirtualWork(const model::CellModel& cell, const loads::Payload& payload,
                                        const JointMotion& motion) {
  const kinematics::Chain chain(cell.robot);
  const auto q_at = [&](double t) -> model::JointVector {
    return motion.q + t * motion.qd + 0.5 * t * t * motion.qdd;
  };
  model::JointVector tau = model::JointVector::Zero(motion.q.size());
  for (const PointMass& mass : MassesOf(cell, payload)) {
    const Vec3 a = (PlaceOf(chain, mass, q_at(kStep_s)) - 2 * PlaceOf(chain, mass, motion.q) +
                    PlaceOf(chain, mass, q_at(-kStep_s))) /
                   (kStep_s * kStep_s);
    for (int i = 0; i < tau.size(); ++i) {
      model::JointVector ahead = motion.q, behind = motion.q;
      ahead[i] += kTurn_rad;
      behind[i] -= kTurn_rad;
      const Vec3 along =
          (PlaceOf(chain, mass, ahead) - PlaceOf(chain, mass, behind)) / (2 * kTurn_rad);
      tau[i] -= mass.kg * along.dot(a);
    }
  }
  return tau;
}

model::JointVector Vector6(double a, double b, double c, double d, double e, double f) {
  model::JointVector v(6);
  v << a, b, c, d, e, f;
  return v;
}

struct Case {
  model::CellModel cell = test::HeavyArm();
  loads::Payload payload{60, Vec3(0.02, 0.05, 1.1)};
  JointMotion motion =
      MotionAt(Vector6(0.2, 0.4, 0.3, 0.5, 0.8, -0.4), Vector6(0.8, -0.5, 0.6, 0.3, -0.9, 0.4),
               Vector6(2.0, -1.5, 1.0, 0.7, -2.5, 3.0));

  DynamicDeflection Deflection(Mat3* covariance = nullptr) const {
    Mat3 ignored;
    return DynamicModel(cell).At(deflection::LoadedArm(cell), motion, payload, {},
                                 covariance != nullptr ? *covariance : ignored);
  }
};

}  // namespace

TEST_CASE("joints deflect by compliance times the inertial torques of virtual work") {
  const Case arm;
  const DynamicDeflection found = arm.Deflection();
  const model::JointVector tau = TorquesByVirtualWork(arm.cell, arm.payload, arm.motion);
  for (int i = 0; i < 6; ++i) {
    CAPTURE(i, tau[i]);
    const double c = *arm.cell.robot.joints[static_cast<std::size_t>(i)].compliance_rad_per_Nm;
    CHECK(found.sag[i] == Approx(c * tau[i]).epsilon(1e-3).margin(1e-10));
  }
  CHECK(found.tip_W.norm() > 1e-4);
}

TEST_CASE("a prismatic joint and base, too") {
  Case arm;
  model::Joint& slide = arm.cell.robot.joints[2];
  slide.type = model::JointType::kPrismatic;
  slide.min = -1;
  slide.max = 1;
  slide.compliance_rad_per_Nm = 2e-7;
  const DynamicDeflection found = arm.Deflection();
  const model::JointVector tau = TorquesByVirtualWork(arm.cell, arm.payload, arm.motion);
  for (int i = 0; i < 6; ++i) {
    CAPTURE(i, tau[i]);
    const double c = *arm.cell.robot.joints[static_cast<std::size_t>(i)].compliance_rad_per_Nm;
    CHECK(found.sag[i] == Approx(c * tau[i]).epsilon(1e-3).margin(1e-10));
  }
}

TEST_CASE("with rigid joints the tip moves by the bending of the accelerated beam") {
  Case arm;
  for (model::Joint& joint : arm.cell.robot.joints) joint.compliance_rad_per_Nm.reset();
  arm.motion.qd.setZero();
  const DynamicDeflection found = arm.Deflection();
  const beam::Beam tool(arm.cell.tool, 4);
  beam::BeamLoads loads;
  loads.masses = {{arm.payload.mass_kg, tool.Length(), arm.payload.cog_F}};
  loads.acceleration_F = found.acceleration_F;
  loads.angular_acceleration_F = found.angular_acceleration_F;
  const kinematics::Chain chain(arm.cell.robot);
  kinematics::Posture posture;
  chain.Evaluate(arm.motion.q, posture);
  const Vec3 expected = arm.cell.robot.X_WB.R * (posture.X_BF().R * tool.Solve(loads).Tip().d_F);
  CHECK((found.tip_W - expected).norm() < 1e-9);
  CHECK(expected.norm() > 1e-4);
}

TEST_CASE("the covariance follows the linear response") {
  Case arm;
  arm.motion.qd.setZero();
  Mat3 covariance;
  const Vec3 tip = arm.Deflection(&covariance).tip_W;
  // With unit covariance, tip = G qdd and C = G G^T: |u.tip|^2 <= (u.C u) |qdd|^2 for every u.
  const Vec3 u = tip.normalized();
  CHECK(std::pow(u.dot(tip), 2) <= u.dot(covariance * u) * arm.motion.qdd.squaredNorm() * 1.0001);
  arm.motion.qdd *= 2;
  CHECK((arm.Deflection().tip_W - 2 * tip).norm() < 1e-12);
}

TEST_CASE("an identified deflection under acceleration replaces the declared one of its joint") {
  Case arm;
  const DynamicDeflection declared = arm.Deflection();
  model::WrittenEffect effect;
  effect.id = "dynamic_inertia";
  effect.parameters.push_back({"q2", 4e-4, std::nullopt, "s^2", ""});
  arm.cell.effects = {effect};
  const DynamicDeflection found = arm.Deflection();
  CHECK(found.sag[1] == Approx(-4e-4 * arm.motion.qdd[1]));
  CHECK(found.sag[2] == Approx(declared.sag[2]));
}

}  // namespace plumbline::dynamic_deflection_test
