#include "firmware-like/deflection/landing_uncertainty.h"

#include <Eigen/Cholesky>
#include <catch2/catch.hpp>

#include "tests/firmware-like/test_cell.h"

namespace plumbline::landing_uncertainty_test {

using namespace plumbline::deflection;

namespace {

/// A heavy arm with identified compliances and the residual of the fit.
model::CellModel Identified() {
  model::CellModel cell = test::HeavyArm();
  model::WrittenEffect effect;
  effect.id = "joint_compliance";
  effect.scope = {"q2", "q3"};
  effect.parameters = {{"q2", 2e-7, std::nullopt, "rad/(N m)", ""},
                       {"q3", 3e-7, std::nullopt, "rad/(N m)", ""}};
  effect.covariance.resize(2, 2);
  effect.covariance << 4e-16, -1e-16, -1e-16, 9e-16;
  cell.effects = {effect};
  cell.domain.emplace();
  for (const model::Joint& joint : cell.robot.joints)
    cell.domain->q.push_back({joint.min, joint.max});
  cell.domain->payload_kg = model::MeasuredRange{{{0, 80}}, {}};
  cell.domain->residual_sigma_m = 5e-5;
  return cell;
}

model::StatedRadius Radius(const model::CellModel& cell, const model::JointVector& q,
                           bool extrapolated, const LoadStatement& load,
                           const model::DeclaredDeviation& deviation = {}) {
  const LoadedArm arm(cell);
  return LandingUncertainty(cell, arm, deviation).At(arm, q, load, {}, extrapolated);
}

model::StatedRadius Radius(const model::CellModel& cell, const model::JointVector& q,
                           bool extrapolated) {
  return Radius(cell, q, extrapolated, LoadStatement::Stated({60, *cell.payload_cog_F}));
}

/// The arm with nothing declared: no compliance, no link mass.
model::CellModel Bare() {
  model::CellModel cell = test::HeavyArm();
  for (model::Joint& joint : cell.robot.joints) {
    joint.compliance_rad_per_Nm.reset();
    joint.link_mass_kg.reset();
    joint.link_com_m.reset();
  }
  return cell;
}

model::CellModel WithoutCompliance() {
  model::CellModel cell = test::HeavyArm();
  for (model::Joint& joint : cell.robot.joints) joint.compliance_rad_per_Nm.reset();
  return cell;
}

}  // namespace

TEST_CASE("the radius of an identified model grows with the distance from the measured poses") {
  model::CellModel cell = Identified();
  cell.effects[0].covariance.setZero();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const double uniform_m = Radius(cell, q, false).radius_m;
  cell.domain->distant_sigma_m = 1e-3;
  cell.domain->poses = {q};
  CHECK(Radius(cell, q, false).radius_m == Approx(uniform_m));
  model::JointVector away = q;
  away[0] += 0.5;
  const LoadedArm arm(cell);
  const double d = kinematics::PoseDistance(arm.chain(), arm.X_FT().p, cell.domain->poses).Of(away);
  const model::StatedRadius grown = Radius(cell, away, false);
  CHECK(grown.radius_m == Approx(uniform_m * std::hypot(5e-5, 1e-3 * d) / 5e-5));
  CHECK(grown.basis == model::RadiusBasis::kMeasured);
  cell.domain->residual_sigma_m.reset();  // no held-out rows
  CHECK(Radius(cell, away, false).radius_m < uniform_m);
}

TEST_CASE("the radius grows with the load beyond the measured ones, by its growth") {
  model::CellModel cell = Identified();
  cell.effects[0].covariance.setZero();
  constexpr double kGrowth_m = 1e-5;
  cell.domain->payload_kg = model::MeasuredRange{{{0, 0}, {40, 40}}, kGrowth_m};
  const model::JointVector q = model::JointVector::Constant(6, 0.3);
  const auto radius_m = [&](double payload_kg) {
    return Radius(cell, q, false, LoadStatement::Stated({payload_kg, *cell.payload_cog_F}))
        .radius_m;
  };
  const double near_m = radius_m(40);
  for (const auto& [payload_kg, beyond_kg] : {std::pair(45.0, 5.0), {15.0, 15.0}})
    CHECK(radius_m(payload_kg) == Approx(near_m * std::hypot(5e-5, kGrowth_m * beyond_kg) / 5e-5));
}

TEST_CASE(
    "a correction without a confirmed cause fades with distance, and its radius stays bounded") {
  model::CellModel cell = Identified();
  const model::CellModel declared = test::HeavyArm();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const loads::Payload payload{60, *cell.payload_cog_F};
  const auto tip = [&](const model::CellModel& of, const model::JointVector& at) {
    LoadedState state;
    REQUIRE(LoadedArm(of).AtCommanded(at, payload, effects::Conditions{}, state));
    return state.X_WT.p;
  };
  const model::CellModel everywhere = cell;
  constexpr double kReach = 0.1, kDistant_m = 1e-3, kDeclared_m = 3e-4;
  cell.domain->distant_sigma_m = kDistant_m;
  cell.domain->poses = {q};
  cell.domain->reach_rad = kReach;
  cell.domain->declared_sigma_m = kDeclared_m;
  model::JointVector within = q, away = q;
  within[0] += 0.05;
  away[0] += 0.8;
  away[1] -= 0.5;
  CHECK((tip(cell, within) - tip(everywhere, within)).norm() < 1e-12);
  const LoadedArm arm(cell);
  const double d = kinematics::PoseDistance(arm.chain(), arm.X_FT().p, cell.domain->poses).Of(away);
  const double gained_m2 = kDistant_m * kDistant_m * (d * d - kReach * kReach);
  const double share = kDeclared_m * kDeclared_m / (kDeclared_m * kDeclared_m + gained_m2);
  CHECK(share < 0.5);
  const OperatingPoint point = arm.PointAt(away, payload, {});
  CHECK(arm.growth().Share(point) == Approx(share));
  CHECK(arm.growth().Variance(point) == Approx(share * gained_m2));
  const Vec3 correction = tip(everywhere, away) - tip(declared, away);
  CHECK((tip(cell, away) - tip(declared, away) - share * correction).norm() <
        1e-2 * correction.norm());
  // What is known of the effects' sizes fades with them.
  CHECK(EffectCovariance(arm, away, payload, {}).trace() ==
        Approx(share * share * EffectCovariance(LoadedArm(everywhere), away, payload, {}).trace())
            .epsilon(1e-2));
  // Half a turn away the radius has not passed that of the declared model.
  cell.effects[0].covariance.setZero();
  model::JointVector opposite = away;
  opposite[0] += 2;
  const double most_m = std::hypot(*cell.domain->residual_sigma_m, kDeclared_m);
  CHECK(Radius(cell, opposite, false).radius_m <= most_m / 5e-5 * Radius(cell, q, false).radius_m);
}

TEST_CASE("the radius of an identified model holds 95 % of the arms it may be") {
  const model::CellModel cell = Identified();
  std::mt19937 random(31);
  const model::JointVector q = test::RandomPosture(cell, random);
  const double radius_m = Radius(cell, q, false).radius_m;
  const Eigen::Matrix2d root = cell.effects[0].covariance.topLeftCorner<2, 2>().llt().matrixL();
  std::normal_distribution<double> normal;
  const loads::Payload payload{60, *cell.payload_cog_F};
  LoadedState state;
  REQUIRE(LoadedArm(cell).AtCommanded(q, payload, {}, state));
  const Vec3 middle = state.X_WT.p;
  constexpr int kDraws = 3000;
  int within = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    const Eigen::Vector2d off = root * Eigen::Vector2d(normal(random), normal(random));
    model::CellModel other = cell;
    for (int k = 0; k < 2; ++k) {
      other.effects[0].parameters[static_cast<std::size_t>(k)].value += off[k];
    }
    REQUIRE(LoadedArm(other).AtCommanded(q, payload, {}, state));
    const Vec3 rest = 5e-5 * Vec3(normal(random), normal(random), normal(random));
    within += (state.X_WT.p + rest - middle).norm() <= radius_m ? 1 : 0;
  }
  CHECK(within > 0.93 * kDraws);  // two standard deviations of the count are 0.8 %
  CHECK(within < 0.97 * kDraws);
}

