#include "app/measure/plan/visit_order.h"

#include <algorithm>
#include <map>
#include <optional>
#include <utility>

namespace plumbline::measure {
namespace {

constexpr int kMostPasses = 50;

/// The moves between postures; each pair is checked for collisions at most once.
class Moves {
 public:
  Moves(const std::vector<model::JointVector>& postures, const model::JointVector& speeds,
        const std::function<bool(std::size_t, std::size_t)>& is_free)
      : postures_(postures), speeds_(speeds), is_free_(is_free) {}

  double Cost(std::size_t from, std::size_t to) const {
    return MoveCost(postures_[from], postures_[to], speeds_);
  }
  /// A straight joint move is the same in both directions.
  bool IsFree(std::size_t from, std::size_t to) {
    const std::pair<std::size_t, std::size_t> key = std::minmax(from, to);
    const auto known = free_.find(key);
    if (known != free_.end()) return known->second;
    return free_[key] = is_free_(from, to);
  }

 private:
  const std::vector<model::JointVector>& postures_;
  const model::JointVector& speeds_;
  const std::function<bool(std::size_t, std::size_t)>& is_free_;
  std::map<std::pair<std::size_t, std::size_t>, bool> free_;
};

std::vector<std::size_t> NearestFirst(std::size_t count, Moves& moves) {
  std::vector<std::size_t> order, left;
  for (std::size_t k = 1; k < count; ++k) left.push_back(k);
  if (count > 0) order.push_back(0);
  while (!left.empty()) {
    const std::size_t at = order.back();
    std::ranges::stable_sort(
        left, [&](std::size_t a, std::size_t b) { return moves.Cost(at, a) < moves.Cost(at, b); });
    auto next = std::ranges::find_if(left, [&](std::size_t to) { return moves.IsFree(at, to); });
    if (next == left.end()) next = left.begin();
    order.push_back(*next);
    left.erase(next);
  }
  return order;
}

/// Change of the path's cost and of its number of moves that are not free.
struct Change {
  double cost = 0;
  int blocked = 0;
};

/// What reversing order[first..last] changes: the moves at its two ends.
Change OfReversal(const std::vector<std::size_t>& order, std::size_t first, std::size_t last,
                  Moves& moves) {
  Change change;
  const auto add = [&](std::size_t from, std::size_t to, double sign) {
    change.cost += sign * moves.Cost(from, to);
  };
  const bool before = first > 0, after = last + 1 < order.size();
  if (before) add(order[first - 1], order[first], -1);
  if (after) add(order[last], order[last + 1], -1);
  if (before) add(order[first - 1], order[last], 1);
  if (after) add(order[first], order[last + 1], 1);
  constexpr double kLeastGain = 1e-9;
  if (change.cost > -kLeastGain) return change;  // not worth a collision check
  const auto count = [&](std::size_t from, std::size_t to, int sign) {
    if (!moves.IsFree(from, to)) change.blocked += sign;
  };
  if (before) count(order[first - 1], order[first], -1);
  if (after) count(order[last], order[last + 1], -1);
  if (before) count(order[first - 1], order[last], 1);
  if (after) count(order[first], order[last + 1], 1);
  return change;
}

/// Applies every reversal that shortens the path; true if there was one.
bool Improve(std::vector<std::size_t>& order, Moves& moves) {
  constexpr double kLeastGain = 1e-9;
  bool improved = false;
  for (std::size_t first = 0; first + 1 < order.size(); ++first) {
    for (std::size_t last = first + 1; last < order.size(); ++last) {
      const Change change = OfReversal(order, first, last, moves);
      if (change.cost > -kLeastGain || change.blocked > 0) continue;
      std::reverse(order.begin() + static_cast<std::ptrdiff_t>(first),
                   order.begin() + static_cast<std::ptrdiff_t>(last) + 1);
      improved = true;
    }
  }
  return improved;
}

}  // namespace

double MoveCost(const model::JointVector& from, const model::JointVector& to,
                const model::JointVector& speeds) {
  const model::JointVector moved = (to - from).cwiseAbs();
  return speeds.size() == 0 ? moved.maxCoeff() : moved.cwiseQuotient(speeds).maxCoeff();
}

std::vector<std::size_t> VisitOrder(const std::vector<model::JointVector>& postures,
                                    const model::JointVector& speeds,
                                    const std::function<bool(std::size_t, std::size_t)>& is_free) {
  Moves moves(postures, speeds, is_free);
  std::vector<std::size_t> order = NearestFirst(postures.size(), moves);
  for (int pass = 0; pass < kMostPasses; ++pass) {
    if (!Improve(order, moves)) break;
  }
  return order;
}

double PathCost(const std::vector<model::JointVector>& postures,
                const std::vector<std::size_t>& order, const model::JointVector& speeds) {
  double cost = 0;
  for (std::size_t k = 1; k < order.size(); ++k) {
    cost += MoveCost(postures[order[k - 1]], postures[order[k]], speeds);
  }
  return cost;
}

}  // namespace plumbline::measure
