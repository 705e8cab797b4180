#include "app/lens/lens_fit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/lens/disc_offsets.h"
#include "app/lens/lens_costs.h"
#include "app/lens/lens_start.h"
#include "firmware-like/statistics/median.h"

namespace plumbline {
namespace {

constexpr double kOutlier = 4.5;  // robust standard deviations
constexpr double kLeastSigma_px = 1e-3;
constexpr double kStartSigma_px = 0.1;
constexpr double kNotHeld = 0.8;     // posterior over prior deviation at which a term is dropped
constexpr double kGoodStart_px = 5;  // RMS above which another focal length is tried
constexpr double kSameDirection = 1e-4;  // columns of a view that agree so far are one
constexpr int kRounds = 4;
constexpr double kRobustOfMad = 1.4826;

/// One least-squares problem: everything placed, and what is dropped.
class Adjustment {
 public:
  Adjustment(const Board& board, std::span<const BoardView> views, ImageSize size,
             const LensPrior& prior)
      : board_(board), size_(size), prior_(prior), placed_(views.size()) {
    for (std::size_t j = 0; j < views.size(); ++j) {
      placed_[j].view = &views[j];
      placed_[j].used = views[j].seen;
      placed_[j].offsets.assign(views[j].seen.size(), Vec2::Zero());
    }
  }

  /// Poses from the homographies for a lens of focal length f without distortion.
  bool Start(double f) {
    Lens lens;
    lens.fx = lens.fy = f;
    lens.cx = 0.5 * (size_.width - 1);
    lens.cy = 0.5 * (size_.height - 1);
    shared_ = SharedOfLens(lens);
    sigma_px_ = kStartSigma_px;
    for (PlacedView& placed : placed_) {
      placed.used = placed.view->seen;
      const std::vector<Pose> poses = BoardPoses(board_, *placed.view, lens);
      if (poses.empty()) return false;
      placed.Place(poses[0]);
    }
    return true;
  }

  bool Solve(int most_iterations) {
    ceres::Problem problem;
    auto* ordering = new ceres::ParameterBlockOrdering;
    for (PlacedView& placed : placed_) {
      if (CornersUsed(placed) == 0) continue;
      problem.AddResidualBlock(new ViewCost(board_, placed, sigma_px_), nullptr, shared_.data(),
                               placed.pose.data());
      ordering->AddElementToGroup(placed.pose.data(), 0);
    }
    problem.AddResidualBlock(new PriorCost(Deviations(), size_), nullptr, shared_.data());
    ordering->AddElementToGroup(shared_.data(), 1);
    std::vector<int> held;
    for (int k = 0; k < kSharedCount; ++k) {
      if (dropped_[k]) held.push_back(k);
    }
    if (!held.empty()) {
      problem.SetManifold(shared_.data(), new ceres::SubsetManifold(kSharedCount, held));
    }
    ceres::Solver::Options options;
    options.linear_solver_type = ceres::DENSE_SCHUR;
    options.linear_solver_ordering.reset(ordering);
    options.max_num_iterations = most_iterations;
    options.function_tolerance = 1e-9;
    options.logging_type = ceres::SILENT;
    options.num_threads = 1;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &problem, &summary);
    iterations_ += static_cast<int>(summary.iterations.size());
    return summary.IsSolutionUsable() && shared_.allFinite() && shared_[kFx] > 0 &&
           shared_[kFy] > 0;
  }

  /// Residuals of all corners seen.
  std::vector<std::vector<Vec2>> Residuals() const {
    std::vector<std::vector<Vec2>> all;
    for (const PlacedView& placed : placed_) {
      std::vector<Vec2> pixels;
      const bool in_front = BoardPixels(board_, shared_, placed.R_start, placed.pose.head<3>(),
                                        placed.pose.tail<3>(), pixels, nullptr, nullptr);
      std::vector<Vec2> residuals(placed.view->seen.size(), Vec2::Zero());
      for (std::size_t k = 0; k < residuals.size(); ++k) {
        if (!placed.view->seen[k]) continue;
        residuals[k] = in_front ? Vec2(placed.Seen(k) - pixels[k]) : Vec2(1e3, 1e3);
      }
      all.push_back(std::move(residuals));
    }
    return all;
  }

  /// Discs are not seen where their centres are: by how much, the lens and the poses tell.
  void PlaceDiscs() {
    if (!board_.circles()) return;
    for (PlacedView& placed : placed_) placed.offsets = DiscOffsets(board_, shared_, placed.X_CK());
  }

