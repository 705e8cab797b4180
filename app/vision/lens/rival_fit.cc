#include "app/vision/lens/rival_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/vision/lens/disc_offsets.h"
#include "app/vision/lens/lens_costs.h"

namespace plumbline::vision {
namespace {

constexpr int kMaxPoints = 64;  // of a board
// A window, a stretch of a long lens's print and the distance of the board nearly cancel, so that
// twelve steps are too few; fits with parameters of each view take several times as long each.
constexpr int kMaxSteps = 40, kMaxLocalSteps = 20, kMaxTrials = 6;
constexpr double kConverged = 2e-4;     // relative decrease of the cost
constexpr double kSquareAspect = 3e-4;  // standard deviation of fx / fy of an unscaled sensor
constexpr double kFreeAspect = 0.1;
constexpr double kFisheyeDistortion = 0.3;
constexpr double kRationalDistortion = 2;  // of each term at the corners of the image

/// Every point, or those of a diagonal pattern.
std::vector<std::size_t> Thinned(const target::Board& board) {
  const int stride = (board.corners() + kMaxPoints - 1) / kMaxPoints;
  std::vector<std::size_t> corners;
  for (int k = 0; k < board.corners(); ++k) {
    if ((k % board.columns + k / board.columns) % stride == 0)
      corners.push_back(static_cast<std::size_t>(k));
  }
  return corners;
}

Mat3 Turn(const Vec3& w) {
  const double angle = w.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, w / angle).toRotationMatrix()
                   : Mat3(Mat3::Identity());
}

bool IsRational(const Rival& rival) {
  return !rival.fisheye && std::ranges::find(rival.global, kK4) != rival.global.end();
}

/// Parameters that all views share.
std::vector<int> CommonExtras(const Rival& rival) {
  std::vector<int> extras = rival.global;
  extras.insert(extras.end(), rival.changing.begin(), rival.changing.end());
  return extras;
}

}  // namespace

RivalProblem::RivalProblem(const target::Board& board, std::span<const BoardView> views,
                           image::ImageSize size, const LensFit& fit,
                           const std::vector<std::vector<bool>>& used, double noise_px)
    : size_(size),
      declared_(board),
      board_(board, Thinned(board)),
      noise_px_(noise_px),
      deviations_(ExtraDeviations(board_, size)) {
  for (std::size_t j = 0; j < views.size(); ++j) {
    ViewData data;
    for (const RivalBoard::Point& point : board_.points()) {
      data.rows_px.push_back(views[j].corners_px[point.corner].y());
      data.corners_px.push_back(views[j].corners_px[point.corner]);
      data.used.push_back(used[j][point.corner]);
    }
    if (board.circles()) {
      const std::vector<lens::Vec2> offsets = DiscOffsets(board, fit.shared, fit.X_CK[j]);
      for (std::size_t k = 0; k < data.corners_px.size(); ++k)
        data.corners_px[k] -= offsets[board_.points()[k].corner];
    }
    views_.push_back(std::move(data));
  }
  start_.shared = fit.shared;
  start_.X_CK = fit.X_CK;
  start_.local.assign(views.size(), ExtraVector::Zero());
}

ExtraVector RivalProblem::ExtraOf(const Rival& rival, const RivalResult& at, std::size_t j) {
  ExtraVector extra = at.extra;
  for (const int k : rival.changing) extra[k] *= rival.course[j];
  return extra + at.local[j];
}

Pose RivalProblem::Moved(const Pose& X_CK, const Eigen::Ref<const Vec6>& step) {
  return {X_CK.R * Turn(step.head<3>()), X_CK.p + step.tail<3>()};
}

