#include "firmware-like/scene/mesh_facts.h"

#include <algorithm>
#include <numeric>
#include <string>
#include <tuple>

namespace plumbline::scene {
namespace {

/// Positions beyond this are outside any cell, and their squares overflow a float [m].
constexpr float kFarthest_m = 1e6F;

bool Repeated(const Triangle& t) {
  return t[0] == t[1] || t[1] == t[2] || t[2] == t[0];
}

bool HasArea(const TriangleMesh& mesh, const Triangle& t) {
  const Vec3 a = mesh.vertices_O[t[0]].cast<double>();
  const Vec3 ab = mesh.vertices_O[t[1]].cast<double>() - a;
  const Vec3 ac = mesh.vertices_O[t[2]].cast<double>() - a;
  const double longest2 = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  return ab.cross(ac).norm() > kDegenerateArea * longest2;
}

/// Merges vertices at the same position, in order of first use, and drops unused ones.
void JoinVertices(TriangleMesh& mesh) {
  const auto& p = mesh.vertices_O;
  std::vector<std::uint32_t> order(p.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto before = [&p](std::uint32_t i, std::uint32_t k) {
    const auto key = [&p](std::uint32_t n) { return std::tuple(p[n].x(), p[n].y(), p[n].z(), n); };
    return key(i) < key(k);
  };
  std::sort(order.begin(), order.end(), before);
  std::vector<std::uint32_t> first(p.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool same = i > 0 && p[order[i]] == p[order[i - 1]];
    first[order[i]] = same ? first[order[i - 1]] : order[i];
  }
  constexpr std::uint32_t kUnused = ~0U;
  std::vector<std::uint32_t> number(p.size(), kUnused);
  std::vector<Vec3f> kept;
  for (Triangle& triangle : mesh.triangles) {
    for (std::uint32_t& corner : triangle) {
      std::uint32_t& given = number[first[corner]];
      if (given == kUnused) {
        given = static_cast<std::uint32_t>(kept.size());
        kept.push_back(p[first[corner]]);
      }
      corner = given;
    }
  }
  mesh.vertices_O = std::move(kept);
}

/// Counts open edges and edges whose triangles have opposite orientations.
void CountEdges(const std::vector<Triangle>& triangles, MeshFacts& facts) {
  struct Edge {
    std::uint64_t ends;  ///< smaller index in the upper half
    bool forwards;       ///< from the smaller to the larger
  };
  std::vector<Edge> edges;
  edges.reserve(3 * triangles.size());
  for (const Triangle& t : triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint64_t from = t[i], to = t[(i + 1) % 3];
      edges.push_back({std::min(from, to) << 32 | std::max(from, to), from < to});
    }
  }
  std::sort(edges.begin(), edges.end(), [](auto a, auto b) { return a.ends < b.ends; });
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    std::size_t forwards = 0;
    for (; end < edges.size() && edges[end].ends == edges[begin].ends; ++end) {
      forwards += edges[end].forwards ? 1 : 0;
    }
    const std::size_t all = end - begin;
    if (all % 2 == 1) {
      ++facts.open_edges;
    } else if (2 * forwards != all) {
      ++facts.opposed_edges;
    }
  }
}

/// Counts connected components by union-find.
void CountParts(const TriangleMesh& mesh, MeshFacts& facts) {
  std::vector<std::uint32_t> parent(mesh.vertices_O.size());
  std::iota(parent.begin(), parent.end(), 0U);
  const auto root = [&parent](std::uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t corner : {t[1], t[2]}) {
      const std::uint32_t a = root(t[0]), b = root(corner);
      parent[std::max(a, b)] = std::min(a, b);
    }
  }
  std::vector<std::size_t> part(parent.size());
  for (std::uint32_t i = 0; i < parent.size(); ++i) {
    const std::uint32_t first = root(i);  // <= i
    if (first == i) part[i] = facts.parts++;
    part[i] = part[first];
    if (part[i] >= MeshFacts::kMaxPartsWithEnds) continue;
    if (first == i) facts.ends.push_back({i, i, i, i, i, i});
    auto& ends = facts.ends[part[i]];
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto along = [&](std::uint32_t k) {
        return mesh.vertices_O[k][static_cast<int>(axis)];
      };
      if (along(i) < along(ends[axis])) ends[axis] = i;
      if (along(i) > along(ends[axis + 3])) ends[axis + 3] = i;
    }
  }
}

