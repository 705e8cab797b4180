#include "app/vision/lens/lens_start.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

namespace plumbline::vision {
namespace {

// Focal lengths in units of the image width: range of plausible ones, and fixed guesses.
constexpr double kShortest = 0.4, kLongest = 20;
constexpr double kGuesses[] = {0.9, 2.6, 6.2};

struct Pairs {
  std::vector<cv::Point2d> board, image;
};

/// Homography from the board to pixels relative to the image centre; zero if there is none.
Eigen::Matrix3d HomographyOf(const target::Board& board, const BoardView& view,
                             image::ImageSize size) {
  Pairs pairs;
  for (int k = 0; k < board.corners(); ++k) {
    if (!view.seen[k]) continue;
    const lens::Vec2 at = board.Corner(k) - board.Centre();
    pairs.board.emplace_back(at.x(), at.y());
    pairs.image.emplace_back(view.corners_px[k].x() - 0.5 * (size.width - 1),
                             view.corners_px[k].y() - 0.5 * (size.height - 1));
  }
  const cv::Mat H = cv::findHomography(pairs.board, pairs.image, 0);
  Eigen::Matrix3d homography = Eigen::Matrix3d::Zero();
  if (!H.empty()) cv::cv2eigen(H, homography);
  return homography;
}

}  // namespace

std::vector<double> FocalGuesses(const target::Board& board, std::span<const BoardView> views,
                                 image::ImageSize size) {
  // With w = 1 / f^2:  w (h1x h2x + h1y h2y) + h1z h2z = 0 and similarly for |h1|^2 - |h2|^2.
  double aa = 0, ab = 0;
  for (const BoardView& view : views) {
    Eigen::Matrix3d H = HomographyOf(board, view, size);
    const double length = H.leftCols<2>().topRows<2>().norm();
    if (!(length > 0)) continue;
    H /= length;
    const auto add = [&](double a, double b) {
      aa += a * a;
      ab += a * b;
    };
    const Eigen::Vector3d h1 = H.col(0), h2 = H.col(1);
    add(h1.head<2>().dot(h2.head<2>()), -h1.z() * h2.z());
    add(h1.head<2>().squaredNorm() - h2.head<2>().squaredNorm(), h2.z() * h2.z() - h1.z() * h1.z());
  }
  std::vector<double> guesses;
  const double f = ab > 0 ? std::sqrt(aa / ab) : 0;
  if (f > kShortest * size.width && f < kLongest * size.width) guesses.push_back(f);
  for (const double guess : kGuesses) guesses.push_back(guess * size.width);
  return guesses;
}

std::vector<Pose> BoardPoses(const target::Board& board, const BoardView& view,
                             const lens::Lens& lens) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> directions;
  for (int k = 0; k < board.corners(); ++k) {
    if (!view.seen[k]) continue;
    const auto n = lens::NormalisedOfPixel(lens, view.corners_px[k]);
    if (!n) continue;
    points.emplace_back(board.Corner(k).x(), board.Corner(k).y(), 0);
    directions.emplace_back(n->x(), n->y());
  }
  std::vector<Pose> poses;
  if (points.size() < 6) return poses;
  std::vector<cv::Mat> turns, places;
  cv::solvePnPGeneric(points, directions, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), turns, places,
                      false, cv::SOLVEPNP_IPPE);
  for (std::size_t k = 0; k < turns.size(); ++k) {
    cv::Mat R;
    cv::Rodrigues(turns[k], R);
    Pose pose;
    cv::cv2eigen(R, pose.R);
    cv::cv2eigen(places[k], pose.p);
    if (pose.R.allFinite() && pose.p.allFinite() && pose.p.z() > 0) poses.push_back(pose);
  }
  return poses;
}

}  // namespace plumbline::vision
