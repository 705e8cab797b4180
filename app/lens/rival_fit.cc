#include "app/lens/rival_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "app/lens/disc_offsets.h"
#include "app/lens/lens_costs.h"

namespace plumbline::lens {
namespace {

constexpr int kMaxPoints = 64;  // of a board
constexpr int kMaxSteps = 12, kMaxTrials = 6;
constexpr double kConverged = 2e-4;     // relative decrease of the cost
constexpr double kSquareAspect = 3e-4;  // standard deviation of fx / fy of an unscaled sensor
constexpr double kFreeAspect = 0.1;
constexpr double kFisheyeDistortion = 0.3;

/// Every point, or those of a diagonal pattern.
std::vector<std::size_t> Thinned(const Board& board) {
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

Pose Moved(const Pose& X_CK, const Eigen::Ref<const Vec6>& step) {
  return {X_CK.R * Turn(step.head<3>()), X_CK.p + step.tail<3>()};
}

/// Step of a numerical derivative.
double SharedStep(int k, const SharedVector& shared) {
  if (k <= kFy) return 1e-6 * shared[kFx];
  if (k <= kCy) return 1e-3;
  return k >= kBowX ? 1e-5 : 1e-7;
}

/// Parameters that all views share.
std::vector<int> CommonExtras(const Rival& rival) {
  std::vector<int> extras = rival.global;
  extras.insert(extras.end(), rival.changing.begin(), rival.changing.end());
  return extras;
}

/// Extra parameters of view j.
ExtraVector ExtraOf(const Rival& rival, const RivalResult& at, std::size_t j) {
  ExtraVector extra = at.extra;
  for (const int k : rival.changing) extra[k] *= rival.course[j];
  return extra + at.local[j];
}

}  // namespace

RivalProblem::RivalProblem(const Board& board, std::span<const BoardView> views,
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
      const std::vector<Vec2> offsets = DiscOffsets(board, fit.shared, fit.X_CK[j]);
      for (std::size_t k = 0; k < data.corners_px.size(); ++k)
        data.corners_px[k] -= offsets[board_.points()[k].corner];
    }
    views_.push_back(std::move(data));
  }
  start_.shared = fit.shared;
  start_.X_CK = fit.X_CK;
  start_.local.assign(views.size(), ExtraVector::Zero());
}

bool RivalProblem::ResidualsOf(std::size_t j, const Rival& rival, const SharedVector& shared,
                               const ExtraVector& extra, const Pose& X_CK,
                               Eigen::VectorXd& residuals) const {
  const ViewData& view = views_[j];
  std::vector<Vec2> pixels;
  if (!RivalPixels(board_, size_, rival.fisheye, shared, extra, X_CK, view.rows_px, pixels))
    return false;
  residuals.setZero(2 * static_cast<Eigen::Index>(pixels.size()));
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    if (view.used[k])
      residuals.segment<2>(2 * static_cast<Eigen::Index>(k)) = pixels[k] - view.corners_px[k];
  }
  return true;
}

SharedMatrix RivalProblem::PriorInformation(const Rival& rival, const SharedVector& shared,
                                            SharedVector& mean) const {
  LensPrior prior;
  prior.aspect = rival.free_aspect ? kFreeAspect : kSquareAspect;
  SharedVector sd = PriorDeviations(prior, declared_, size_, shared[kFy]);
  if (rival.fisheye) {
    for (const int k : {kK1, kK2, kK3}) sd[k] = kFisheyeDistortion;
  }
  mean.setZero();
  mean[kCx] = 0.5 * (size_.width - 1);
  mean[kCy] = 0.5 * (size_.height - 1);
  return lens::PriorCost(sd, size_).Information();
}