std::string CountOf(std::size_t count, std::size_t all) {
  return std::to_string(count) + " of " + std::to_string(all);
}

}  // namespace

Facing MeshFacts::facing() const {
  if (!closed()) return Facing::kNotClosed;
  if (opposed_edges > 0) return Facing::kMixed;
  return volume_m3 >= 0 ? Facing::kOutwards : Facing::kInwards;
}

Result<CheckedMesh> CheckMesh(TriangleMesh raw, double unit_m) {
  const std::size_t all = raw.triangles.size();
  if (all == 0) return Error{"contains no triangles: export the surface as triangles"};
  std::size_t beyond = 0, not_finite = 0, too_far = 0;
  for (Vec3f& p : raw.vertices_O) p = (p.cast<double>() * unit_m).cast<float>() + Vec3f::Zero();
  for (const Triangle& triangle : raw.triangles) {
    const auto any = [&triangle](auto&& is) {
      return std::any_of(triangle.begin(), triangle.end(), is);
    };
    const auto& p = raw.vertices_O;
    if (any([&p](std::uint32_t i) { return i >= p.size(); })) {
      ++beyond;
    } else if (any([&p](std::uint32_t i) { return !p[i].allFinite(); })) {
      ++not_finite;
    } else if (any([&p](std::uint32_t i) { return p[i].cwiseAbs().maxCoeff() > kFarthest_m; })) {
      ++too_far;
    }
  }
  if (beyond > 0) {
    return Error{CountOf(beyond, all) +
                 " triangles refer to missing vertices: export the model again"};
  }
  if (not_finite > 0) {
    return Error{CountOf(not_finite, all) +
                 " triangles have a corner that is not a finite number: "
                 "repair the model and export it again"};
  }
  if (too_far > 0) {
    return Error{CountOf(too_far, all) + " triangles extend beyond 1000 km: check the unit"};
  }
  CheckedMesh checked;
  MeshFacts& facts = checked.facts;
  JoinVertices(raw);
  std::vector<Triangle>& triangles = raw.triangles;
  const auto drop = [&triangles](auto&& is) {
    triangles.erase(std::remove_if(triangles.begin(), triangles.end(), is), triangles.end());
  };
  drop(Repeated);
  CountEdges(triangles, facts);
  drop([&raw](const Triangle& t) { return !HasArea(raw, t); });
  if (triangles.empty()) return Error{"all triangles have zero area: export the model again"};
  JoinVertices(raw);  // again, to drop the vertices of the removed triangles
  facts.degenerate = all - triangles.size();
  facts.triangles = triangles.size();
  facts.vertices = raw.vertices_O.size();
  CountParts(raw, facts);
  facts.min_O = facts.max_O = raw.vertices_O.front().cast<double>();
  for (const Vec3f& p : raw.vertices_O) {
    facts.min_O = facts.min_O.cwiseMin(p.cast<double>());
    facts.max_O = facts.max_O.cwiseMax(p.cast<double>());
  }
  if (facts.closed()) {
    // Relative to the centre, to avoid cancellation for a part far from the origin.
    const Vec3 middle = 0.5 * (facts.min_O + facts.max_O);
    const auto corner = [&](std::uint32_t i) {
      return Vec3(raw.vertices_O[i].cast<double>() - middle);
    };
    for (const Triangle& t : triangles) {
      facts.volume_m3 += corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6;
    }
  }
  checked.mesh = std::move(raw);
  return checked;
}

}  // namespace plumbline::scene