TEST_CASE("the basis is measured inside the domain of a validated fit, and weaker elsewhere") {
  model::CellModel cell = Identified();
  std::mt19937 random(32);
  const model::JointVector q = test::RandomPosture(cell, random);
  const model::StatedRadius inside = Radius(cell, q, false);
  CHECK(inside.basis == model::RadiusBasis::kMeasured);

  // The growth says how large the error is; but it was not validated there.
  cell.domain->payload_kg->growth = 1e-5;
  const LoadStatement heavy = LoadStatement::Stated({90, *cell.payload_cog_F});
  const model::StatedRadius described = Radius(cell, q, true, heavy);
  CHECK(described.basis == model::RadiusBasis::kAssumed);
  CHECK(described.radius_m == Radius(cell, q, false, heavy).radius_m);
  CHECK(described.radius_m > inside.radius_m);

  cell.domain->payload_kg->growth.reset();  // how the error grows is not known
  const model::StatedRadius undescribed = Radius(cell, q, true, heavy);
  CHECK(undescribed.basis == model::RadiusBasis::kAssumed);
  CHECK(undescribed.radius_m > Radius(cell, q, false, heavy).radius_m);

  cell.domain->residual_sigma_m.reset();  // no held-out rows
  cell.measurement.sigma_m = 5e-5;
  const model::StatedRadius propagated = Radius(cell, q, false);
  CHECK(propagated.basis == model::RadiusBasis::kPropagated);
  CHECK(propagated.radius_m == Approx(inside.radius_m));
}

