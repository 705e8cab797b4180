// Derivatives of a rival explanation by its parameters, and the information of each view.
#include <Eigen/Dense>
#include <algorithm>

#include "app/vision/lens/rival_fit.h"

namespace plumbline::vision {
namespace {

/// Step of a numerical derivative.
double SharedStep(int k, const SharedVector& shared) {
  if (k <= kFy) return 1e-6 * shared[kFx];
  if (k <= kCy) return 1e-3;
  return k >= kBowX ? 1e-5 : 1e-7;
}

}  // namespace

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
  const bool smooth = std::ranges::any_of(rival.global, [](int k) { return k >= kHeight; });
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

void RivalProblem::SetResiduals(std::size_t j, const Rival& rival, const RivalResult& at,
                                LensFit& fit) const {
  const ViewData& view = views_[j];
  const auto corners = static_cast<std::size_t>(declared_.corners());
  fit.residuals_px.emplace_back(corners, lens::Vec2::Zero());
  fit.used.emplace_back(corners, false);
  std::vector<lens::Vec2> pixels;
  if (!RivalPixels(board_, size_, rival.fisheye, at.shared, ExtraOf(rival, at, j), at.X_CK[j],
                   view.rows_px, pixels))
    return;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const std::size_t corner = board_.points()[i].corner;
    fit.used.back()[corner] = view.used[i];
    if (view.seen[i]) fit.residuals_px.back()[corner] = view.corners_px[i] - pixels[i];
  }
}

LensFit RivalProblem::Linearized(const Rival& rival, const RivalResult& at) const {
  LensFit fit;
  fit.shared = at.shared;
  fit.X_CK = at.X_CK;
  std::vector<Blocks> blocks;
  SharedVector mean;
  SharedMatrix information = PriorInformation(rival, at.shared, mean);
  if (!Linearize(rival, at, blocks)) return fit;
  const double weight = 1 / (noise_px_ * noise_px_);
  for (std::size_t j = 0; j < blocks.size(); ++j) {
    Blocks& block = blocks[j];
    block.common = Eigen::MatrixXd(block.common.leftCols<kSharedCount>());
    Eigen::MatrixXd S = block.common.transpose() * block.common;
    Eigen::VectorXd s = block.common.transpose() * block.residuals;
    EquationsOf(block).Eliminate(S, s);
    ViewInformation view{weight * S, -weight * s};
    if (!rival.local.empty()) {  // the board bends in each view: no change of it can be seen
      view.information.rightCols<kSharedCount - kBowX>().setZero();
      view.information.bottomRows<kSharedCount - kBowX>().setZero();
      view.pull.tail<kSharedCount - kBowX>().setZero();
    }
    information += view.information;
    fit.view_information.push_back(view);
    SetResiduals(j, rival, at, fit);
  }
  fit.covariance = information.inverse();
  return fit;
}

}  // namespace plumbline::vision