bool RivalProblem::ResidualsOf(std::size_t j, const Rival& rival, const SharedVector& shared,
                               const ExtraVector& extra, const Pose& X_CK,
                               Eigen::VectorXd& residuals) const {
  const ViewData& view = views_[j];
  std::vector<lens::Vec2> pixels;
  if (!RivalPixels(board_, size_, rival.fisheye, shared, extra, X_CK, view.rows_px, pixels))
    return false;
  residuals.setZero(2 * static_cast<Eigen::Index>(pixels.size()));
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    if (view.used[k])
      residuals.segment<2>(2 * static_cast<Eigen::Index>(k)) = pixels[k] - view.corners_px[k];
  }
  return true;
}

/// Prior of the extra parameters. A lens that needs a denominator may have a large one, which its
/// numerator nearly cancels.
ExtraVector RivalProblem::DeviationsOf(const Rival& rival) const {
  ExtraVector deviations = deviations_;
  if (!IsRational(rival)) return deviations;
  const double corner = 0.5 * std::hypot(size_.width, size_.height) / start_.shared[kFy];
  for (int k = 0; k < 3; ++k)
    deviations[kK4 + k] = kRationalDistortion / std::pow(corner, 2 * k + 2);
  return deviations;
}

SharedMatrix RivalProblem::PriorInformation(const Rival& rival, const SharedVector& shared,
                                            SharedVector& mean) const {
  LensPrior prior;
  prior.aspect = rival.free_aspect ? kFreeAspect : kSquareAspect;
  SharedVector sd = PriorDeviations(prior, declared_, size_, shared[kFy]);
  if (rival.fisheye) {
    for (const int k : {kK1, kK2, kK3}) sd[k] = kFisheyeDistortion;
  } else if (IsRational(rival)) {
    const ExtraVector deviations = DeviationsOf(rival);
    sd[kK1] = std::hypot(sd[kK1], deviations[kK4]);
    sd[kK2] = std::hypot(sd[kK2], deviations[kK5]);
    sd[kK3] = std::hypot(sd[kK3], deviations[kK6]);
  }
  mean.setZero();
  mean[kCx] = 0.5 * (size_.width - 1);
  mean[kCy] = 0.5 * (size_.height - 1);
  return vision::PriorCost(sd, size_).Information();
}

double RivalProblem::PriorCost(const Rival& rival, const RivalResult& at) const {
  SharedVector mean;
  const SharedMatrix information = PriorInformation(rival, at.shared, mean);
  const SharedVector away = at.shared - mean;
  double chi2 = away.dot(information * away);
  const ExtraVector deviations = DeviationsOf(rival);
  chi2 += at.extra.cwiseQuotient(deviations).squaredNorm();
  for (const ExtraVector& local : at.local) chi2 += local.cwiseQuotient(deviations).squaredNorm();
  return chi2;
}

bool RivalProblem::Evaluate(const Rival& rival, const RivalResult& at, double& cost) const {
  cost = 0;
  Eigen::VectorXd residuals;
  for (std::size_t j = 0; j < views_.size(); ++j) {
    if (!ResidualsOf(j, rival, at.shared, ExtraOf(rival, at, j), at.X_CK[j], residuals))
      return false;
    cost += residuals.squaredNorm();
  }
  cost += noise_px_ * noise_px_ * PriorCost(rival, at);
  return std::isfinite(cost);
}

RivalResult RivalProblem::Fit(const Rival& rival) const {
  return Fit(rival, start_);
}

RivalProblem::OwnEquations RivalProblem::EquationsOf(const Blocks& block) {
  return {block.own.transpose() * block.own, block.own.transpose() * block.common,
          block.own.transpose() * block.residuals};
}

