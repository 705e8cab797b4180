// Hand-eye calibration against ground truth: simulated corners and a robot with noise.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "app/vision/hand_eye/linear_hand_eye.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/app/vision/hand_eye/made_views.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::hand_eye_test {

using namespace plumbline::vision;
using namespace plumbline::test;

namespace {

HandEyeOptions OptionsFor(const Making& how) {
  HandEyeOptions options;
  options.setup = how.setup;
  options.image = {1920, 1080};
  options.acceptable_m = 2e-3;
  return options;
}

/// Error of a pose in the six parameters of its covariance.
Vec6 ErrorOf(const PoseWithCovariance& found, const Eigen::Isometry3d& truth) {
  Vec6 error;
  error << found.X.p - truth.translation(),
      VectorFromRotation(truth.linear().transpose() * found.X.R);
  return error;
}

bool HasReason(const HandEye& result, const std::string& words) {
  return std::any_of(result.reasons.begin(), result.reasons.end(), [&](const std::string& reason) {
    return reason.find(words) != std::string::npos;
  });
}

}  // namespace

TEST_CASE("without noise, camera and target are found exactly in both setups") {
  for (const auto setup : {HandEyeSetup::kEyeToHand, HandEyeSetup::kEyeInHand}) {
    const Making how{.setup = setup, .corner_px = 0, .robot_m = 0, .robot_rad = 0};
    const Made made = Make(how, 1);
    const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor(how));
    CAPTURE(result.reasons, result.refused.size(), result.sigma_px, result.robot_m);
    CHECK(result.accepted);
    CHECK(ErrorOf(result.camera, made.camera_pose).norm() < 1e-6);
    CHECK(ErrorOf(result.target, made.target_pose).norm() < 1e-6);
    CHECK(result.adjusted.position_m < 1e-6);
    CHECK(result.size_ratio == Approx(1).margin(1e-6));
  }
}

TEST_CASE(
    "errors match the stated covariance over seeds and are smaller than the linear method's") {
  double sum = 0, adjusted = 0, linear = 0, robot = 0, corner = 0;
  int count = 0, seeds = 0;
  for (const auto setup : {HandEyeSetup::kEyeToHand, HandEyeSetup::kEyeInHand}) {
    for (std::uint64_t seed = 1; seed <= 25; ++seed) {
      const Making how{.setup = setup};
      const Made made = Make(how, seed);
      const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor(how));
      CAPTURE(seed, result.reasons);
      REQUIRE(result.camera.covariance.trace() > 0);
      const Vec6 error = ErrorOf(result.camera, made.camera_pose);
      // Normalized squared error of six parameters: the mean is 6.
      sum += error.dot(result.camera.covariance.ldlt().solve(error));
      adjusted += result.adjusted.position_m;
      linear += result.linear.position_m;
      robot += result.robot_m;
      corner += result.sigma_px;
      count += 6;
      ++seeds;
    }
  }
  const double spread = std::sqrt(sum / count);
  CAPTURE(spread, robot / seeds, corner / seeds, adjusted / seeds, linear / seeds);
  CHECK(spread > 0.85);
  CHECK(spread < 1.25);  // twenty views determine the robot's noise to about 10 %
  CHECK(robot / seeds == Approx(0.3e-3).epsilon(0.15));
  CHECK(corner / seeds == Approx(0.1).epsilon(0.05));
  CHECK(adjusted < linear);
}

TEST_CASE("a robot pose that belongs to another image is excluded and named") {
  Making how;
  how.wrong = {3, 12};
  const Made made = Make(how, 5);
  const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor(how));
  CAPTURE(result.reasons);
  CHECK(result.accepted);
  REQUIRE(result.refused.size() == 2);
  std::vector<std::string> names = {result.refused[0].name, result.refused[1].name};
  std::sort(names.begin(), names.end());
  CHECK(names == std::vector<std::string>{"image12.png", "image3.png"});
}

