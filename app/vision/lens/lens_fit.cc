#include "app/vision/lens/lens_fit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>

#include "app/vision/lens/disc_offsets.h"
#include "app/vision/lens/lens_costs.h"
#include "firmware-like/statistics/group_equations.h"
#include "firmware-like/statistics/statistics.h"

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

namespace {

constexpr double kOutlier = 4.5;  // robust standard deviations
constexpr double kMinSigma_px = 1e-3;
constexpr double kStartSigma_px = 0.1;
constexpr double kUnidentified =
    0.8;  // posterior / prior deviation above which a parameter is dropped
constexpr double kAcceptableStart_px = 5;  // above this RMS the next focal length is tried
constexpr double kRankTolerance = 1e-4;    // for collinear columns of a view
constexpr int kRounds = 4;
constexpr double kMadToSd = 1.4826;

/// State of the bundle adjustment.
class Adjustment {
 public:
  Adjustment(const target::Board& board, std::span<const BoardView> views, image::ImageSize size,
             const LensPrior& prior)
      : board_(board), size_(size), prior_(prior), states_(views.size()) {
    for (std::size_t j = 0; j < views.size(); ++j) {
      states_[j].view = &views[j];
      states_[j].used = views[j].seen;
      states_[j].offsets.assign(views[j].seen.size(), lens::Vec2::Zero());
    }
  }

  /// Initializes from a focal length, no distortion, and poses from the homographies.
  bool Start(double f) {
    lens::Lens lens;
    lens.fx = lens.fy = f;
    lens.cx = 0.5 * (size_.width - 1);
    lens.cy = 0.5 * (size_.height - 1);
    shared_ = SharedOfLens(lens);
    sigma_px_ = kStartSigma_px;
    for (ViewState& state : states_) {
      state.used = state.view->seen;
      const std::vector<Pose> poses = BoardPoses(board_, *state.view, lens);
      if (poses.empty()) return false;
      state.SetPose(poses[0]);
    }
    return true;
  }

