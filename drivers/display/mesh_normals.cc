#include "drivers/display/mesh_normals.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <tuple>

namespace plumbline::display {
namespace {

constexpr float kCosCrease = 0.766F;  // 40 degrees
constexpr std::size_t kMaxTrianglesAround = 64;

/// Position index of each vertex; vertices with identical coordinates share one.
std::vector<std::uint32_t> PositionIndices(const std::vector<Vec3f>& vertices) {
  std::vector<std::uint32_t> order(vertices.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto key = [&](std::uint32_t i) {
    const Vec3f& p = vertices[i];
    return std::tuple(p.x(), p.y(), p.z());
  };
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return key(a) < key(b); });
  std::vector<std::uint32_t> position(vertices.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const bool same = k > 0 && key(order[k]) == key(order[k - 1]);
    position[order[k]] = same ? position[order[k - 1]] : static_cast<std::uint32_t>(k);
  }
  return position;
}

/// Triangles around each position; those of position p are triangles[first[p] .. first[p + 1] - 1].
struct TrianglesAround {
  std::vector<std::uint32_t> first, triangles;
};

TrianglesAround TrianglesAroundPositions(const scene::TriangleMesh& mesh,
                                         const std::vector<std::uint32_t>& position) {
  TrianglesAround around;
  around.first.assign(position.size() + 1, 0);
  for (const scene::Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) ++around.first[position[vertex] + 1];
  }
  std::partial_sum(around.first.begin(), around.first.end(), around.first.begin());
  std::vector<std::uint32_t> next(around.first.begin(), around.first.end() - 1);
  around.triangles.resize(around.first.back());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (const std::uint32_t vertex : mesh.triangles[t]) {
      around.triangles[next[position[vertex]]++] = static_cast<std::uint32_t>(t);
    }
  }
  return around;
}

std::array<std::int16_t, 4> PackedNormal(const Vec3f& normal) {
  const float length = normal.norm();
  const Vec3f n = length > 0 ? Vec3f(normal / length) : Vec3f::UnitZ();
  const auto packed = [](float c) { return static_cast<std::int16_t>(std::lround(c * 32767)); };
  return {packed(n.x()), packed(n.y()), packed(n.z()), 0};
}

}  // namespace

LitMesh ComputeNormals(const scene::TriangleMesh& mesh) {
  const std::vector<std::uint32_t> position = PositionIndices(mesh.vertices_O);
  const TrianglesAround around = TrianglesAroundPositions(mesh, position);
  std::vector<Vec3f> area(mesh.triangles.size()), unit(mesh.triangles.size());
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    const Vec3f& origin = mesh.vertices_O[a];
    area[t] = (mesh.vertices_O[b] - origin).cross(mesh.vertices_O[c] - origin);
    unit[t] = area[t].norm() > 0 ? Vec3f(area[t].normalized()) : Vec3f::Zero();
  }

  LitMesh lit;
  lit.triangles.resize(mesh.triangles.size());
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> latest(mesh.vertices_O.size(),
                                    kNone);  // last lit vertex of each vertex
  std::vector<std::uint32_t> previous;       // previous lit vertex of the same vertex
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const std::uint32_t vertex = mesh.triangles[t][corner];
      const std::uint32_t begin = around.first[position[vertex]];
      const std::uint32_t end = around.first[position[vertex] + 1];
      const bool smooth = end - begin <= kMaxTrianglesAround;
      Vec3f sum = area[t];
      if (smooth) {
        sum.setZero();
        for (std::uint32_t k = begin; k < end; ++k) {
          const std::uint32_t other = around.triangles[k];
          if (unit[other].dot(unit[t]) > kCosCrease) sum += area[other];
        }
      }
      const auto normal = PackedNormal(sum);
      std::uint32_t found = smooth ? latest[vertex] : kNone;
      while (found != kNone && lit.vertices[found].n_O != normal) found = previous[found];
      if (found == kNone) {
        found = static_cast<std::uint32_t>(lit.vertices.size());
        lit.vertices.push_back({mesh.vertices_O[vertex], normal});
        lit.source.push_back(vertex);
        previous.push_back(latest[vertex]);
        latest[vertex] = found;
      }
      lit.triangles[t][corner] = found;
    }
  }
  return lit;
}

}  // namespace plumbline::display