TEST_CASE("poses that do not match the images are refused") {
  Made made = Make({}, 6);
  std::vector<Pose> poses;
  for (const HandEyeView& view : made.views) poses.push_back(view.X_BF);
  std::rotate(poses.begin(), poses.begin() + 5, poses.end());
  for (std::size_t k = 0; k < poses.size(); ++k) made.views[k].X_BF = poses[k];
  const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor({}));
  CHECK_FALSE(result.accepted);
  CHECK_FALSE(result.reasons.empty());
}

TEST_CASE("rotations about one axis only, and too few images, are refused") {
  Making how;
  how.tilt_rad = 0.01;
  Made made = Make(how, 7);
  const HandEye flat = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor(how));
  CHECK_FALSE(flat.accepted);
  CHECK(HasReason(flat, "about nearly one axis"));
  made = Make({.views = 6}, 8);
  const HandEye few = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor({}));
  CHECK_FALSE(few.accepted);
  CHECK(HasReason(few, "too few"));
  made.views.resize(2);
  CHECK_FALSE(CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor({})).accepted);
  CHECK_FALSE(CalibrateHandEye({}, LensTold(made.camera), OptionsFor({})).accepted);
}

TEST_CASE("a target of the wrong size is detected through the robot's motion") {
  Making how;
  how.size = 1.02;
  const Made made = Make(how, 9);
  const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor(how));
  CHECK_FALSE(result.accepted);
  CHECK(HasReason(result, "larger than declared"));
  CHECK(result.size_ratio == Approx(1.02).margin(5 * result.size_ratio_sd));
  CHECK(result.size_ratio_sd < 0.004);
}

TEST_CASE("positions or a size in another unit are named, also with a free size") {
  for (const auto& [factor, unit] :
       {std::pair{25.4, "inches"}, {10.0, "centimetres"}, {1000.0, "metres"}}) {
    for (const bool of_poses : {true, false}) {
      for (const std::uint64_t seed : {11, 12, 13}) {
        CAPTURE(factor, of_poses, seed);
        Making how;
        Made made = Make(how, seed);
        for (auto& view : made.views) {
          if (of_poses) view.X_BF.p /= factor;
          for (Vec3& p : view.points_K) p /= of_poses ? 1 : factor;
        }
        HandEyeOptions options = OptionsFor(how);
        options.free_size = true;
        const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), options);
        CAPTURE(result.size_ratio, result.reasons);
        CHECK_FALSE(result.accepted);
        CHECK(HasReason(result, unit));
      }
    }
  }
}

namespace {

Mat3 About(int axis, double angle) {
  return RotationFromVector(angle * Vec3::Unit(axis));
}

Mat3 FixedXyz(const Vec3& a) {
  return About(2, a.z()) * About(1, a.y()) * About(0, a.x());
}

Mat3 MovingXyz(const Vec3& a) {
  return About(0, a.x()) * About(1, a.y()) * About(2, a.z());
}

Mat3 FromWxyz(double w, double x, double y, double z) {
  return Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
}

}  // namespace