RivalProblem::NormalEquations RivalProblem::NormalEquationsOf(
    const Rival& rival, const RivalResult& at, const std::vector<Blocks>& blocks) const {
  const std::vector<int> extras = CommonExtras(rival);
  const Eigen::Index common = kSharedCount + static_cast<Eigen::Index>(extras.size());
  const double noise2 = noise_px_ * noise_px_;
  NormalEquations normal{Eigen::MatrixXd::Zero(common, common), Eigen::VectorXd::Zero(common), {}};
  const ExtraVector deviations = DeviationsOf(rival);
  SharedVector mean;
  const SharedMatrix information = PriorInformation(rival, at.shared, mean);
  normal.H.topLeftCorner<kSharedCount, kSharedCount>() = noise2 * information;
  normal.g.head<kSharedCount>() = noise2 * information * (at.shared - mean);
  for (std::size_t k = 0; k < extras.size(); ++k) {
    const double weight = noise2 / std::pow(deviations[extras[k]], 2);
    normal.H(kSharedCount + k, kSharedCount + k) += weight;
    normal.g[kSharedCount + k] += weight * at.extra[extras[k]];
  }
  for (std::size_t j = 0; j < blocks.size(); ++j) {
    const Blocks& block = blocks[j];
    OwnEquations own = EquationsOf(block);
    for (std::size_t k = 0; k < rival.local.size(); ++k) {
      const double weight = noise2 / std::pow(deviations[rival.local[k]], 2);
      own.A(6 + k, 6 + k) += weight;
      own.a[6 + k] += weight * at.local[j][rival.local[k]];
    }
    normal.H += block.common.transpose() * block.common;
    normal.g += block.common.transpose() * block.residuals;
    normal.own.push_back(std::move(own));
  }
  return normal;
}

RivalResult RivalProblem::Stepped(const Rival& rival, const RivalResult& at,
                                  const NormalEquations& normal, double damping) const {
  const std::vector<int> extras = CommonExtras(rival);
  Eigen::MatrixXd S = normal.H;
  Eigen::VectorXd s = normal.g;
  S.diagonal() *= 1 + damping;
  std::vector<OwnEquations::Factor> factors;
  for (const OwnEquations& own : normal.own) factors.push_back(own.Eliminate(S, s, damping));
  const Eigen::VectorXd d = -S.ldlt().solve(s);
  RivalResult next = at;
  next.shared += d.head<kSharedCount>();
  for (std::size_t k = 0; k < extras.size(); ++k) next.extra[extras[k]] += d[kSharedCount + k];
  for (std::size_t j = 0; j < normal.own.size(); ++j) {
    const Eigen::VectorXd e = normal.own[j].Step(factors[j], d);
    next.X_CK[j] = Moved(next.X_CK[j], e.head<6>());
    for (std::size_t k = 0; k < rival.local.size(); ++k) next.local[j][rival.local[k]] += e[6 + k];
  }
  return next;
}

RivalResult RivalProblem::Fit(const Rival& rival, RivalResult at) const {
  at.converged = false;
  double cost = 0, damping = 1e-8;
  if (!Evaluate(rival, at, cost)) return at;
  std::vector<Blocks> blocks;
  const int most = rival.local.empty() ? kMaxSteps : kMaxLocalSteps;
  for (int step = 0; step < most; ++step) {
    if (!Linearize(rival, at, blocks)) return at;
    const NormalEquations normal = NormalEquationsOf(rival, at, blocks);
    const double before = cost;
    bool better = false;
    for (int trial = 0; trial < kMaxTrials && !better; ++trial) {
      RivalResult next = Stepped(rival, at, normal, damping);
      double next_cost = 0;
      better = next.shared.allFinite() && next.shared[kFx] > 0 &&
               Evaluate(rival, next, next_cost) && next_cost < cost;
      damping = better ? std::max(1e-9, 0.1 * damping) : 20 * damping;
      if (!better) continue;
      at = std::move(next);
      cost = next_cost;
    }
    if (!better || before - cost < kConverged * before) break;
  }
  at.converged = true;
  at.prior_chi2 = PriorCost(rival, at);
  at.square_sum_px2 = cost - noise_px_ * noise_px_ * at.prior_chi2;
  at.observations = 0;
  for (const ViewData& view : views_)
    at.observations += 2 * static_cast<int>(std::ranges::count(view.used, true));
  at.parameters = static_cast<int>(CommonExtras(rival).size() + rival.local.size() * views_.size());
  return at;
}

}  // namespace plumbline::vision