TEST_CASE("ranges test the tip along the wire alone: the radius is propagated") {
  model::CellModel cell = Identified();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const model::StatedRadius of_points = Radius(cell, q, false);
  CHECK(of_points.basis == model::RadiusBasis::kMeasured);
  cell.measurement.kind = model::MeasurementKind::kRange;
  const model::StatedRadius of_ranges = Radius(cell, q, false);
  CHECK(of_ranges.basis == model::RadiusBasis::kPropagated);
  CHECK(of_ranges.radius_m == Approx(of_points.radius_m));
}

TEST_CASE("a model that was changed after its fit is assumed, with no smaller radius") {
  model::CellModel cell = Identified();
  std::mt19937 random(32);
  const model::JointVector q = test::RandomPosture(cell, random);
  const LoadStatement load = LoadStatement::Stated({60, *cell.payload_cog_F});
  const model::StatedRadius validated = Radius(cell, q, false, load);
  cell.domain->as_validated = false;
  for (const bool extrapolated : {false, true}) {
    for (const model::DeclaredDeviation& deviation :
         {model::DeclaredDeviation{}, model::DeclaredDeviation{0.3, true}}) {
      const model::StatedRadius changed = Radius(cell, q, extrapolated, load, deviation);
      CHECK(changed.basis == model::RadiusBasis::kAssumed);
      CHECK(changed.radius_m > validated.radius_m);
    }
  }
}

TEST_CASE("a declared cell has basis 'propagated' only if its deviation is stated and dominates") {
  model::CellModel cell = test::HeavyArm();
  model::WrittenEffect root;
  root.id = "tool_root_compliance";
  root.parameters = {{"compliance", 1e-7, std::nullopt, "rad/(N m)", ""}};
  model::WrittenEffect pedestal = root;
  pedestal.id = "pedestal_compliance";
  cell.effects = {root, pedestal};
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const LoadStatement load = LoadStatement::Stated({});
  CHECK(Radius(cell, q, false, load).basis == model::RadiusBasis::kAssumed);
  CHECK(Radius(cell, q, false, load, {0.3, true}).basis == model::RadiusBasis::kPropagated);
  // Typical payload tolerances matter if the declared deviation is small.
  const LoadStatement carried = LoadStatement::Stated({60, *cell.payload_cog_F});
  CHECK(Radius(cell, q, false, carried, {0.05, true}).basis == model::RadiusBasis::kAssumed);
  cell.robot.joints[1].compliance_rad_per_Nm.reset();
  CHECK(Radius(cell, q, false, load, {0.3, true}).basis == model::RadiusBasis::kAssumed);
}

