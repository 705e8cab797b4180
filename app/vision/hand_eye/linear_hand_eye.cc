#include "app/vision/hand_eye/linear_hand_eye.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "firmware-like/geometry/rotation.h"
#include "firmware-like/statistics/statistics.h"

namespace plumbline::vision {
namespace {

using Mat9 = Eigen::Matrix<double, 9, 9>;

double Angle(const Mat3& R) {
  return VectorFromRotation(R).norm();
}

/// Position and rotation combined into a distance [m], at the mean distance of the target.
std::vector<double> MisfitsOf(const HandEyePoses& poses, const std::vector<PosePairing>& pairings,
                              double distance_m) {
  std::vector<double> misfits;
  for (const PosePairing& pairing : pairings) {
    const PairingMisfit misfit = MisfitOf(poses, pairing);
    misfits.push_back(std::hypot(misfit.position_m, distance_m * misfit.rotation_rad));
  }
  return misfits;
}

}  // namespace

std::optional<HandEyePoses> SolveLinear(const std::vector<PosePairing>& pairings, bool free_scale) {
  constexpr double kMinSecond = 1e-4;  // rotation about the second axis, squared [rad^2]
  if (pairings.size() < 3) return std::nullopt;
  const double second = SecondAxisRotation(pairings);
  if (second * second < kMinSecond) return std::nullopt;
  Mat9 K = Mat9::Zero();
  for (const PosePairing& pairing : pairings) {
    for (Eigen::Index i = 0; i < 3; ++i) {
      for (Eigen::Index j = 0; j < 3; ++j)
        K.block<3, 3>(3 * i, 3 * j) += pairing.B.R(i, j) * pairing.A.R;
    }
  }
  const Eigen::JacobiSVD<Mat9> svd(K, Eigen::ComputeFullU | Eigen::ComputeFullV);
  HandEyePoses poses;
  const Eigen::Matrix<double, 9, 1> x = svd.matrixV().col(0), y = svd.matrixU().col(0);
  Mat3 X = Eigen::Map<const Mat3>(x.data()), Y = Eigen::Map<const Mat3>(y.data());
  if (X.determinant() < 0) {
    X = -X;
    Y = -Y;
  }
  poses.X.R = NearestRotation(X);
  poses.Y.R = NearestRotation(Y.determinant() < 0 ? Mat3(-Y) : Y);
  const auto n = static_cast<Eigen::Index>(pairings.size());
  // A.R X.p - Y.p + scale A.p = Y.R B.p
  Eigen::MatrixXd M(3 * n, free_scale ? 7 : 6);
  Eigen::VectorXd b(3 * n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const PosePairing& pairing = pairings[k];
    M.block<3, 3>(3 * k, 0) = pairing.A.R;
    M.block<3, 3>(3 * k, 3) = -Mat3::Identity();
    b.segment<3>(3 * k) = poses.Y.R * pairing.B.p;
    if (free_scale) {
      M.block<3, 1>(3 * k, 6) = pairing.A.p;
    } else {
      b.segment<3>(3 * k) -= pairing.A.p;
    }
  }
  const Eigen::VectorXd positions = M.colPivHouseholderQr().solve(b);
  if (!positions.allFinite()) return std::nullopt;
  poses.X.p = positions.head<3>();
  poses.Y.p = positions.segment<3>(3);
  if (free_scale) poses.scale = positions[6];
  if (!(poses.scale > 0)) return std::nullopt;
  return poses;
}

std::optional<HandEyePoses> SolveLinearRobust(const std::vector<PosePairing>& pairings,
                                              std::vector<bool>& consistent, bool free_scale) {
  constexpr int kMaxTriples = 400;
  constexpr double kConsistent = 4 * 1.4826;  // of the median misfit
  const std::size_t n = pairings.size();
  consistent.assign(n, true);
  if (n < 3) return std::nullopt;
  double distance_m = 0;
  for (const PosePairing& pairing : pairings)
    distance_m += pairing.B.p.norm() / static_cast<double>(n);
  std::optional<HandEyePoses> best;
  double least = 1e300;
  const auto judge = [&](const std::optional<HandEyePoses>& poses) {
    if (!poses) return;
    std::vector<double> misfits = MisfitsOf(*poses, pairings, distance_m);
    const double median = statistics::MedianOf(misfits);
    if (median < least) {
      least = median;
      best = poses;
    }
  };
  judge(SolveLinear(pairings, free_scale));
  // An evenly spaced, deterministic selection of all triples.
  const std::size_t all = n * (n - 1) * (n - 2) / 6;
  const std::size_t stride = std::max<std::size_t>(1, all / kMaxTriples);
  std::size_t number = 0;
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i + 1; j < n; ++j) {
      for (std::size_t k = j + 1; k < n; ++k) {
        if (number++ % stride == 0)
          judge(SolveLinear({pairings[i], pairings[j], pairings[k]}, free_scale));
      }
    }
  }
  if (!best) return std::nullopt;
  const std::vector<double> misfits = MisfitsOf(*best, pairings, distance_m);
  std::vector<PosePairing> chosen;
  for (std::size_t k = 0; k < n; ++k) {
    consistent[k] = misfits[k] <= kConsistent * least + 1e-9;
    if (consistent[k]) chosen.push_back(pairings[k]);
  }
  const auto refined = SolveLinear(chosen, free_scale);
  return refined ? refined : best;
}

