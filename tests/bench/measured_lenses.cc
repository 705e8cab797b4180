#include "tests/bench/measured_lenses.h"

#include <fmt/core.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <opencv2/calib3d.hpp>
#include <set>

#include "app/vision/lens/calibration.h"
#include "app/vision/lens/lens_fit.h"
#include "app/vision/lens/projection_uncertainty.h"
#include "firmware-like/geometry/rotation.h"
#include "tests/lens_captures/camera_model.h"
#include "tests/lens_captures/measured_captures.h"
#include "tests/peers/mrcal_peer.h"

namespace plumbline::bench {
namespace {

using lens_captures::CameraModel;
using lens_captures::MeasuredCapture;

/// A calibrated camera and the shape of the board that belongs to it.
struct Solved {
  std::function<lens::Vec2(const Vec3&)> pixel_of;
  Vec3 bow = Vec3::Zero();  ///< kBowX, kBowY, kBowXY
  lens::Lens start;         ///< for the first guess of a pose
};
using Solver = std::function<std::optional<Solved>(const MeasuredCapture&,
                                                   const std::vector<vision::BoardView>&)>;

Vec3 PointOf(const target::Board& board, int corner, const Vec3& bow) {
  const lens::Vec2 at = board.Corner(corner), uv = at - board.Centre();
  return {at.x(), at.y(),
          bow.x() * uv.x() * uv.x() + bow.y() * uv.y() * uv.y() + bow.z() * uv.x() * uv.y()};
}

/// Whether a corner locates the board; the others are compared.
bool Locates(const target::Board& board, int corner) {
  return (corner % board.columns + corner / board.columns) % 2 == 0;
}

/// Least squares over the locating corners by Gauss and Newton with numerical derivatives.
Pose Located(const target::Board& board, const vision::BoardView& view, const Solved& solved,
             Pose X) {
  const auto residuals = [&](const Pose& pose) {
    std::vector<double> values;
    for (int k = 0; k < board.corners(); ++k) {
      if (!view.seen[k] || !Locates(board, k)) continue;
      const lens::Vec2 error =
          solved.pixel_of(pose * PointOf(board, k, solved.bow)) - view.corners_px[k];
      values.push_back(error.x());
      values.push_back(error.y());
    }
    return Eigen::VectorXd(Eigen::Map<Eigen::VectorXd>(values.data(), values.size()));
  };
  const auto moved = [](const Pose& pose, const Vec6& step) {
    return Pose{RotationFromVector(step.head<3>()) * pose.R, pose.p + step.tail<3>()};
  };
  for (int pass = 0; pass < 20; ++pass) {
    const Eigen::VectorXd r = residuals(X);
    Eigen::MatrixXd J(r.size(), 6);
    for (int k = 0; k < 6; ++k) {
      const double step = k < 3 ? 1e-6 : 1e-6 * X.p.norm();
      J.col(k) = (residuals(moved(X, step * Vec6::Unit(k))) - r) / step;
    }
    X = moved(X, -(J.transpose() * J).ldlt().solve(J.transpose() * r));
  }
  return X;
}

struct Sum {
  double square_px2 = 0;
  int corners = 0;
};

void AddHeldOut(const target::Board& board, const vision::BoardView& view, const Solved& solved,
                Sum& sum) {
  Sum best{1e300, 0};
  for (const Pose& start : vision::BoardPoses(board, view, solved.start)) {
    const Pose X = Located(board, view, solved, start);
    Sum here;
    for (int k = 0; k < board.corners(); ++k) {
      if (!view.seen[k] || Locates(board, k)) continue;
      here.square_px2 +=
          (solved.pixel_of(X * PointOf(board, k, solved.bow)) - view.corners_px[k]).squaredNorm();
      ++here.corners;
    }
    if (here.square_px2 < best.square_px2) best = here;
  }
  sum.square_px2 += best.square_px2;
  sum.corners += best.corners;
}

/// RMS distance per corner over all images left out in turn [px]; infinite if a solver fails.
double HeldOut(const MeasuredCapture& capture, const Solver& solver) {
  Sum sum;
  for (const int left_out : std::set<int>(capture.image_of.begin(), capture.image_of.end())) {
    std::vector<vision::BoardView> training;
    for (std::size_t j = 0; j < capture.views.size(); ++j) {
      if (capture.image_of[j] != left_out) training.push_back(capture.views[j]);
    }
    const auto solved = solver(capture, training);
    if (!solved) return INFINITY;
    for (std::size_t j = 0; j < capture.views.size(); ++j) {
      if (capture.image_of[j] == left_out)
        AddHeldOut(capture.board, capture.views[j], *solved, sum);
    }
  }
  return std::sqrt(sum.square_px2 / std::max(1, sum.corners));
}

Solved SolvedOf(const lens::Lens& lens, const Vec3& bow) {
  return {[lens](const Vec3& p) { return lens::Project<double>(lens, p); }, bow, lens};
}

/// Ours, as `plumbline calibrate-lens` states it. @param flat  the comparison assumes a flat board
/// @param known  calibrations that have been made, by capture and views
Solver Ours(bool flat, std::map<std::string, vision::LensCalibration>& known) {
  return [flat, &known](const MeasuredCapture& capture,
                        const std::vector<vision::BoardView>& views) {
    std::string key = capture.name;
    for (const vision::BoardView& view : views) key += fmt::format("|{}", view.time_s);
    auto found = known.find(key);
    if (found == known.end())
      found = known.emplace(key, vision::CalibrateLens(capture.board, views, capture.size)).first;
    const vision::LensCalibration& c = found->second;
    if (!(c.lens.fx > 0)) return std::optional<Solved>();
    return std::optional(SolvedOf(c.lens, flat ? Vec3(Vec3::Zero()) : c.board_bow));
  };
}

Solver Mrcal() {
  return [](const MeasuredCapture& capture, const std::vector<vision::BoardView>& views) {
    const auto fit = vision::FitLens(capture.board, views, capture.size);
    if (!fit) return std::optional<Solved>();
    const auto solved = SolveWithMrcal(capture.board, views, capture.size,
                                       vision::LensFromShared(fit->shared), fit->X_CK);
    if (!solved) return std::optional<Solved>();
    return std::optional(SolvedOf(solved->lens, Vec3::Zero()));
  };
}

/// @param flags  of cv::calibrateCamera
Solver OpenCv(int flags) {
  return [flags](const MeasuredCapture& capture, const std::vector<vision::BoardView>& views) {
    std::vector<std::vector<cv::Point3f>> objects;
    std::vector<std::vector<cv::Point2f>> images;
    for (const vision::BoardView& view : views) {
      objects.emplace_back();
      images.emplace_back();
      for (int k = 0; k < capture.board.corners(); ++k) {
        if (!view.seen[k]) continue;
        const lens::Vec2 at = capture.board.Corner(k), seen = view.corners_px[k];
        objects.back().emplace_back(static_cast<float>(at.x()), static_cast<float>(at.y()), 0.0F);
        images.back().emplace_back(static_cast<float>(seen.x()), static_cast<float>(seen.y()));
      }
    }
    cv::Mat K, distortion;
    std::vector<cv::Mat> turns, places;
    cv::calibrateCamera(objects, images, {capture.size.width, capture.size.height}, K, distortion,
                        turns, places, flags);
    CameraModel camera;
    camera.fx = K.at<double>(0, 0);
    camera.fy = K.at<double>(1, 1);
    camera.cx = K.at<double>(0, 2);
    camera.cy = K.at<double>(1, 2);
    double d[12] = {};
    for (int k = 0; k < 12 && k < static_cast<int>(distortion.total()); ++k)
      d[k] = distortion.at<double>(k);
    camera.k[0] = d[0], camera.k[1] = d[1], camera.k[2] = d[4];
    camera.p[0] = d[2], camera.p[1] = d[3];
    for (int k = 0; k < 3; ++k) camera.k[3 + k] = d[5 + k];
    for (int k = 0; k < 4; ++k) camera.s[k] = d[8 + k];
    Solved solved;
    solved.start = {camera.fx, camera.fy, camera.cx, camera.cy, d[0], d[1], d[2], d[3], d[4]};
    if ((flags & cv::CALIB_RATIONAL_MODEL) != 0) {  // the denominator counts too: no distortion
      solved.start = {camera.fx, camera.fy, camera.cx, camera.cy, d[0] - d[5]};
    }
    solved.pixel_of = [camera](const Vec3& p) { return camera.PixelOfDirection(p.normalized()); };
    return std::optional(solved);
  };
}

/// "0.7", the least of a few limits [px] at which the capture is accepted, or "none".
std::string AcceptedFrom(const MeasuredCapture& capture) {
  for (const double limit_px : {0.5, 0.6, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 10.0}) {
    vision::CalibrationOptions options;
    options.acceptable_px = limit_px;
    if (vision::CalibrateLens(capture.board, capture.views, capture.size, options).accepted)
      return fmt::format("{} px", limit_px);
  }
  return "none up to 10 px";
}

/// Two halves of the images, every other one, each solved on its own: the largest difference of the
/// two lenses within the usable region, in units of what the claim of the whole set implies. The
/// halves have twice the variance each, so that their difference has twice the standard deviation.
std::string HalvesOf(const MeasuredCapture& capture, const vision::LensCalibration& c) {
  std::vector<int> images;
  for (const int image : std::set<int>(capture.image_of.begin(), capture.image_of.end()))
    images.push_back(image);
  std::vector<vision::BoardView> halves[2];
  for (std::size_t j = 0; j < capture.views.size(); ++j) {
    const auto at = std::ranges::find(images, capture.image_of[j]) - images.begin();
    halves[at % 2].push_back(capture.views[j]);
  }
  std::optional<lens::Lens> lenses[2];
  for (int half : {0, 1}) {
    const auto fit = vision::FitLens(capture.board, halves[half], capture.size);
    if (fit) lenses[half] = vision::LensFromShared(fit->shared);
  }
  if (!lenses[0] || !lenses[1]) return "no lens from one of the halves";
  const double apart_px = vision::LargestDifference(*lenses[0], *lenses[1], capture.size,
                                                    std::nullopt, c.usable_radius_px);
  return fmt::format("{:.2f} px apart, {:.2f} of their claimed standard deviation", apart_px,
                     apart_px / (2 * c.uncertainty.max_px));
}

}  // namespace

void MeasuredLenses() {
  const std::vector<MeasuredCapture> captures = lens_captures::AllMeasuredCaptures();
  if (captures.empty()) {
    fmt::print("real captures: SKIPPED, no measured images; set PLUMBLINE_MEASURED\n");
    return;
  }
  cv::setNumThreads(1);
  std::map<std::string, vision::LensCalibration> known;
  const std::pair<const char*, Solver> peers[] = {
      {"ours", Ours(true, known)},
      {"ours with its board's bow", Ours(false, known)},
      {"OpenCV, five parameters", OpenCv(0)},
      {"OpenCV, rational", OpenCv(cv::CALIB_RATIONAL_MODEL)},
      {"OpenCV, thin prism", OpenCv(cv::CALIB_THIN_PRISM_MODEL)},
      {"mrcal", Mrcal()}};
  for (const MeasuredCapture& capture : captures) {
    const vision::LensCalibration c =
        vision::CalibrateLens(capture.board, capture.views, capture.size);
    fmt::print("{}: {} views, {} images without a board; {}\n", capture.name, capture.views.size(),
               capture.missed.size(), c.accepted ? "accepted" : "REFUSED");
    for (const auto* lines : {&c.reasons, &c.notes}) {
      for (const std::string& line : *lines) fmt::print("    {}\n", line);
    }
    fmt::print("    RMS {:.3f} px, standard deviation at most {:.2f} px, accepted from {}\n",
               c.rms_px, c.uncertainty.max_px, AcceptedFrom(capture));
    vision::CalibrationOptions least;
    least.accept_least = true;
    const vision::LensCalibration proved =
        vision::CalibrateLens(capture.board, capture.views, capture.size, least);
    fmt::print("    without a limit {}, within {:.2f} px; halves {}\n",
               proved.accepted ? "accepted" : "REFUSED", proved.uncertainty.max_px,
               HalvesOf(capture, proved));
    const double reference_px = HeldOut(capture, OpenCv(0));
    for (const auto& [name, solver] : peers) {
      if (std::string(name) == "mrcal" && !HasMrcal()) {
        fmt::print("  {:28} SKIPPED, not installed at build time (libmrcal-dev)\n", name);
        continue;
      }
      const double held_out_px = HeldOut(capture, solver);
      fmt::print("  {:28} held out {:.4f} px, ratio to OpenCV {:.3f}\n", name, held_out_px,
                 held_out_px / reference_px);
    }
  }
}

}  // namespace plumbline::bench