TEST_CASE("undeclared parameters make the radius larger, never smaller") {
  const model::CellModel declared = test::HeavyArm();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const LoadStatement load = LoadStatement::Stated({60, *declared.payload_cog_F});
  const double all_m = Radius(declared, q, false, load).radius_m;
  const model::StatedRadius soft = Radius(WithoutCompliance(), q, false, load);
  const model::StatedRadius bare = Radius(Bare(), q, false, load);
  CHECK(soft.basis == model::RadiusBasis::kAssumed);
  CHECK(bare.basis == model::RadiusBasis::kAssumed);
  CHECK(soft.radius_m > 2 * all_m);
  CHECK(bare.radius_m > 1e-3);  // a rigid model of a heavy arm is not exact
  CHECK(bare.radius_m < 0.1);   // but not unbounded either

  // An unstated load, and one that the model cannot use.
  const LoadStatement unstated{{}, std::nullopt, false};
  const LoadStatement unused{{}, 60, false};
  const double empty_m = Radius(WithoutCompliance(), q, false, LoadStatement::Stated({})).radius_m;
  CHECK(Radius(WithoutCompliance(), q, false, unstated).radius_m > empty_m);
  CHECK(Radius(WithoutCompliance(), q, false, unused).radius_m > empty_m);

  // The heavier the load, the larger; the larger the declared share, the larger.
  CHECK(Radius(WithoutCompliance(), q, false, load).radius_m > empty_m);
  CHECK(Radius(declared, q, false, load, {0.4, true}).radius_m > 1.5 * all_m);
}

TEST_CASE("the covariance of effects is included in a model without a domain") {
  model::CellModel cell = Identified();
  cell.domain.reset();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  model::CellModel exact = cell;
  exact.effects[0].covariance.setZero();
  cell.effects[0].covariance *= 1e4;
  CHECK(Radius(cell, q, false).radius_m > 1.5 * Radius(exact, q, false).radius_m);
}

TEST_CASE("the basis is unknown for an undeclared vertical axis that carries the arm") {
  model::CellModel cell = test::HeavyArm();
  cell.robot.joints[0].type = model::JointType::kPrismatic;
  cell.robot.joints[0].compliance_rad_per_Nm.reset();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  CHECK(Radius(cell, q, false).basis == model::RadiusBasis::kUnknown);
}

TEST_CASE("the same posture always has the same radius") {
  const model::CellModel cell = WithoutCompliance();
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  CHECK(Radius(cell, q, false).radius_m == Radius(cell, q, false).radius_m);
}

TEST_CASE("a compliance contributes equally from the file and from an effect") {
  model::CellModel from_file = test::HeavyArm();
  model::CellModel from_effect = from_file;
  from_effect.robot.joints[1].compliance_rad_per_Nm = 1e-12;
  model::WrittenEffect effect;
  effect.id = "joint_compliance";
  effect.scope = {"q2"};
  effect.parameters = {
      {"q2", *from_file.robot.joints[1].compliance_rad_per_Nm, std::nullopt, "rad/(N m)", ""}};
  from_effect.effects = {effect};
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  // Without the relative error of declared deflections; effects have their own covariance.
  const LoadStatement unstated{{60, *from_file.payload_cog_F}, std::nullopt, false};
  const double file_m = Radius(from_file, q, false, unstated, {0, true}).radius_m;
  CHECK(Radius(from_effect, q, false, unstated, {0, true}).radius_m ==
        Approx(file_m).epsilon(1e-3));
}

TEST_CASE("the radius grows with the lever of the tool point") {
  const model::CellModel cell = WithoutCompliance();
  const LoadedArm arm(cell);
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const LoadStatement load = LoadStatement::Stated({60, *cell.payload_cog_F});
  LandingUncertainty uncertainty(cell, arm, {});
  const double tip_m = uncertainty.At(arm, q, load, {}, false).radius_m;
  CHECK(uncertainty.At(arm, q, load, {}, false, Vec3(0, 0, 2)).radius_m > 1.1 * tip_m);
}

TEST_CASE("an arm without a joint that lifts it has no typical values") {
  model::CellModel scara = test::HeavyArm();
  scara.robot.X_WB = Pose{};
  for (model::Joint& joint : scara.robot.joints) {
    joint.alpha_rad = 0;
    joint.compliance_rad_per_Nm.reset();
  }
  model::JointVector q(6);
  q << 0.2, 0.4, 0.3, 0.5, 0.8, -0.4;
  const model::StatedRadius radius = Radius(scara, q, false);
  CHECK(radius.basis == model::RadiusBasis::kUnknown);
  CHECK(radius.radius_m < 1);
}

}  // namespace plumbline::landing_uncertainty_test
