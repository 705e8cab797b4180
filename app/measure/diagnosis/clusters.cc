#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

#include "app/measure/diagnosis/dataset_preparation.h"

namespace plumbline::measure {
namespace {

constexpr double kSamePose = 2e-4;    // [rad] or [m], between neighbours
constexpr double kWidestPose = 2e-3;  // a wider chain is a path, not a pose
constexpr double kSamePayload_kg = 0.01;

/// A row as a point: joints and payload in units of their tolerances, tool and item so that
/// different ones are far apart.
std::vector<double> Place(const MeasuredRow& row) {
  std::vector<double> place(row.q.begin(), row.q.end());
  for (double& q : place) q /= kSamePose;
  place.push_back(row.payload_kg.value_or(0) / kSamePayload_kg);
  constexpr double kFarApart = 10;
  place.push_back(kFarApart * row.tool_number.value_or(0));
  place.push_back(kFarApart * row.payload_item.value_or(0));
  return place;
}

using RowPlaces = PerRow<std::vector<double>>;

/// Divides rows recursively at gaps larger than one in any coordinate, across which no chain can
/// exist. Each part is appended to `parts`.
void CutAtGaps(const RowPlaces& places, std::vector<RowIndex> rows,
               std::vector<std::vector<RowIndex>>& parts) {
  for (std::size_t axis = 0; axis < places.front().size(); ++axis) {
    const auto at = [&](RowIndex row) { return places[row][axis]; };
    std::ranges::sort(rows, [&](RowIndex a, RowIndex b) { return at(a) < at(b); });
    const auto gap = [&](RowIndex a, RowIndex b) { return at(b) - at(a) > 1; };
    auto cut = std::adjacent_find(rows.begin(), rows.end(), gap);
    if (cut == rows.end()) continue;
    auto from = rows.begin();
    while (cut != rows.end()) {
      CutAtGaps(places, {from, cut + 1}, parts);
      from = cut + 1;
      cut = std::adjacent_find(from, rows.end(), gap);
    }
    CutAtGaps(places, {from, rows.end()}, parts);
    return;
  }
  parts.push_back(std::move(rows));
}

/// Single linkage: rows that differ by at most one in every coordinate belong together.
/// @return  a label for each of `rows`, equal for rows that belong together
std::vector<int> Linked(const RowPlaces& places, const std::vector<RowIndex>& rows) {
  const auto count = static_cast<int>(rows.size());
  std::vector<int> leader(rows.size());
  std::iota(leader.begin(), leader.end(), 0);
  const auto leader_of = [&](int k) {
    while (leader[k] != k) {
      const int up = leader[k];
      k = leader[k] = leader[up];
    }
    return k;
  };
  const auto place = [&](int k) -> const std::vector<double>& { return places[rows[k]]; };
  // Sweep along the coordinate with the widest spread.
  std::size_t widest = 0;
  double width = -1;
  for (std::size_t axis = 0; axis < places.front().size(); ++axis) {
    double low = 1e300, high = -1e300;
    for (int k = 0; k < count; ++k) {
      low = std::min(low, place(k)[axis]);
      high = std::max(high, place(k)[axis]);
    }
    if (high - low > width) {
      width = high - low;
      widest = axis;
    }
  }
  std::vector<int> order(leader);
  std::ranges::sort(order, [&](int a, int b) { return place(a)[widest] < place(b)[widest]; });
  for (int i = 0; i < count; ++i) {
    const int a = order[i];
    for (int j = i + 1; j < count; ++j) {
      const int b = order[j];
      if (place(b)[widest] - place(a)[widest] > 1) break;
      const bool near = std::equal(place(a).begin(), place(a).end(), place(b).begin(),
                                   [](double x, double y) { return std::abs(x - y) <= 1; });
      if (near) leader[leader_of(b)] = leader_of(a);
    }
  }
  for (int k = 0; k < count; ++k) leader[k] = leader_of(k);
  return leader;
}

}  // namespace

Clusters ClustersOf(const std::vector<MeasuredRow>& rows, const PerRow<SessionIndex>& session_of) {
  RowPlaces places;
  for (const MeasuredRow& row : rows) places.push_back(Place(row));
  std::map<SessionIndex, std::vector<RowIndex>> of_session;
  for (const RowIndex row : places.indices()) of_session[session_of[row]].push_back(row);
  std::vector<std::vector<RowIndex>> parts;
  for (auto& [session, own] : of_session) CutAtGaps(places, std::move(own), parts);
  // (part, chain, grid cell of a path) of each row
  PerRow<std::tuple<std::size_t, int, std::vector<long>>> names(places.size());
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const std::vector<int> chains = Linked(places, parts[part]);
    std::map<int, std::pair<std::vector<double>, std::vector<double>>> extent;
    for (std::size_t k = 0; k < chains.size(); ++k) {
      const std::vector<double>& place = places[parts[part][k]];
      auto& [low, high] = extent.try_emplace(chains[k], place, place).first->second;
      for (std::size_t axis = 0; axis < place.size(); ++axis) {
        low[axis] = std::min(low[axis], place[axis]);
        high[axis] = std::max(high[axis], place[axis]);
      }
    }
    for (std::size_t k = 0; k < chains.size(); ++k) {
      const RowIndex row = parts[part][k];
      const auto& [low, high] = extent[chains[k]];
      double wide = 0;
      for (std::size_t axis = 0; axis < low.size(); ++axis) {
        wide = std::max(wide, high[axis] - low[axis]);
      }
      auto& [of_part, chain, cell] = names[row];
      of_part = part;
      chain = chains[k];
      if (wide <= kWidestPose / kSamePose) continue;
      for (const double x : places[row]) cell.push_back(std::lround(x));
    }
  }
  std::map<std::tuple<std::size_t, int, std::vector<long>>, ClusterIndex> known;
  Clusters clusters;
  for (const auto& name : names) {
    const auto [entry, inserted] = known.emplace(name, ClusterIndex(clusters.count));
    if (inserted) ++clusters.count;
    clusters.of_row.push_back(entry->second);
  }
  return clusters;
}

}  // namespace plumbline::measure
