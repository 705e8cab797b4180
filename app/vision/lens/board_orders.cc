#include "app/vision/lens/board_orders.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace plumbline::vision {
namespace {

constexpr int kUsualPoints = 24;        // of a board
constexpr double kDisplacement = 0.02;  // prior of a point, share of half the board's diagonal
constexpr std::size_t kStarts = 4;      // beside the given order
constexpr int kMaxRounds = 20;
constexpr double kMostLeft = 0.5;   // share of the squared residuals of the renumbered views
constexpr double kMinEvidence = 5;  // odds of e^5: "very strong", A. Raftery (1995)

/// A regular subset of the points that every turn maps onto itself, ascending.
std::vector<int> ClosedSubset(const target::Board& board,
                              const std::vector<target::BoardTurn>& turns) {
  const int stride = (board.corners() + kUsualPoints - 1) / kUsualPoints;
  std::vector<bool> chosen(static_cast<std::size_t>(board.corners()), false);
  for (int k = 0; k < board.corners(); ++k) {
    if ((k % board.columns + k / board.columns) % stride != 0) continue;
    const auto is_first = [k](const target::BoardTurn& turn) { return turn.points[k] >= k; };
    if (!std::ranges::all_of(turns, is_first)) continue;
    for (const target::BoardTurn& turn : turns) chosen[turn.points[k]] = true;
  }
  std::vector<int> points;
  for (int k = 0; k < board.corners(); ++k) {
    if (chosen[k]) points.push_back(k);
  }
  return points;
}

/// Normal equations of one view about the displacements of the points (x, y, z of each) and the
/// lens; the pose is eliminated. In units of the view's noise.
struct ViewEquations {
  Eigen::MatrixXd N;
  Eigen::VectorXd b;
  double square_sum = 0;

  /// Squared residuals that remain.
  double ResidualOf(const Eigen::VectorXd& x) const {
    return square_sum - 2 * b.dot(x) + x.dot(N * x);
  }
};

/// P of a turn: displacements of the board's points and the lens, as they appear in a view whose
/// points are numbered by the turn. A signed permutation, since the turns are quarter turns.
class TurnedBoard {
 public:
  TurnedBoard(const target::BoardTurn& turn, const std::vector<int>& points) {
    const auto count = static_cast<Eigen::Index>(3 * points.size() + kLensCount);
    place_.setLinSpaced(count, 0, static_cast<int>(count) - 1);
    sign_.setOnes(count);
    const int swapped = turn.quarters % 2;  // x becomes y or -y
    for (std::size_t k = 0; k < points.size(); ++k) {
      const auto there = static_cast<int>(std::ranges::lower_bound(points, turn.points[points[k]]) -
                                          points.begin());
      const auto x = static_cast<Eigen::Index>(3 * k), y = x + 1;
      place_[x] = 3 * there + swapped;
      place_[y] = 3 * there + 1 - swapped;
      place_[y + 1] = 3 * there + 2;
      sign_[x] = turn.quarters >= 2 ? -1 : 1;
      sign_[y] = turn.quarters == 1 || turn.quarters == 2 ? -1 : 1;
    }
  }
  Eigen::VectorXd InView(const Eigen::VectorXd& x) const {
    Eigen::VectorXd turned(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) turned[place_[i]] = sign_[i] * x[i];
    return turned;
  }
  /// Adds a view's equations to those of the board.
  void AddTo(Eigen::MatrixXd& H, Eigen::VectorXd& b, const ViewEquations& view) const {
    for (Eigen::Index i = 0; i < H.cols(); ++i) {
      b[i] += sign_[i] * view.b[place_[i]];
      for (Eigen::Index k = 0; k < H.rows(); ++k)
        H(k, i) += sign_[i] * sign_[k] * view.N(place_[k], place_[i]);
    }
  }

