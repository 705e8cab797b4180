#include "app/vision/lens/rival_fit.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "app/vision/lens/disc_offsets.h"
#include "app/vision/lens/lens_costs.h"

namespace plumbline::vision {
namespace {

constexpr double kGlassIndex = 1.5;
constexpr double kMinDepth_m = 1e-4;

/// Offset of a ray behind a plane-parallel plate, measured in the plate's plane, per unit of
/// thickness: d' / cos' - d / cos.
Vec3 GlassOffset(const Vec3& normal, const Vec3& d) {
  const double cosine = std::max(0.05, d.dot(normal));
  const Vec3 across = (d - d.dot(normal) * normal) / kGlassIndex;
  const double inside = std::sqrt(std::max(1e-6, 1 - across.squaredNorm()));
  return across / inside + normal - d / cosine;
}

Vec3 ThroughGlass(const ExtraVector& extra, const Vec3& board_normal, Vec3 p_C) {
  if (extra[kBoardGlass] != 0) {
    const Vec3 offset = GlassOffset(board_normal, p_C.normalized());
    p_C -= extra[kBoardGlass] * offset;
  }
  const Vec3 pane(extra[kPaneX], extra[kPaneY], extra[kPaneZ]);
  if (pane.z() == 0) return p_C;
  const double thickness_m = std::copysign(pane.norm(), pane.z());
  const Vec3 normal = pane / thickness_m;
  Vec3 seen = p_C;
  for (int pass = 0; pass < 2; ++pass)
    seen = p_C - thickness_m * GlassOffset(normal, seen.normalized());
  return seen;
}

/// Values of cos(i pi a) cos(j pi b) with lowest <= i + j <= highest, a and b in 0..1.
template <int kTerms>
Eigen::Matrix<double, kTerms, 1> Cosines(double a, double b, int lowest, int highest) {
  Eigen::Matrix<double, kTerms, 1> values = Eigen::Matrix<double, kTerms, 1>::Zero();
  int term = 0;
  for (int degree = lowest; degree <= highest; ++degree) {
    for (int i = 0; i <= degree && term < kTerms; ++i) {
      values[term++] =
          std::cos(std::numbers::pi * i * a) * std::cos(std::numbers::pi * (degree - i) * b);
    }
  }
  return values;
}

}  // namespace

lens::Vec2 RivalPixelOf(bool fisheye, const SharedVector& s, const ExtraVector& e,
                        const Vec3& p_C) {
  double x = p_C.x() / p_C.z(), y = p_C.y() / p_C.z();
  if (fisheye) {
    const double r = std::hypot(x, y);
    const double theta = std::atan(r), t2 = theta * theta;
    const double bent = theta * (1 + t2 * (s[kK1] + t2 * (s[kK2] + t2 * (s[kK3] + t2 * e[kK4]))));
    const double scale = r > 1e-9 ? bent / r : 1;
    x *= scale;
    y *= scale;
  } else {
    const double r2 = x * x + y * y, r4 = r2 * r2;
    const double radial = (1 + r2 * (s[kK1] + r2 * (s[kK2] + r2 * s[kK3]))) /
                          (1 + r2 * (e[kK4] + r2 * (e[kK5] + r2 * e[kK6])));
    const double u = radial * x + 2 * s[kP1] * x * y + s[kP2] * (r2 + 2 * x * x) + e[kPrism1] * r2 +
                     e[kPrism2] * r4;
    y = radial * y + s[kP1] * (r2 + 2 * y * y) + 2 * s[kP2] * x * y + e[kPrism3] * r2 +
        e[kPrism4] * r4;
    x = u;
  }
  const double zoom = std::exp(e[kZoom]);
  return {zoom * s[kFx] * x + s[kCx] + e[kShiftX], zoom * s[kFy] * y + s[kCy] + e[kShiftY]};
}

RivalBoard::RivalBoard(const target::Board& board, std::vector<std::size_t> corners)
    : centre_(board.Centre()), half_m_(board.Centre().norm()) {
  for (const std::size_t corner : corners) {
    Point point;
    point.corner = corner;
    point.xy = board.Corner(static_cast<int>(corner));
    point.uv = point.xy - centre_;
    const double a = 0.5 * point.xy.x() / centre_.x(), b = 0.5 * point.xy.y() / centre_.y();
    point.height = Cosines<kHeightTerms>(a, b, 2, 5);  // the pose has the lower degrees
    point.print = Cosines<kPrintTerms>(a, b, 2, 4);
    points_.push_back(point);
  }
}

bool RivalPixels(const RivalBoard& board, image::ImageSize size, bool fisheye,
                 const SharedVector& shared, const ExtraVector& extra, const Pose& X_CK,
                 const std::vector<double>& rows_px, std::vector<lens::Vec2>& pixels) {
  const Vec3 velocity = extra.segment<3>(kVelocityX), spin = extra.segment<3>(kSpinX);
  const bool moves = !velocity.isZero(0) || !spin.isZero(0);
  const bool shaped = !extra.segment<kHeightTerms>(kHeight).isZero(0);
  const bool printed = !extra.segment<2 * kPrintTerms>(kPrintX).isZero(0);
  const bool freed = !extra.segment<3 * kMaxFreePoints>(kFree).isZero(0);
  const Vec3 centre(board.centre().x(), board.centre().y(), 0);
  Vec3 normal = X_CK.R.col(2);
  if (normal.z() < 0) normal = -normal;
  pixels.resize(board.points().size());
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    const RivalBoard::Point& point = board.points()[k];
    const double u = point.uv.x(), v = point.uv.y();
    Vec3 p_K(point.xy.x() + extra[kStretch] * u + extra[kSkew] * v, point.xy.y(),
             (shared[kBowX] + extra[kBendX]) * u * u + (shared[kBowY] + extra[kBendY]) * v * v +
                 (shared[kBowXY] + extra[kBendXY]) * u * v);
    p_K += extra.segment<3>(kOffsetX);
    if (shaped) p_K.z() += extra.segment<kHeightTerms>(kHeight).dot(point.height);
    if (printed) {
      p_K.x() += extra.segment<kPrintTerms>(kPrintX).dot(point.print);
      p_K.y() += extra.segment<kPrintTerms>(kPrintY).dot(point.print);
    }
    if (freed && k < kMaxFreePoints)
      p_K += extra.segment<3>(kFree + 3 * static_cast<Eigen::Index>(k));
    Vec3 p_C = X_CK * p_K;
    if (moves) {
      const double when = rows_px[k] / size.height - 0.5;
      p_C += when * (velocity + spin.cross(Vec3(X_CK.R * (p_K - centre))));
    }
    p_C = ThroughGlass(extra, normal, p_C);
    if (!(p_C.z() > kMinDepth_m)) return false;
    pixels[k] = RivalPixelOf(fisheye, shared, extra, p_C);
    if (!pixels[k].allFinite()) return false;
  }
  return true;
}