  /// Sets sigma from the middle of the residuals and leaves the wild corners out.
  void Weigh() {
    const auto residuals = Residuals();
    std::vector<double> sizes;
    for (std::size_t j = 0; j < placed_.size(); ++j) {
      for (std::size_t k = 0; k < residuals[j].size(); ++k) {
        if (!placed_[j].view->seen[k]) continue;
        sizes.push_back(std::abs(residuals[j][k].x()));
        sizes.push_back(std::abs(residuals[j][k].y()));
      }
    }
    const double robust = std::max(kLeastSigma_px, kRobustOfMad * MedianOf(sizes));
    double sum = 0;
    int used = 0;
    for (std::size_t j = 0; j < placed_.size(); ++j) {
      for (std::size_t k = 0; k < residuals[j].size(); ++k) {
        placed_[j].used[k] =
            placed_[j].view->seen[k] && residuals[j][k].cwiseAbs().maxCoeff() < kOutlier * robust;
        if (!placed_[j].used[k]) continue;
        sum += residuals[j][k].squaredNorm();
        ++used;
      }
    }
    const int freedom = 2 * used - kSharedCount - 6 * static_cast<int>(placed_.size());
    sigma_px_ = std::max(kLeastSigma_px, freedom > 0 ? std::sqrt(sum / freedom) : robust);
  }

  /// Tries the other pose that each nearly flat view allows. @return whether any was better
  bool SetFlippedRight() {
    bool any = false;
    const Lens lens = LensOfShared(shared_);
    for (PlacedView& placed : placed_) {
      for (const Pose& X_CK : BoardPoses(board_, *placed.view, lens)) {
        PlacedView other = placed;
        other.Place(X_CK);
        if (RefinedCost(other) < 0.9 * RefinedCost(placed)) {
          placed = other;
          any = true;
        }
      }
    }
    return any;
  }

  ToldByView Told(const PlacedView& placed) const {
    ToldByView told;
    if (CornersUsed(placed) < 6) return told;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const ViewCost cost(board_, placed, sigma_px_);
    const int rows = cost.num_residuals();
    Eigen::VectorXd residuals(rows);
    RowMajor by_shared(rows, static_cast<int>(kSharedCount)), by_pose(rows, 6);
    const double* parameters[] = {shared_.data(), placed.pose.data()};
    double* jacobians[] = {by_shared.data(), by_pose.data()};
    if (!cost.Evaluate(parameters, residuals.data(), jacobians)) return told;
    const auto C = Eigen::Matrix<double, 6, 6>(by_pose.transpose() * by_pose).ldlt();
    const Eigen::Matrix<double, 6, kSharedCount> B = by_pose.transpose() * by_shared;
    told.information = SharedMatrix(by_shared.transpose() * by_shared) - B.transpose() * C.solve(B);
    told.pull = B.transpose() * C.solve(by_pose.transpose() * residuals) -
                by_shared.transpose() * residuals;
    return told;
  }

  /// J^T J / sigma^2 of the shared parameters after the poses are eliminated, with the prior.
  SharedMatrix Information() const {
    SharedMatrix information = PriorCost(Deviations(), size_).Information();
    for (const PlacedView& placed : placed_) information += Told(placed).information;
    return information;
  }

  /// Energy of each view's residuals along what its pose and the shared parameters can do, for each
  /// degree of freedom, over sigma^2. The pose has taken its own part already.
  double Dispersion() const {
    double energy = 0;
    Eigen::Index freedom = 0;
    for (const PlacedView& placed : placed_) {
      if (2 * CornersUsed(placed) <= 6 + kSharedCount) continue;
      const ViewCost cost(board_, placed, sigma_px_);
      using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
      Eigen::VectorXd residuals(cost.num_residuals());
      RowMajor by_shared(cost.num_residuals(), static_cast<int>(kSharedCount));
      RowMajor by_pose(cost.num_residuals(), 6);
      const double* parameters[] = {shared_.data(), placed.pose.data()};
      double* jacobians[] = {by_shared.data(), by_pose.data()};
      if (!cost.Evaluate(parameters, residuals.data(), jacobians)) continue;
      Eigen::MatrixXd both(cost.num_residuals(), 6 + kSharedCount);
      both << by_pose, by_shared;
      both *= both.colwise().norm().cwiseMax(1e-300).cwiseInverse().asDiagonal();
      Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(both);
      qr.setThreshold(kSameDirection);
      const Eigen::VectorXd along = qr.householderQ().transpose() * residuals;
      energy += along.head(qr.rank()).squaredNorm();
      freedom += qr.rank() - 6;
    }
    // What the fit itself took out of the residuals.
    freedom -= kSharedCount;
    return freedom > 0 ? energy / static_cast<double>(freedom) : 1;
  }

