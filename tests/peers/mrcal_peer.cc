#include "tests/peers/mrcal_peer.h"

#ifdef PLUMBLINE_MRCAL

#include <suitesparse/cholmod.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

extern "C" {
#include <mrcal/mrcal.h>
}

namespace plumbline {
namespace {

constexpr double kHidden = -1;  // weight of what was not seen
constexpr int kMostInRow = 20;  // of the Jacobian: lens 9, pose 6, warp 2

/// What mrcal's functions take, all of them.
struct Problem {
  std::vector<double> intrinsics;
  std::vector<mrcal_pose_t> poses;
  mrcal_calobject_warp_t warp{};
  std::vector<mrcal_observation_board_t> observations;
  std::vector<mrcal_point3_t> pixels;
  mrcal_lensmodel_t model{};
  int size[2] = {0, 0};
  mrcal_problem_selections_t selected{};
  mrcal_problem_constants_t constants{};
  int columns = 0, rows = 0;
  double spacing = 0;

  int views() const { return static_cast<int>(poses.size()); }
  int measurements() const {
    return mrcal_num_measurements(views(), 0, columns, rows, 1, 0, views(), 0, 0, selected, &model);
  }
  int states() const { return mrcal_num_states(1, 0, views(), 0, 0, views(), selected, &model); }
};

Problem ProblemOf(const target::Board& board, std::span<const vision::BoardView> views,
                  image::ImageSize size, const lens::Lens& start, std::span<const Pose> X_CK) {
  Problem p;
  p.intrinsics = {start.fx, start.fy, start.cx, start.cy, start.k1,
                  start.k2, start.p1, start.p2, start.k3};
  for (std::size_t j = 0; j < views.size(); ++j) {
    const Eigen::AngleAxisd turn(X_CK[j].R);
    const Vec3 r = turn.angle() * turn.axis();
    mrcal_pose_t pose{};
    for (int i = 0; i < 3; ++i) {
      pose.r.xyz[i] = r[i];
      pose.t.xyz[i] = X_CK[j].p[i];
    }
    p.poses.push_back(pose);
    mrcal_observation_board_t observation{};
    observation.icam.intrinsics = 0;
    observation.icam.extrinsics = -1;
    observation.iframe = static_cast<int>(j);
    p.observations.push_back(observation);
    for (std::size_t k = 0; k < views[j].corners_px.size(); ++k) {
      mrcal_point3_t pixel{};
      pixel.x = views[j].corners_px[k].x();
      pixel.y = views[j].corners_px[k].y();
      pixel.z = views[j].seen[k] ? 1 : kHidden;
      p.pixels.push_back(pixel);
    }
  }
  p.model.type = MRCAL_LENSMODEL_OPENCV5;
  p.size[0] = size.width;
  p.size[1] = size.height;
  p.selected.do_optimize_intrinsics_core = true;
  p.selected.do_optimize_intrinsics_distortions = true;
  p.selected.do_optimize_frames = true;
  p.selected.do_optimize_calobject_warp = true;
  p.selected.do_apply_regularization = true;
  p.columns = board.columns;
  p.rows = board.rows;
  p.spacing = board.square_m;
  return p;
}

/// Variance of the first state, fx: s^2 (J^T J)^-1 (J^T J of the observations alone) (J^T J)^-1,
/// with s from the residuals of the observations.
/// @param corners  that were seen
double VarianceOfFx(const Problem& p, int corners) {
  const int states = p.states(), measurements = p.measurements();
  const int observed = mrcal_num_measurements_boards(p.views(), p.columns, p.rows);
  const int nonzero = kMostInRow * measurements;
  std::vector<int> starts(measurements + 1), places(nonzero);
  std::vector<double> values(nonzero), state(states), x(measurements);
  cholmod_sparse Jt{};
  Jt.nrow = static_cast<std::size_t>(states);
  Jt.ncol = static_cast<std::size_t>(measurements);
  Jt.nzmax = static_cast<std::size_t>(nonzero);
  Jt.p = starts.data();
  Jt.i = places.data();
  Jt.x = values.data();
  Jt.itype = CHOLMOD_INT;
  Jt.xtype = CHOLMOD_REAL;
  Jt.dtype = CHOLMOD_DOUBLE;
  Jt.sorted = Jt.packed = 1;
  if (!mrcal_optimizer_callback(state.data(), static_cast<int>(sizeof(double)) * states, x.data(),
                                static_cast<int>(sizeof(double)) * measurements, &Jt,
                                p.intrinsics.data(), nullptr, p.poses.data(), nullptr, &p.warp, 1,
                                0, p.views(), 0, 0, p.observations.data(), nullptr, p.views(), 0,
                                p.pixels.data(), &p.model, p.size, p.selected, &p.constants,
                                p.spacing, p.columns, p.rows, false))
    return 0;
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(states, states), seen = all;
  for (int m = 0; m < measurements; ++m) {
    if (m == observed) seen = all;
    for (int a = starts[m]; a < starts[m + 1]; ++a) {
      for (int b = starts[m]; b < starts[m + 1]; ++b)
        all(places[a], places[b]) += values[a] * values[b];
    }
  }
  const Eigen::VectorXd column = all.ldlt().solve(Eigen::VectorXd::Unit(states, 0));
  std::vector<double> scale(states, 0.0);
  scale[0] = 1;
  mrcal_unpack_solver_state_vector(scale.data(), 1, 0, p.views(), 0, 0, p.selected, &p.model);
  const double sum = Eigen::Map<const Eigen::VectorXd>(x.data(), observed).squaredNorm();
  const double variance = sum / (2 * corners - states);
  return variance * scale[0] * scale[0] * column.dot(seen * column);
}

}  // namespace

bool HasMrcal() {
  return true;
}

std::optional<MrcalFit> SolveWithMrcal(const target::Board& board,
                                       std::span<const vision::BoardView> views,
                                       image::ImageSize size, const lens::Lens& start,
                                       std::span<const Pose> X_CK) {
  Problem p = ProblemOf(board, views, size, start, X_CK);
  const mrcal_stats_t stats = mrcal_optimize(
      nullptr, 0, nullptr, 0, p.intrinsics.data(), nullptr, p.poses.data(), nullptr, &p.warp, 1, 0,
      p.views(), 0, 0, p.observations.data(), nullptr, p.views(), 0, p.pixels.data(), &p.model,
      p.size, p.selected, &p.constants, p.spacing, p.columns, p.rows, false, false);
  if (!(stats.rms_reproj_error__pixels > 0)) return std::nullopt;
  const auto& k = p.intrinsics;
  MrcalFit fit;
  fit.lens = {k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7], k[8]};
  const auto corners = std::count_if(p.pixels.begin(), p.pixels.end(),
                                     [](const mrcal_point3_t& pixel) { return pixel.z > 0; });
  fit.fx_sd = std::sqrt(VarianceOfFx(p, static_cast<int>(corners)));
  return fit;
}

}  // namespace plumbline

#else

namespace plumbline {

bool HasMrcal() {
  return false;
}

std::optional<MrcalFit> SolveWithMrcal(const target::Board&, std::span<const vision::BoardView>,
                                       image::ImageSize, const lens::Lens&, std::span<const Pose>) {
  return std::nullopt;
}

}  // namespace plumbline

#endif