lens::Lens LensOfRival(bool fisheye, const SharedVector& shared, const ExtraVector& extra) {
  lens::Lens lens = LensFromShared(shared);
  lens.fisheye = fisheye;
  if (fisheye) lens.p1 = lens.p2 = 0;
  lens.k4 = extra[kK4];
  if (fisheye) return lens;
  lens.k5 = extra[kK5], lens.k6 = extra[kK6];
  lens.s1 = extra[kPrism1], lens.s2 = extra[kPrism2];
  lens.s3 = extra[kPrism3], lens.s4 = extra[kPrism4];
  return lens;
}

ExtraVector ExtraDeviations(const RivalBoard& board, image::ImageSize size) {
  const double half_m = board.half_m();
  ExtraVector sd = ExtraVector::Constant(0.3);  // of distortion
  sd[kZoom] = 0.1;
  sd[kShiftX] = sd[kShiftY] = 0.05 * size.width;
  sd[kBendX] = sd[kBendY] = sd[kBendXY] = 0.05 / half_m;
  sd.segment<3>(kVelocityX).setConstant(0.05 * half_m);
  sd[kVelocityZ] = 0.2 * half_m;
  sd.segment<3>(kSpinX).setConstant(0.05);
  sd[kStretch] = sd[kSkew] = 0.1;
  sd[kPaneX] = sd[kPaneY] = sd[kPaneZ] = 0.02;
  sd[kBoardGlass] = 0.01;
  sd.segment<4>(kPrism1).setConstant(0.05);
  sd.segment<3>(kOffsetX).setConstant(0.05 * half_m);
  sd.segment<kHeightTerms>(kHeight).setConstant(0.05 * half_m);
  sd.segment<2 * kPrintTerms>(kPrintX).setConstant(0.02 * half_m);
  sd.segment<3 * kMaxFreePoints>(kFree).setConstant(0.02 * half_m);
  return sd;
}

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
                           const std::vector<std::vector<bool>>& used, double noise_px,
                           bool oblong_pixels)
    : size_(size),
      declared_(board),
      board_(board, Thinned(board)),
      noise_px_(noise_px),
      deviations_(ExtraDeviations(board_, size)),
      oblong_pixels_(oblong_pixels) {
  for (std::size_t j = 0; j < views.size(); ++j) {
    ViewData data;
    for (const RivalBoard::Point& point : board_.points()) {
      data.rows_px.push_back(views[j].corners_px[point.corner].y());
      data.corners_px.push_back(views[j].corners_px[point.corner]);
      data.seen.push_back(views[j].seen[point.corner]);
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
  prior.aspect = rival.free_aspect || oblong_pixels_ ? kFreeAspect : kSquareAspect;
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

double RivalProblem::SeenRadius() const {
  const lens::Vec2 middle(0.5 * (size_.width - 1), 0.5 * (size_.height - 1));
  double radius_px = 0;
  for (const ViewData& view : views_) {
    for (std::size_t k = 0; k < view.corners_px.size(); ++k) {
      if (view.used[k]) radius_px = std::max(radius_px, (view.corners_px[k] - middle).norm());
    }
  }
  return radius_px;
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