  /// Drops the terms whose deviation the views have hardly made smaller. @return whether any
  bool DropWhatIsNotHeld() {
    const SharedMatrix covariance = Information().inverse();
    const SharedVector sd = Deviations();
    bool any = false;
    for (const int k : {int{kK3}, int{kK2}, int{kP1}, int{kP2}}) {
      if (dropped_[k] || std::sqrt(covariance(k, k)) < kNotHeld * sd[k]) continue;
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
    for (std::size_t j = 0; j < placed_.size(); ++j) {
      for (std::size_t k = 0; k < residuals[j].size(); ++k) {
        if (!placed_[j].used[k]) continue;
        sum += residuals[j][k].squaredNorm();
        ++used;
      }
    }
    return used > 0 ? std::sqrt(sum / used) : 1e9;
  }

  LensFit Finished() const {
    LensFit fit;
    fit.shared = shared_;
    SharedMatrix information = PriorCost(Deviations(), size_).Information();
    for (const PlacedView& placed : placed_) {
      fit.told.push_back(Told(placed));
      information += fit.told.back().information;
    }
    fit.covariance = information.inverse();
    fit.dropped = dropped_;
    fit.sigma_px = sigma_px_;
    fit.dispersion = Dispersion();
    fit.residuals_px = Residuals();
    fit.rms_px = Rms();
    fit.iterations = iterations_;
    for (std::size_t j = 0; j < placed_.size(); ++j) {
      fit.X_CK.push_back(placed_[j].X_CK());
      fit.used.push_back(placed_[j].used);
      double sum = 0;
      for (std::size_t k = 0; k < fit.residuals_px[j].size(); ++k) {
        if (placed_[j].used[k]) sum += fit.residuals_px[j][k].squaredNorm();
      }
      fit.view_rms_px.push_back(std::sqrt(sum / std::max(1, 2 * CornersUsed(placed_[j]))));
    }
    return fit;
  }

 private:
  SharedVector Deviations() const { return PriorDeviations(prior_, board_, size_, shared_[kFy]); }

  /// Cost of one view after a few steps of its pose alone.
  double RefinedCost(PlacedView& placed) const {
    const ViewCost cost(board_, placed, sigma_px_);
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::VectorXd residuals(cost.num_residuals());
    RowMajor by_pose(cost.num_residuals(), 6);
    double least = 1e300;
    for (int step = 0; step < 6; ++step) {
      const double* parameters[] = {shared_.data(), placed.pose.data()};
      double* jacobians[] = {nullptr, by_pose.data()};
      if (!cost.Evaluate(parameters, residuals.data(), jacobians)) return 1e300;
      least = std::min(least, residuals.squaredNorm());
      placed.pose -= (by_pose.transpose() * by_pose).ldlt().solve(by_pose.transpose() * residuals);
    }
    return least;
  }

  const Board& board_;
  ImageSize size_;
  LensPrior prior_;
  std::vector<PlacedView> placed_;
  SharedVector shared_ = SharedVector::Zero();
  std::array<bool, kSharedCount> dropped_{};
  double sigma_px_ = kStartSigma_px;
  int iterations_ = 0;
};

constexpr int kTrialIterations = 25;
constexpr int kMostIterations = 100;

}  // namespace

Result<LensFit> FitLens(const Board& board, std::span<const BoardView> views, ImageSize size,
                        const LensPrior& prior) {
  if (views.size() < 3)
    return Error{fmt::format("{} views of the board; at least 3 are needed", views.size())};
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
    if (rms < kGoodStart_px) break;
  }
  if (!started) return Error{"the views fit no lens; take views from several directions"};
  if (best_rms >= kGoodStart_px) {
    if (!adjustment.Start(best_guess) || !adjustment.Solve(kMostIterations))
      return Error{"the views fit no lens; take views from several directions"};
  }
  for (int round = 0; round < kRounds; ++round) {
    adjustment.PlaceDiscs();
    adjustment.Weigh();
    const bool flipped = round == 0 && adjustment.SetFlippedRight();
    const bool dropped = round == 1 && adjustment.DropWhatIsNotHeld();
    if (!adjustment.Solve(kMostIterations)) return Error{"the fit of the lens does not converge"};
    if (round >= 2 && !flipped && !dropped) break;
  }
  return adjustment.Finished();
}

}  // namespace plumbline