double RivalProblem::PriorCost(const Rival& rival, const RivalResult& at) const {
  SharedVector mean;
  const SharedMatrix information = PriorInformation(rival, at.shared, mean);
  const SharedVector away = at.shared - mean;
  double chi2 = away.dot(information * away);
  chi2 += at.extra.cwiseQuotient(deviations_).squaredNorm();
  for (const ExtraVector& local : at.local) chi2 += local.cwiseQuotient(deviations_).squaredNorm();
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

bool RivalProblem::LinearizeExtras(std::size_t j, const Rival& rival, const RivalResult& at,
                                   Blocks& block) const {
  const ExtraVector extra = ExtraOf(rival, at, j);
  Eigen::VectorXd moved;
  const auto by_extra = [&](int parameter, double weight, Eigen::Ref<Eigen::VectorXd> column) {
    const double step = 1e-5 * deviations_[parameter];
    ExtraVector changed = extra;
    changed[parameter] += step;
    if (!ResidualsOf(j, rival, at.shared, changed, at.X_CK[j], moved)) return false;
    column = weight * (moved - block.residuals) / step;
    return true;
  };
  for (std::size_t k = 0; k < rival.local.size(); ++k) {
    if (!by_extra(rival.local[k], 1, block.own.col(6 + k))) return false;
  }
  // The smooth functions displace each point along one axis, by their value there.
  Eigen::MatrixXd by_offset(block.residuals.size(), 3);
  const bool smooth =
      std::any_of(rival.global.begin(), rival.global.end(), [](int k) { return k >= kHeight; });
  for (int axis = 0; smooth && axis < 3; ++axis) {
    if (!by_extra(kOffsetX + axis, 1, by_offset.col(axis))) return false;
  }
  Eigen::Index column = kSharedCount;
  for (const int k : rival.global) {
    if (k < kHeight) {
      if (!by_extra(k, 1, block.common.col(column++))) return false;
      continue;
    }
    if (k >= kFree) {  // displaces one point only
      const Eigen::Index row = 2 * ((k - kFree) / 3);
      block.common.col(column).setZero();
      block.common.col(column++).segment<2>(row) = by_offset.col((k - kFree) % 3).segment<2>(row);
      continue;
    }
    const int axis = k >= kPrintY ? 1 : k >= kPrintX ? 0 : 2;
    for (std::size_t i = 0; i < board_.points().size(); ++i) {
      const RivalBoard::Point& point = board_.points()[i];
      const double value =
          k < kPrintX ? point.height[k - kHeight] : point.print[(k - kPrintX) % kPrintTerms];
      const Eigen::Index row = 2 * static_cast<Eigen::Index>(i);
      block.common.col(column).segment<2>(row) = value * by_offset.col(axis).segment<2>(row);
    }
    ++column;
  }
  for (const int k : rival.changing) {
    if (!by_extra(k, rival.course[j], block.common.col(column++))) return false;
  }
  return true;
}

bool RivalProblem::Linearize(const Rival& rival, const RivalResult& at,
                             std::vector<Blocks>& blocks) const {
  const auto locals = static_cast<Eigen::Index>(rival.local.size());
  const auto globals = static_cast<Eigen::Index>(rival.global.size() + rival.changing.size());
  blocks.resize(views_.size());
  Eigen::VectorXd moved;
  for (std::size_t j = 0; j < views_.size(); ++j) {
    Blocks& block = blocks[j];
    const ExtraVector extra = ExtraOf(rival, at, j);
    if (!ResidualsOf(j, rival, at.shared, extra, at.X_CK[j], block.residuals)) return false;
    block.own.resize(block.residuals.size(), 6 + locals);
    block.common.resize(block.residuals.size(), kSharedCount + globals);
    for (int k = 0; k < 6; ++k) {
      const double step = k < 3 ? 1e-7 : 1e-7 * at.X_CK[j].p.norm();
      const Pose X_CK = Moved(at.X_CK[j], step * Vec6::Unit(k));
      if (!ResidualsOf(j, rival, at.shared, extra, X_CK, moved)) return false;
      block.own.col(k) = (moved - block.residuals) / step;
    }
    for (int k = 0; k < kSharedCount; ++k) {
      const double step = SharedStep(k, at.shared);
      const SharedVector shared = at.shared + step * SharedVector::Unit(k);
      if (!ResidualsOf(j, rival, shared, extra, at.X_CK[j], moved)) return false;
      block.common.col(k) = (moved - block.residuals) / step;
    }
    if (!LinearizeExtras(j, rival, at, block)) return false;
  }
  return true;
}

RivalResult RivalProblem::Fit(const Rival& rival) const {
  return Fit(rival, start_);
}

RivalProblem::NormalEquations RivalProblem::NormalEquationsOf(
    const Rival& rival, const RivalResult& at, const std::vector<Blocks>& blocks) const {
  const std::vector<int> extras = CommonExtras(rival);
  const Eigen::Index common = kSharedCount + static_cast<Eigen::Index>(extras.size());
  const double noise2 = noise_px_ * noise_px_;
  NormalEquations normal{Eigen::MatrixXd::Zero(common, common), Eigen::VectorXd::Zero(common), {}};
  SharedVector mean;
  const SharedMatrix information = PriorInformation(rival, at.shared, mean);
  normal.H.topLeftCorner<kSharedCount, kSharedCount>() = noise2 * information;
  normal.g.head<kSharedCount>() = noise2 * information * (at.shared - mean);
  for (std::size_t k = 0; k < extras.size(); ++k) {
    const double weight = noise2 / std::pow(deviations_[extras[k]], 2);
    normal.H(kSharedCount + k, kSharedCount + k) += weight;
    normal.g[kSharedCount + k] += weight * at.extra[extras[k]];
  }
  for (std::size_t j = 0; j < blocks.size(); ++j) {
    const Blocks& block = blocks[j];
    OwnEquations own{block.own.transpose() * block.own, block.own.transpose() * block.common,
                     block.own.transpose() * block.residuals};
    for (std::size_t k = 0; k < rival.local.size(); ++k) {
      const double weight = noise2 / std::pow(deviations_[rival.local[k]], 2);
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
  std::vector<Eigen::LDLT<Eigen::MatrixXd>> factors;
  for (const OwnEquations& own : normal.own) {
    Eigen::MatrixXd A = own.A;
    A.diagonal() *= 1 + damping;
    factors.emplace_back(A);
    S -= own.B.transpose() * factors.back().solve(own.B);
    s -= own.B.transpose() * factors.back().solve(own.a);
  }
  const Eigen::VectorXd d = -S.ldlt().solve(s);
  RivalResult next = at;
  next.shared += d.head<kSharedCount>();
  for (std::size_t k = 0; k < extras.size(); ++k) next.extra[extras[k]] += d[kSharedCount + k];
  for (std::size_t j = 0; j < normal.own.size(); ++j) {
    const Eigen::VectorXd e = -factors[j].solve(normal.own[j].a + normal.own[j].B * d);
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
  for (int step = 0; step < kMaxSteps; ++step) {
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
    at.observations += 2 * static_cast<int>(std::count(view.used.begin(), view.used.end(), true));
  at.parameters = static_cast<int>(CommonExtras(rival).size() + rival.local.size() * views_.size());
  return at;
}

std::vector<ScoreTest> RivalProblem::ScoreTests(const std::vector<Rival>& rivals,
                                                const RivalResult& plain) const {
  // All columns of all rivals once; each rival is a choice of columns.
  Rival all;
  std::vector<int> place(kExtraCount, -1);
  for (const Rival& rival : rivals) {
    for (const auto* list : {&rival.global, &rival.local}) {
      for (const int k : *list) {
        if (place[k] >= 0) continue;
        place[k] = 6 + kSharedCount + static_cast<int>(all.global.size());
        all.global.push_back(k);
      }
    }
  }
  std::vector<Blocks> blocks;
  std::vector<ScoreTest> tests(rivals.size());
  if (!Linearize(all, plain, blocks)) return tests;
  std::vector<Eigen::MatrixXd> squares;
  std::vector<Eigen::VectorXd> scores;
  for (const Blocks& block : blocks) {
    Eigen::MatrixXd J(block.own.rows(), block.own.cols() + block.common.cols());
    J << block.own, block.common;
    squares.emplace_back(J.transpose() * J);
    scores.emplace_back(J.transpose() * block.residuals);
  }
  SharedVector mean;
  const SharedMatrix information = PriorInformation({}, plain.shared, mean);
  const auto step = [&](const Rival& rival) {
    std::vector<int> own{0, 1, 2, 3, 4, 5}, common;
    for (int k = 0; k < kSharedCount; ++k) common.push_back(6 + k);
    for (const int k : rival.local) own.push_back(place[k]);
    for (const int k : rival.global) common.push_back(place[k]);
    Eigen::MatrixXd S = Eigen::MatrixXd::Zero(common.size(), common.size());
    S.topLeftCorner<kSharedCount, kSharedCount>() = noise_px_ * noise_px_ * information;
    for (std::size_t k = kSharedCount; k < common.size(); ++k)
      S(k, k) = std::pow(noise_px_ / deviations_[rival.global[k - kSharedCount]], 2);
    Eigen::VectorXd s = Eigen::VectorXd::Zero(common.size());
    double sum = 0;
    for (std::size_t j = 0; j < squares.size(); ++j) {
      Eigen::MatrixXd A = squares[j](own, own);
      for (std::size_t k = 6; k < own.size(); ++k)
        A(k, k) += std::pow(noise_px_ / deviations_[rival.local[k - 6]], 2);
      const Eigen::MatrixXd B = squares[j](own, common);
      const Eigen::VectorXd a = scores[j](own);
      const auto factor = A.ldlt();
      S += squares[j](common, common) - B.transpose() * factor.solve(B);
      s += scores[j](common) - B.transpose() * factor.solve(a);
      sum += a.dot(factor.solve(a));
    }
    const Eigen::VectorXd d = S.ldlt().solve(s);
    ScoreTest test;
    test.decrease = sum + s.dot(d);
    test.result.shared = plain.shared - d.head<kSharedCount>();
    const auto extras = static_cast<Eigen::Index>(rival.global.size());
    for (Eigen::Index k = 0; k < extras; ++k)
      test.result.extra[rival.global[k]] = -d[kSharedCount + k];
    if (extras > 0) {
      const Eigen::MatrixXd C = S.ldlt()
                                    .solve(Eigen::MatrixXd::Identity(S.rows(), S.cols()))
                                    .bottomRightCorner(extras, extras);
      Eigen::VectorXd w(extras);
      for (Eigen::Index k = 0; k < extras; ++k) w[k] = noise_px_ / deviations_[rival.global[k]];
      const Eigen::MatrixXd scaled = w.asDiagonal() * C * w.asDiagonal();
      test.occam = -0.5 * std::log(std::max(1e-300, scaled.determinant()));
    }
    return test;
  };
  const double base = step({}).decrease;
  for (std::size_t k = 0; k < rivals.size(); ++k) {
    tests[k] = step(rivals[k]);
    tests[k].decrease = std::max(0.0, tests[k].decrease - base) / (noise_px_ * noise_px_);
  }
  return tests;
}

LensFit RivalProblem::Linearized(const Rival& rival, const RivalResult& at) const {
  LensFit fit;
  fit.shared = at.shared;
  std::vector<Blocks> blocks;
  SharedVector mean;
  SharedMatrix information = PriorInformation(rival, at.shared, mean);
  if (!Linearize(rival, at, blocks)) return fit;
  const double weight = 1 / (noise_px_ * noise_px_);
  for (Blocks& block : blocks) {
    block.common = Eigen::MatrixXd(block.common.leftCols<kSharedCount>());
    const auto A = Eigen::LDLT<Eigen::MatrixXd>(block.own.transpose() * block.own);
    const Eigen::MatrixXd B = block.own.transpose() * block.common;
    const Eigen::VectorXd a = block.own.transpose() * block.residuals;
    ViewInformation view;
    view.information =
        weight * (block.common.transpose() * block.common - B.transpose() * A.solve(B));
    view.pull = weight * (B.transpose() * A.solve(a) - block.common.transpose() * block.residuals);
    if (!rival.local.empty()) {  // the board bends in each view: no change of it can be seen
      view.information.rightCols<kSharedCount - kBowX>().setZero();
      view.information.bottomRows<kSharedCount - kBowX>().setZero();
      view.pull.tail<kSharedCount - kBowX>().setZero();
    }
    information += view.information;
    fit.view_information.push_back(view);
  }
  fit.covariance = information.inverse();
  return fit;
}

}  // namespace plumbline::lens