TEST_CASE("a table of poses that means something else is refused by name, in both setups") {
  struct Case {
    const char* words;
    Pose (*table)(const Pose& truth);
  };
  const Case cases[] = {
      {"in the order x, y, z, w",
       [](const Pose& X) {
         const Eigen::Quaterniond q(X.R);
         return Pose{FromWxyz(q.x(), q.y(), q.z(), q.w()), X.p};
       }},
      {"in the order w, x, y, z",
       [](const Pose& X) {
         const Eigen::Quaterniond q(X.R);
         return Pose{FromWxyz(q.z(), q.w(), q.x(), q.y()), X.p};
       }},
      {"the poses are inverted", [](const Pose& X) { return X.Inverse(); }},
      {"the orientations are inverted",
       [](const Pose& X) {
         return Pose{X.R.transpose(), X.p};
       }},
      {"are a rotation vector, and were converted as angles about the fixed x, y, z",
       [](const Pose& X) {
         return Pose{FixedXyz(VectorFromRotation(X.R)), X.p};
       }},
      {"are angles about the fixed x, y, z (roll, pitch, yaw), and were converted as a rotation",
       [](const Pose& X) {
         return Pose{RotationFromVector(RollPitchYawFromRotation(X.R)), X.p};
       }},
      {"about the fixed x, y, z (roll, pitch, yaw), and were converted as angles about the moving "
       "x, y, z",
       [](const Pose& X) {
         return Pose{MovingXyz(RollPitchYawFromRotation(X.R)), X.p};
       }},
      {"(A, B, C)",
       [](const Pose& X) {
         return Pose{FixedXyz(RollPitchYawFromRotation(X.R).reverse()), X.p};
       }},
      {"in radians, and were converted as degrees",
       [](const Pose& X) {
         return Pose{FixedXyz(RollPitchYawFromRotation(X.R) * std::numbers::pi / 180), X.p};
       }},
      {"positions of the poses are probably in metres, not in millimetres",
       [](const Pose& X) {
         return Pose{X.R, X.p / 1000};
       }},
      {"a rotation vector, and were converted as angles about the fixed x, y, z (roll, pitch, "
       "yaw): "
       "convert them again; and by the robot's motion",
       [](const Pose& X) {
         return Pose{FixedXyz(VectorFromRotation(X.R)), X.p / 25.4};
       }},
  };
  for (const Case& c : cases) {
    for (const auto setup : {HandEyeSetup::kEyeToHand, HandEyeSetup::kEyeInHand}) {
      for (const std::uint64_t seed : {31, 32}) {
        CAPTURE(c.words, seed);
        Making how;
        how.setup = setup;
        Made made = Make(how, seed);
        for (HandEyeView& view : made.views) view.X_BF = c.table(view.X_BF);
        const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor(how));
        CAPTURE(result.reasons);
        CHECK_FALSE(result.accepted);
        CHECK(result.reasons.size() == 1);
        CHECK(HasReason(result, c.words));
      }
    }
  }
}

TEST_CASE("a target that was turned in its mount is named in its images") {
  Making how;
  Made made = Make(how, 33);
  for (const std::size_t k : {2, 9}) {
    std::reverse(made.views[k].pixels.begin(), made.views[k].pixels.end());
  }
  const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), OptionsFor(how));
  CHECK(result.accepted);
  REQUIRE(result.refused.size() == 2);
  for (const RefusedView& view : result.refused) {
    CHECK(view.reason.find("turned by 180 deg about its normal") != std::string::npos);
  }
}

TEST_CASE("a board with half-turn symmetry may be numbered either way") {
  Making how;
  Made made = Make(how, 10);
  for (std::size_t k = 0; k < made.views.size(); k += 3)
    std::reverse(made.views[k].pixels.begin(), made.views[k].pixels.end());
  HandEyeOptions options = OptionsFor(how);
  CHECK_FALSE(CalibrateHandEye(made.views, LensTold(made.camera), options).accepted);
  options.half_turn_symmetric = true;
  const HandEye result = CalibrateHandEye(made.views, LensTold(made.camera), options);
  CAPTURE(result.reasons);
  CHECK(result.accepted);
  CHECK(result.used.size() == made.views.size());
  CHECK(ErrorOf(result.camera, made.camera_pose).head<3>().norm() < 2e-3);
}

TEST_CASE("a roughly known lens is estimated too, within its stated uncertainty") {
  double off = 0, plain_px = 0, free_px = 0;
  constexpr int kSeeds = 12;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const Making how;
    const Made made = Make(how, 100 + seed);
    lens::KnownLens known = LensTold(made.camera);
    known.lens.fx *= 1.004;
    known.lens.fy *= 1.004;
    known.lens.k1 = known.lens.k2 = 0;
    HandEyeOptions options = OptionsFor(how);
    const HandEye plain = CalibrateHandEye(made.views, known, options);
    options.free_lens = true;
    const HandEye result = CalibrateHandEye(made.views, known, options);
    const double sd = std::sqrt(result.lens.covariance(0, 0));
    REQUIRE(sd > 0);
    off += std::pow((result.lens.lens.fx - made.camera.fx) / sd, 2) / kSeeds;
    plain_px += plain.adjusted.rms_px / kSeeds;
    free_px += result.adjusted.rms_px / kSeeds;
  }
  CAPTURE(off, plain_px, free_px);
  CHECK(std::sqrt(off) < 1.6);
  CHECK(std::sqrt(off) > 0.5);
  CHECK(free_px < 0.8 * plain_px);
}