PairingMisfit MisfitOf(const HandEyePoses& poses, const PosePairing& pairing) {
  const Pose A{pairing.A.R, poses.scale * pairing.A.p};
  const Pose from_robot = A * poses.X, from_camera = poses.Y * pairing.B;
  return {(from_robot.p - from_camera.p).norm(), Angle(from_robot.R.transpose() * from_camera.R)};
}

std::optional<Pose> PoseOfPoints(const lens::Lens& lens, const std::vector<Vec3>& points_K,
                                 const std::vector<lens::Vec2>& pixels) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> directions;
  bool flat = true;
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    const auto n = lens::NormalisedOfPixel(lens, pixels[k]);
    if (!n) continue;
    points.emplace_back(points_K[k].x(), points_K[k].y(), points_K[k].z());
    directions.emplace_back(n->x(), n->y());
    flat = flat && points_K[k].z() == 0;
  }
  if (points.size() < 6) return std::nullopt;
  const cv::Mat unit = cv::Mat::eye(3, 3, CV_64F);
  std::vector<cv::Mat> rotations, positions;
  std::vector<double> errors;
  try {
    cv::solvePnPGeneric(points, directions, unit, cv::noArray(), rotations, positions, false,
                        flat ? cv::SOLVEPNP_IPPE : cv::SOLVEPNP_SQPNP);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  std::optional<Pose> best;
  double least = 1e300;
  for (std::size_t k = 0; k < rotations.size(); ++k) {
    cv::solvePnPRefineLM(points, directions, unit, cv::noArray(), rotations[k], positions[k]);
    cv::Mat R;
    cv::Rodrigues(rotations[k], R);
    Pose pose;
    cv::cv2eigen(R, pose.R);
    cv::cv2eigen(positions[k], pose.p);
    if (!pose.R.allFinite() || !pose.p.allFinite() || !(pose.p.z() > 0)) continue;
    double sum = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 p_C = pose * Vec3(points[i].x, points[i].y, points[i].z);
      sum += (lens::Vec2(p_C.x(), p_C.y()) / p_C.z() - lens::Vec2(directions[i].x, directions[i].y))
                 .squaredNorm();
    }
    if (sum < least) {
      least = sum;
      best = pose;
    }
  }
  return best;
}

double SecondAxisRotation(const std::vector<PosePairing>& pairings) {
  Mat3 sum = Mat3::Zero();
  int pairs = 0;
  for (std::size_t i = 0; i < pairings.size(); ++i) {
    for (std::size_t j = i + 1; j < pairings.size(); ++j) {
      const Vec3 turn = VectorFromRotation(pairings[i].A.R.transpose() * pairings[j].A.R);
      sum += turn * turn.transpose();
      ++pairs;
    }
  }
  if (pairs == 0) return 0;
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(sum / pairs);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
}

void ResolveHalfTurns(std::vector<PosePairing>& pairings, const Vec3& centre_K,
                      std::vector<bool>& turned) {
  turned.assign(pairings.size(), false);
  // Rotation of K by half a turn about its centre.
  Pose half;
  half.R = Vec3(-1, -1, 1).asDiagonal();
  half.p = centre_K - half.R * centre_K;
  const auto disagreement = [&](std::size_t k, const Pose& B) {
    double sum = 0;
    for (std::size_t i = 0; i < k; ++i) {
      const double from_robot = Angle(pairings[i].A.R.transpose() * pairings[k].A.R);
      const double from_camera = Angle(pairings[i].B.R.transpose() * B.R);
      sum +=
          std::min(0.1, std::abs(from_robot - from_camera));  // bounded influence of a wrong view
    }
    return sum;
  };
  for (std::size_t k = 1; k < pairings.size(); ++k) {
    const Pose other = pairings[k].B * half;
    if (disagreement(k, other) < disagreement(k, pairings[k].B)) {
      pairings[k].B = other;
      turned[k] = true;
    }
  }
}

}  // namespace plumbline::vision