 private:
  Eigen::VectorXi place_;
  Eigen::VectorXd sign_;
};

/// View j about the fit, with the bow of the fit among the displacements.
ViewEquations EquationsOf(const target::Board& board, const std::vector<int>& points,
                          const LensFit& fit, std::size_t j, const std::vector<bool>& used,
                          double noise_px) {
  using Rows = Eigen::Matrix<double, 2, Eigen::Dynamic, Eigen::RowMajor>;
  const auto corners = static_cast<std::size_t>(board.corners());
  const auto count = static_cast<Eigen::Index>(points.size());
  const Eigen::Index columns = 3 * count + kLensCount;
  ViewEquations view{Eigen::MatrixXd::Zero(columns, columns), Eigen::VectorXd::Zero(columns)};
  std::vector<lens::Vec2> pixels;
  std::vector<double> by_shared(corners * 2 * kSharedCount), by_pose(corners * 12);
  const Pose& X_CK = fit.X_CK[j];
  if (!BoardPixels(board, fit.shared, X_CK.R, Vec3::Zero(), X_CK.p, pixels, by_shared.data(),
                   by_pose.data()))
    return view;
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(2 * count, 6);
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(2 * count, columns);
  Eigen::VectorXd r = Eigen::VectorXd::Zero(2 * count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto point = static_cast<std::size_t>(points[k]);
    if (!used[point]) continue;
    const Eigen::Map<const Rows> pose(&by_pose[point * 12], 2, 6);
    const Eigen::Map<const Rows> shared(&by_shared[point * 2 * kSharedCount], 2, kSharedCount);
    const Eigen::Matrix<double, 2, 3> by_point = pose.rightCols<3>() * X_CK.R;
    const lens::Vec2 uv = board.Corner(points[k]) - board.Centre();
    const double bow_m = fit.shared[kBowX] * uv.x() * uv.x() + fit.shared[kBowY] * uv.y() * uv.y() +
                         fit.shared[kBowXY] * uv.x() * uv.y();
    A.middleRows<2>(2 * k) = pose / noise_px;
    J.block<2, 3>(2 * k, 3 * k) = by_point / noise_px;
    J.block<2, kLensCount>(2 * k, 3 * count) = shared.leftCols<kLensCount>() / noise_px;
    r.segment<2>(2 * k) = (fit.residuals_px[j][point] + bow_m * by_point.col(2)) / noise_px;
  }
  const auto factor = Eigen::MatrixXd(A.transpose() * A).ldlt();
  const Eigen::MatrixXd AJ = A.transpose() * J;
  const Eigen::VectorXd Ar = A.transpose() * r;
  view.N = J.transpose() * J - AJ.transpose() * factor.solve(AJ);
  view.b = J.transpose() * r - AJ.transpose() * factor.solve(Ar);
  view.square_sum = r.squaredNorm() - Ar.dot(factor.solve(Ar));
  return view;
}

/// Turn of each view, by its index among the board's; 0 is the given order.
using Turns = std::vector<std::size_t>;

/// Sums of weights, values and squares.
struct Scatter {
  double weight = 0, value = 0, square = 0;
  void Add(double w, double v) { weight += w, value += w * v, square += w * v * v; }
  double AboutMean() const { return square - value * value / weight; }
};

/// Linear fits of board and lens for any turns of the views.
class OrderSearch {
 public:
  struct Solution {
    Turns turns;
    Eigen::VectorXd x;  ///< displacements and lens
    double cost = INFINITY;
  };

  OrderSearch(const target::Board& board, const std::vector<target::BoardTurn>& turns,
              image::ImageSize size, const LensFit& fit, const ViewConsistency& consistency)
      : turns_(turns) {
    const std::vector<int> points = ClosedSubset(board, turns);
    for (std::size_t j = 0; j < fit.X_CK.size(); ++j) {
      const double noise_px = std::max(consistency.noise_px, consistency.view_noise_px[j]);
      views_.push_back(EquationsOf(board, points, fit, j, consistency.used[j], noise_px));
    }
    for (const target::BoardTurn& turn : turns) boards_.emplace_back(turn, points);
    const auto count = static_cast<Eigen::Index>(3 * points.size());
    prior_ = Eigen::MatrixXd::Zero(count + kLensCount, count + kLensCount);
    prior_.diagonal().head(count).setConstant(std::pow(kDisplacement * board.Centre().norm(), -2));
    prior_.bottomRightCorner<kLensCount, kLensCount>() =
        PriorInformation({}, board, size, fit.shared[kFy]).topLeftCorner<kLensCount, kLensCount>();
  }

  Solution Given() const { return Solve(Turns(views_.size(), 0)); }
  /// The best of several local optima, the board turned so that most views keep their order.
  Solution Best(const Solution& given) const {
    Solution best = Alternate(given);
    for (std::size_t k = 0; k < kStarts; ++k) {
      const ViewEquations& view = views_[k * views_.size() / kStarts];
      Solution other = Alternate({{}, (view.N + prior_).llt().solve(view.b)});
      if (other.cost < best.cost) best = std::move(other);
    }
    return Solve(KeepingMost(best.turns));
  }
  double ResidualOf(std::size_t j, std::size_t turn, const Eigen::VectorXd& x) const {
    return views_[j].ResidualOf(boards_[turn].InView(x));
  }
  double EvidenceOf(const Turns& turns) const;