TEST_CASE("joint offsets of the robot are estimated together with the camera") {
  const model::CellModel cell = HeavyArm();
  const kinematics::Chain chain(cell.robot);
  const double truth[6] = {0, 1.5e-3, -2e-3, 1e-3, -2.5e-3, 0};
  Making how;
  how.views = 30;
  how.robot_m = how.robot_rad = 0;
  // Postures are sampled; camera and target are placed to suit the first of them, and those
  // that see the target from the front are kept.
  std::mt19937 random(4);
  Made made = Make(how, 11);
  std::vector<HandEyeView> views;
  std::normal_distribution<double> normal;
  const model::JointVector centre = RandomPosture(cell, random);
  kinematics::Posture posture;
  chain.Evaluate(centre, posture);
  const Eigen::Isometry3d X_CK0 = Iso({0.2, -0.1, 0.3}, {-0.1, -0.1, 1.1});
  const auto flange = [&](const model::JointVector& q) {
    chain.Evaluate(q, posture);
    Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
    X.linear() = posture.X_BF().R;
    X.translation() = posture.X_BF().p;
    return X;
  };
  const Eigen::Isometry3d X_BC = flange(centre) * made.target_pose * X_CK0.inverse();
  std::uniform_real_distribution<double> draw(-1, 1);
  for (int trial = 0; trial < 200000 && views.size() < 40; ++trial) {
    HandEyeView view;
    view.name = std::to_string(views.size());
    view.q = centre;
    for (int i = 0; i < 6; ++i) view.q[i] += (i < 3 ? 0.15 : 0.6) * draw(random);
    model::JointVector real = view.q;
    for (int i = 0; i < 6; ++i) real[i] += truth[i];
    const Eigen::Isometry3d X_CK = X_BC.inverse() * flange(real) * made.target_pose;
    bool inside = X_CK(2, 2) > 0.6;
    for (int k = 0; k < 54; ++k) {
      const int row = k / 9;
      const Eigen::Vector3d p_K(0.03 * (k % 9), 0.03 * row, 0);
      const Eigen::Vector3d p_C = X_CK * p_K;
      const Eigen::Vector2d pixel = renderer::PixelOf(made.camera, p_C);
      inside = inside && p_C.z() > 0.5 && pixel.x() > 0 && pixel.x() < 1920 && pixel.y() > 0 &&
               pixel.y() < 1080;
      view.points_K.push_back(p_K);
      view.pixels.emplace_back(pixel.x() + 0.05 * normal(random),
                               pixel.y() + 0.05 * normal(random));
    }
    if (inside) views.push_back(std::move(view));
  }
  REQUIRE(views.size() == 40);
  HandEyeOptions options = OptionsFor(how);
  options.chain = &chain;
  const HandEye plain = CalibrateHandEye(views, LensTold(made.camera), options);
  options.free_joints = true;
  const HandEye result = CalibrateHandEye(views, LensTold(made.camera), options);
  REQUIRE(result.joint_offsets.size() == 6);
  for (int i = 1; i < 5; ++i) {
    CAPTURE(i, result.joint_offset_sds[i]);
    CHECK(result.joint_offsets[i] == Approx(truth[i]).margin(4 * result.joint_offset_sds[i]));
    CHECK(result.joint_offset_sds[i] < 4e-4);
  }
  CHECK(result.adjusted.position_m < 0.5 * plain.adjusted.position_m);
}

}  // namespace plumbline::hand_eye_test