  bool Solve(int max_iterations) {
    ceres::Problem problem;
    auto* ordering = new ceres::ParameterBlockOrdering;
    for (ViewState& state : states_) {
      if (CountUsed(state) == 0) continue;
      problem.AddResidualBlock(new ViewCost(board_, state, sigma_px_), nullptr, shared_.data(),
                               state.pose.data());
      ordering->AddElementToGroup(state.pose.data(), 0);
    }
    problem.AddResidualBlock(new PriorCost(Deviations(), size_), nullptr, shared_.data());
    ordering->AddElementToGroup(shared_.data(), 1);
    std::vector<int> fixed;
    for (int k = 0; k < kSharedCount; ++k) {
      if (dropped_[k]) fixed.push_back(k);
    }
    if (!fixed.empty()) {
      problem.SetManifold(shared_.data(), new ceres::SubsetManifold(kSharedCount, fixed));
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering.reset(ordering);
    options.max_num_iterations = max_iterations;
    options.function_tolerance = 1e-9;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    iterations_ += static_cast<int>(summary.iterations.size());
    return summary.IsSolutionUsable() && shared_.allFinite() && shared_[kFx] > 0 &&
           shared_[kFy] > 0;
  }

  /// Measured minus predicted, for all corners seen.
  std::vector<std::vector<lens::Vec2>> Residuals() const {
    std::vector<std::vector<lens::Vec2>> all;
    for (const ViewState& state : states_) {
      std::vector<lens::Vec2> pixels;
      const bool in_front = BoardPixels(board_, shared_, state.R_start, state.pose.head<3>(),
                                        state.pose.tail<3>(), pixels, nullptr, nullptr);
      std::vector<lens::Vec2> residuals(state.view->seen.size(), lens::Vec2::Zero());
      for (std::size_t k = 0; k < residuals.size(); ++k) {
        if (!state.view->seen[k]) continue;
        residuals[k] = in_front ? lens::Vec2(state.Seen(k) - pixels[k]) : lens::Vec2(1e3, 1e3);
      }
      all.push_back(std::move(residuals));
    }
    return all;
  }

  /// Recomputes the offsets of disc images for the current lens and poses.
  void UpdateDiscOffsets() {
    if (!board_.circles()) return;
    for (ViewState& state : states_) state.offsets = DiscOffsets(board_, shared_, state.X_CK());
  }

  /// Estimates sigma from the residuals and excludes outliers.
  void UpdateWeights() {
    const auto residuals = Residuals();
    std::vector<double> sizes;
    for (std::size_t j = 0; j < states_.size(); ++j) {
      for (std::size_t k = 0; k < residuals[j].size(); ++k) {
        if (!states_[j].view->seen[k]) continue;
        sizes.push_back(std::abs(residuals[j][k].x()));
        sizes.push_back(std::abs(residuals[j][k].y()));
      }
    }
    const double robust = std::max(kMinSigma_px, kMadToSd * statistics::MedianOf(sizes));
    double sum = 0;
    int used = 0;
    for (std::size_t j = 0; j < states_.size(); ++j) {
      for (std::size_t k = 0; k < residuals[j].size(); ++k) {
        states_[j].used[k] =
            states_[j].view->seen[k] && residuals[j][k].cwiseAbs().maxCoeff() < kOutlier * robust;
        if (!states_[j].used[k]) continue;
        sum += residuals[j][k].squaredNorm();
        ++used;
      }
    }
    const int freedom = 2 * used - kSharedCount - 6 * static_cast<int>(states_.size());
    sigma_px_ = std::max(kMinSigma_px, freedom > 0 ? std::sqrt(sum / freedom) : robust);
  }

  /// Tries the second pose that each view of a flat board allows. All corners are compared: those
  /// of a view in the wrong pose are outliers. @return whether any was better
  bool FixFlippedPoses() {
    bool any = false;
    const lens::Lens lens = LensFromShared(shared_);
    for (ViewState& state : states_) {
      ViewState best = state;
      best.used = state.view->seen;
      double least = RefinedCost(best);
      bool flipped = false;
      for (const Pose& X_CK : BoardPoses(board_, *state.view, lens)) {
        ViewState other = best;
        other.SetPose(X_CK);
        const double cost = RefinedCost(other);
        if (!(cost < 0.9 * least)) continue;
        least = cost;
        best = other;
        flipped = true;
      }
      if (flipped) state = best;
      any |= flipped;
    }
    return any;
  }

  ViewInformation InformationFrom(const ViewState& state) const {
    ViewInformation result;
    if (CountUsed(state) < 6) return result;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const ViewCost cost(board_, state, sigma_px_);
    const int rows = cost.num_residuals();
    Eigen::VectorXd residuals(rows);
    RowMajor by_shared(rows, static_cast<int>(kSharedCount)), by_pose(rows, 6);
    const double* parameters[] = {shared_.data(), state.pose.data()};
    double* jacobians[] = {by_shared.data(), by_pose.data()};
    if (!cost.Evaluate(parameters, residuals.data(), jacobians)) return result;
    const statistics::GroupEquations<6, kSharedCount> own{by_pose.transpose() * by_pose,
                                                          by_pose.transpose() * by_shared,
                                                          by_pose.transpose() * residuals};
    result.information = by_shared.transpose() * by_shared;
    SharedVector score = by_shared.transpose() * residuals;
    own.Eliminate(result.information, score);
    result.pull = -score;
    return result;
  }

  /// J^T J / sigma^2 of the shared parameters after elimination of the poses, including the prior.
  SharedMatrix Information() const {
    SharedMatrix information = PriorCost(Deviations(), size_).Information();
    for (const ViewState& state : states_) information += InformationFrom(state).information;
    return information;
  }

  /// Mean energy, in units of sigma^2, of the views' residuals in the subspace that pose and shared
  /// parameters span, per degree of freedom. The fitted pose has already removed its own part.
  double Dispersion() const {
    double energy = 0;
    Eigen::Index freedom = 0;
    for (const ViewState& state : states_) {
      if (2 * CountUsed(state) <= 6 + kSharedCount) continue;
      const ViewCost cost(board_, state, sigma_px_);
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::VectorXd residuals(cost.num_residuals());
      RowMajor by_shared(cost.num_residuals(), static_cast<int>(kSharedCount));
      RowMajor by_pose(cost.num_residuals(), 6);
      const double* parameters[] = {shared_.data(), state.pose.data()};
      double* jacobians[] = {by_shared.data(), by_pose.data()};
      if (!cost.Evaluate(parameters, residuals.data(), jacobians)) continue;
      Eigen::MatrixXd both(cost.num_residuals(), 6 + kSharedCount);
      both << by_pose, by_shared;
      both *= both.colwise().norm().cwiseMax(1e-300).cwiseInverse().asDiagonal();
      Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(both);
      qr.setThreshold(kRankTolerance);
      const Eigen::VectorXd along = qr.householderQ().transpose() * residuals;
      energy += along.head(qr.rank()).squaredNorm();
      freedom += qr.rank() - 6;
    }
    // The fit removed this many degrees of freedom from the residuals.
    freedom -= kSharedCount;
    return freedom > 0 ? energy / static_cast<double>(freedom) : 1;
  }

  /// Drops distortion parameters whose standard deviation is hardly smaller than the prior's.
  /// @return whether any was dropped
  bool DropUnidentifiedTerms() {
    const SharedMatrix covariance = Information().inverse();
    const SharedVector sd = Deviations();
    bool any = false;
    for (const int k : {int{kK3}, int{kK2}, int{kP1}, int{kP2}}) {
      if (dropped_[k] || std::sqrt(covariance(k, k)) < kUnidentified * sd[k]) continue;
      dropped_[k] = true;
      shared_[k] = 0;
      any = true;
    }
    return any;
  }

  double Rms() const {
    double sum = 0;
    int used = 0;
    const auto residuals = Residuals();
    for (std::size_t j = 0; j < states_.size(); ++j) {
      for (std::size_t k = 0; k < residuals[j].size(); ++k) {
        if (!states_[j].used[k]) continue;
        sum += residuals[j][k].squaredNorm();
        ++used;
      }
    }
    return used > 0 ? std::sqrt(sum / used) : 1e9;
  }

  LensFit BuildResult() const {
    LensFit fit;
    fit.shared = shared_;
    SharedMatrix information = PriorCost(Deviations(), size_).Information();
    for (const ViewState& state : states_) {
      fit.view_information.push_back(InformationFrom(state));
      information += fit.view_information.back().information;
    }
    fit.covariance = information.inverse();
    fit.dropped = dropped_;
    fit.sigma_px = sigma_px_;
    fit.dispersion = Dispersion();
    fit.residuals_px = Residuals();
    fit.rms_px = Rms();
    fit.iterations = iterations_;
    for (std::size_t j = 0; j < states_.size(); ++j) {
      fit.X_CK.push_back(states_[j].X_CK());
      fit.used.push_back(states_[j].used);
      double sum = 0;
      for (std::size_t k = 0; k < fit.residuals_px[j].size(); ++k) {
        if (states_[j].used[k]) sum += fit.residuals_px[j][k].squaredNorm();
      }
      fit.view_rms_px.push_back(std::sqrt(sum / std::max(1, 2 * CountUsed(states_[j]))));
    }
    return fit;
  }

 private:
  SharedVector Deviations() const { return PriorDeviations(prior_, board_, size_, shared_[kFy]); }

  /// Cost of one view after a few Gauss-Newton steps of its pose alone; the best pose is kept,
  /// since the last step may lead behind the camera.
  double RefinedCost(ViewState& state) const {
    const ViewCost cost(board_, state, sigma_px_);
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::VectorXd residuals(cost.num_residuals());
    RowMajor by_pose(cost.num_residuals(), 6);
    double least = 1e300;
    Vec6 best = state.pose;
    for (int step = 0; step < 6; ++step) {
      const double* parameters[] = {shared_.data(), state.pose.data()};
      double* jacobians[] = {nullptr, by_pose.data()};
      if (!cost.Evaluate(parameters, residuals.data(), jacobians)) break;
      if (residuals.squaredNorm() < least) {
        least = residuals.squaredNorm();
        best = state.pose;
      }
      state.pose -= (by_pose.transpose() * by_pose).ldlt().solve(by_pose.transpose() * residuals);
    }
    state.pose = best;
    return least;
  }

  const target::Board& board_;
  image::ImageSize size_;
  LensPrior prior_;
  std::vector<ViewState> states_;
  SharedVector shared_ = SharedVector::Zero();
  std::array<bool, kSharedCount> dropped_{};
  double sigma_px_ = kStartSigma_px;
  int iterations_ = 0;
};

constexpr int kTrialIterations = 25;
constexpr int kMaxIterations = 100;

}  // namespace

Result<LensFit> FitLens(const target::Board& board, std::span<const BoardView> views,
                        image::ImageSize size, const LensPrior& prior) {
  if (views.size() < 3)
    return Error{fmt::format("only {} views of the board; at least 3 are needed", views.size())};
  Adjustment adjustment(board, views, size, prior);
  bool started = false;
  double best_rms = 0, best_guess = 0;
  for (const double guess : FocalGuesses(board, views, size)) {
    if (!adjustment.Start(guess) || !adjustment.Solve(kTrialIterations)) continue;
    const double rms = adjustment.Rms();
    if (!started || rms < best_rms) {
      best_rms = rms;
      best_guess = guess;
    }
    started = true;
    if (rms < kAcceptableStart_px) break;
  }
  if (!started) return Error{"no lens fits the views; take views from several directions"};
  if (best_rms >= kAcceptableStart_px) {
    if (!adjustment.Start(best_guess) || !adjustment.Solve(kMaxIterations))
      return Error{"no lens fits the views; take views from several directions"};
  }
  for (int round = 0; round < kRounds; ++round) {
    adjustment.UpdateDiscOffsets();
    adjustment.UpdateWeights();
    const bool flipped = round == 0 && adjustment.FixFlippedPoses();
    const bool dropped = round == 1 && adjustment.DropUnidentifiedTerms();
    if (!adjustment.Solve(kMaxIterations)) return Error{"the lens fit does not converge"};
    if (round >= 2 && !flipped && !dropped) break;
  }
  return adjustment.BuildResult();
}

}  // namespace plumbline::vision