 private:
  Solution Solve(Turns turns, std::optional<std::size_t> left_out = std::nullopt) const {
    Eigen::MatrixXd H = prior_;
    Eigen::VectorXd b = Eigen::VectorXd::Zero(H.rows());
    double square_sum = 0;
    for (std::size_t j = 0; j < views_.size(); ++j) {
      if (j == left_out) continue;
      boards_[turns[j]].AddTo(H, b, views_[j]);
      square_sum += views_[j].square_sum;
    }
    Solution solution{std::move(turns), H.llt().solve(b)};
    solution.cost = square_sum - b.dot(solution.x);
    return solution;
  }
  Solution Alternate(Solution at) const {
    for (int round = 0; round < kMaxRounds; ++round) {
      Turns next;
      for (std::size_t j = 0; j < views_.size(); ++j) next.push_back(BestTurn(j, at.x));
      if (next == at.turns) break;
      at = Solve(std::move(next));
    }
    return at;
  }
  std::size_t BestTurn(std::size_t j, const Eigen::VectorXd& x,
                       std::optional<std::size_t> except = std::nullopt) const {
    std::size_t best = 0;
    double least = INFINITY;
    for (std::size_t turn = 0; turn < turns_.size(); ++turn) {
      if (turn == except) continue;
      const double left = ResidualOf(j, turn, x);
      if (left >= least) continue;
      least = left;
      best = turn;
    }
    return best;
  }
  Turns KeepingMost(Turns turns) const {
    std::vector<int> votes(turns_.size(), 0);
    for (const std::size_t turn : turns) ++votes[turn];
    const std::ptrdiff_t most = std::ranges::max_element(votes) - votes.begin();
    for (std::size_t& turn : turns) {
      const int quarters = (turns_[turn].quarters - turns_[most].quarters + 4) % 4;
      turn = static_cast<std::size_t>(
          std::ranges::find(turns_, quarters, &target::BoardTurn::quarters) - turns_.begin());
    }
    return turns;
  }

  const std::vector<target::BoardTurn>& turns_;
  std::vector<TurnedBoard> boards_;  ///< of each turn
  std::vector<ViewEquations> views_;
  Eigen::MatrixXd prior_;
};

/// ln of the odds of the turns against the given order, see RenumberToOneOrder().
double OrderSearch::EvidenceOf(const Turns& turns) const {
  Scatter found, given;
  double weight_squares = 0;
  for (std::size_t j = 0; j < views_.size(); ++j) {
    const Solution others = Solve(turns, j);
    const std::size_t other = turns[j] != 0 ? 0 : BestTurn(j, others.x, turns[j]);
    const Eigen::VectorXd by_turn = boards_[turns[j]].InView(others.x);
    const Eigen::VectorXd by_other = boards_[other].InView(others.x);
    const Eigen::VectorXd half = 0.5 * (by_turn - by_other), along = views_[j].N * half;
    const double weight = half.dot(along);
    if (!(weight > 0)) continue;
    const double c = (views_[j].b.dot(half) - 0.5 * (by_turn + by_other).dot(along)) / weight;
    found.Add(weight, c);
    given.Add(weight, turns[j] != 0 ? -c : c);
    weight_squares += weight * weight;
  }
  const double n = found.weight * found.weight / weight_squares;
  const double orders = static_cast<double>(turns_.size());
  return n * (0.5 * std::log(given.AboutMean() / found.AboutMean()) - std::log(orders));
}

}  // namespace

bool RenumberToOneOrder(const target::Board& board, image::ImageSize size, const LensFit& fit,
                        const ViewConsistency& consistency, std::span<BoardView> views) {
  const std::vector<target::BoardTurn> turns = target::SymmetriesOf(board);
  if (turns.size() < 2) return false;
  const OrderSearch search(board, turns, size, fit, consistency);
  const OrderSearch::Solution given = search.Given(), best = search.Best(given);
  double before = 0, after = 0;
  for (std::size_t j = 0; j < views.size(); ++j) {
    if (best.turns[j] == 0) continue;
    before += search.ResidualOf(j, 0, given.x);
    after += search.ResidualOf(j, best.turns[j], best.x);
  }
  if (!(after < kMostLeft * before) || !(search.EvidenceOf(best.turns) > kMinEvidence))
    return false;
  for (std::size_t j = 0; j < views.size(); ++j) views[j] = Turned(views[j], turns[best.turns[j]]);
  return true;
}

}  // namespace plumbline::vision
