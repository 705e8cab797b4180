// Frames on axes in the places where a construction loses its digits: opposite to z, nearly
// coaxial, at gimbal lock; and the comparison that would notice.
#include <cmath>
#include <numbers>

#include "app/measure/urdf/chain_difference.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/measure/urdf/imported.h"

namespace plumbline::urdf_frames_test {
namespace {

constexpr double kPi = std::numbers::pi;

double Skewness(const Mat3& R) {
  return std::max((R.transpose() * R - Mat3::Identity()).cwiseAbs().maxCoeff(),
                  std::abs(R.determinant() - 1));
}

/// A small angle or length of either sign, or zero: 1e-13 to 1e-1, uniform in its logarithm.
double Small(std::mt19937& random) {
  std::uniform_real_distribution<double> exponent(-13, -1);
  std::uniform_int_distribution<int> sign(-1, 1);
  return sign(random) * std::pow(10, exponent(random));
}

/// An arm whose origins are right angles and multiples of 0.1 m, each off by a small amount or by
/// none, as they come from rounding, calibration and other programs.
std::string AlmostSquareArm(std::mt19937& random, int joints) {
  std::uniform_int_distribution<int> quarter(-2, 2), tenth(-4, 4);
  std::string xml = "<robot name=\"r\"><link name=\"l0\"/>";
  for (int i = 1; i <= joints + 1; ++i) {
    const bool last = i > joints;
    const std::string child = last ? "tip" : "l" + std::to_string(i);
    const auto off = [&](double value) { return value + Small(random); };
    const Eigen::Vector3d xyz(off(0.1 * tenth(random)), off(0.1 * tenth(random)),
                              off(0.1 * tenth(random)));
    const Eigen::Vector3d rpy(off(kPi / 2 * quarter(random)), off(kPi / 2 * quarter(random)),
                              off(kPi / 2 * quarter(random)));
    Eigen::Vector3d axis = Eigen::Vector3d::Zero();
    axis[std::uniform_int_distribution<int>(0, 2)(random)] = quarter(random) < 0 ? -1 : 1;
    xml += "<link name=\"" + child + "\"/><joint name=\"j" + std::to_string(i) + "\" type=\"" +
           (last     ? "fixed"
            : i == 4 ? "prismatic"
                     : "revolute") +
           "\"><parent link=\"l" + std::to_string(i - 1) + "\"/><child link=\"" + child +
           "\"/><origin xyz=\"" + test::Numbers(xyz) + "\" rpy=\"" + test::Numbers(rpy) +
           "\"/><axis xyz=\"" + test::Numbers(axis) +
           "\"/><limit lower=\"-3\" upper=\"3\"/></joint>";
  }
  return xml + "</robot>";
}

}  // namespace

TEST_CASE("the frame of an axis is orthonormal, whatever the axis") {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-kPi, kPi);
  for (int k = 0; k < 20000; ++k) {
    const double from_z = (k % 3 == 0 ? kPi : k % 3 == 1 ? 0 : uniform(random)) + Small(random);
    const double about = k % 2 == 0 ? uniform(random) : kPi / 2 * std::round(uniform(random));
    const Vec3 axis(std::sin(from_z) * std::cos(about), std::sin(from_z) * std::sin(about),
                    std::cos(from_z));
    const Mat3 R = measure::AxisFrame(axis.normalized()).R;
    CAPTURE(from_z, about);
    REQUIRE(Skewness(R) < 1e-14);
    REQUIRE((R.col(2) - axis).norm() < 1e-14);
  }
  for (const double tiny : {0.0, 1e-308, 1e-200, 1e-160, 1e-16}) {
    CHECK(Skewness(measure::AxisFrame({tiny, 0, -1}).R) < 1e-14);
    CHECK(Skewness(measure::AxisFrame({0, -tiny, 1}).R) < 1e-14);
  }
}

TEST_CASE("roll, pitch, yaw give a rotation back, also close to gimbal lock") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> uniform(-kPi, kPi);
  for (int k = 0; k < 20000; ++k) {
    const Vec3 rpy(uniform(random), (k % 2 ? 1 : -1) * kPi / 2 + Small(random), uniform(random));
    const Mat3 R = RotationFromRollPitchYaw(rpy);
    const Mat3 back = RotationFromRollPitchYaw(RollPitchYawFromRotation(R));
    CAPTURE(rpy.transpose());
    REQUIRE((back - R).cwiseAbs().maxCoeff() < 1e-12);
  }
}

TEST_CASE("a first axis that points downward, or nearly so, is converted exactly") {
  std::mt19937 random(8);
  for (const double off : {0.0, 1e-12, 1e-9, 1e-8, 1e-7, 1e-6, 7.3e-6, 1e-5, 1e-4, 1e-3, 1e-2}) {
    for (const double sign : {1.0, -1.0}) {
      for (const int about : {0, 1}) {
        CAPTURE(off, sign, about);
        std::string xml = test::RandomUrdf(random, 7, test::Axes::kIntersecting, false);
        const std::size_t at = xml.find("rpy=\""), end = xml.find('"', at + 5);
        Eigen::Vector3d rpy = Eigen::Vector3d::Zero();
        rpy[about] = sign * (kPi - off);
        xml.replace(at, end - at, "rpy=\"" + test::Numbers(rpy));
        test::CheckAgainstXml(xml, test::Import(xml), 20, random);
      }
    }
  }
}

TEST_CASE("arms of almost right angles are converted exactly") {
  std::mt19937 random(9);
  for (int k = 0; k < 400; ++k) {
    CAPTURE(k);
    const std::string xml = AlmostSquareArm(random, 5 + k % 3);
    test::CheckAgainstXml(xml, test::Import(xml), 10, random);
  }
}

TEST_CASE("a table that is not that of the chain is not rounding") {
  std::mt19937 random(10);
  const test::Imported arm = test::Import(test::RandomUrdf(random, 6, test::Axes::kGeneral, false));
  const auto difference = [&](const model::Robot& robot) {
    return measure::DifferenceOf(arm.chain, robot, measure::RandomPostures(robot, 200));
  };
  CHECK(difference(arm.cell.robot).IsRounding());
  model::Robot longer = arm.cell.robot, twisted = arm.cell.robot, skewed = arm.cell.robot;
  longer.joints[5].a_m += 1.5e-9;
  CHECK_FALSE(difference(longer).IsRounding());
  twisted.joints[5].gamma_rad += 3e-8;
  CHECK_FALSE(difference(twisted).IsRounding());
  skewed.X_WB.R(0, 0) += 1e-6;
  CHECK_FALSE(difference(skewed).IsRounding());
}

}  // namespace plumbline::urdf_frames_test
