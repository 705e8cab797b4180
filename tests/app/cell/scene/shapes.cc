#include "tests/app/cell/scene/shapes.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <numbers>

namespace plumbline::test {
namespace {

template <typename T>
std::string BytesOf(const T& value) {
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);  // NOLINT(bugprone-*)
  return bytes;
}

std::string BinaryStl(const scene::TriangleMesh& mesh) {
  std::string file =
      std::string(80, ' ') + BytesOf(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const scene::Triangle& triangle : mesh.triangles) {
    file += std::string(12, '\0');
    for (const std::uint32_t i : triangle) file += BytesOf(mesh.vertices_O[i]);
    file += std::string(2, '\0');
  }
  return file;
}

std::string Obj(const scene::TriangleMesh& mesh) {
  std::string file = "o shape\n";
  for (const Vec3f& p : mesh.vertices_O) file += fmt::format("v {} {} {}\n", p.x(), p.y(), p.z());
  for (const scene::Triangle& t : mesh.triangles) {
    file += fmt::format("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
  }
  return file;
}

std::string PlyHeader(const scene::TriangleMesh& mesh, const char* form) {
  return fmt::format(
      "ply\nformat {} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float "
      "z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
      form, mesh.vertices_O.size(), mesh.triangles.size());
}

std::string Ply(const scene::TriangleMesh& mesh) {
  std::string file = PlyHeader(mesh, "ascii");
  for (const Vec3f& p : mesh.vertices_O) file += fmt::format("{} {} {}\n", p.x(), p.y(), p.z());
  for (const scene::Triangle& t : mesh.triangles)
    file += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return file;
}

std::string Vrml(const scene::TriangleMesh& mesh) {
  std::string file =
      "#VRML V2.0 utf8\nShape { geometry IndexedFaceSet { coord Coordinate { point [";
  for (const Vec3f& p : mesh.vertices_O) file += fmt::format("{} {} {},\n", p.x(), p.y(), p.z());
  file += "] } coordIndex [\n";
  for (const scene::Triangle& t : mesh.triangles)
    file += fmt::format("{},{},{},-1,\n", t[0], t[1], t[2]);
  return file + "] } }\n";
}

std::string Base64(const std::string& bytes) {
  constexpr char kLetters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      word = word << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    }
    for (std::size_t k = 0; k < 4; ++k) {
      const bool there = i + k <= bytes.size();
      text += there ? kLetters[word >> (18 - 6 * k) & 63U] : '=';
    }
  }
  return text;
}

/// Binary buffer of a glTF file: vertices, then indices.
std::string GltfBuffer(const scene::TriangleMesh& mesh) {
  std::string buffer;
  for (const Vec3f& p : mesh.vertices_O) buffer += BytesOf(p);
  for (const scene::Triangle& triangle : mesh.triangles) buffer += BytesOf(triangle);
  return buffer;
}

std::string GltfJson(const scene::TriangleMesh& mesh, const std::string& uri) {
  const std::size_t vertices = mesh.vertices_O.size(), indices = 3 * mesh.triangles.size();
  Vec3f low = mesh.vertices_O.front(), high = low;
  for (const Vec3f& p : mesh.vertices_O) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return fmt::format(
      R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],)"
      R"("meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"accessors":[)"
      R"({{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":[{},{},{}],)"
      R"("max":[{},{},{}]}},{{"bufferView":1,"componentType":5125,"count":{},"type":"SCALAR"}}],)"
      R"("bufferViews":[{{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},)"
      R"("byteLength":{}}}],"buffers":[{{"byteLength":{}{}}}]}})",
      vertices, low.x(), low.y(), low.z(), high.x(), high.y(), high.z(), indices, 12 * vertices,
      12 * vertices, 4 * indices, 12 * vertices + 4 * indices, uri);
}

std::string Gltf(const scene::TriangleMesh& mesh) {
  return GltfJson(mesh, fmt::format(R"(,"uri":"data:application/octet-stream;base64,{}")",
                                    Base64(GltfBuffer(mesh))));
}

std::string Glb(const scene::TriangleMesh& mesh) {
  std::string json = GltfJson(mesh, "");
  json.resize((json.size() + 3) / 4 * 4, ' ');
  const std::string buffer = GltfBuffer(mesh);
  const auto word = [](std::size_t number) { return BytesOf(static_cast<std::uint32_t>(number)); };
  return "glTF" + word(2) + word(28 + json.size() + buffer.size()) + word(json.size()) + "JSON" +
         json + word(buffer.size()) + std::string("BIN\0", 4) + buffer;
}

}  // namespace

scene::TriangleMesh Cuboid(const Vec3f& size) {
  scene::TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.vertices_O.push_back(
        Vec3f(i & 1 ? 0.5F : -0.5F, i & 2 ? 0.5F : -0.5F, i & 4 ? 0.5F : -0.5F).cwiseProduct(size));
  }
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4},
                    {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
  return mesh;
}

scene::TriangleMesh Sphere(float radius, int rings, int segments) {
  scene::TriangleMesh mesh;
  constexpr float kPi = std::numbers::pi_v<float>;
  mesh.vertices_O.emplace_back(0, 0, radius);
  for (int i = 1; i < rings; ++i) {
    const float a = kPi * static_cast<float>(i) / static_cast<float>(rings);
    for (int k = 0; k < segments; ++k) {
      const float b = 2 * kPi * static_cast<float>(k) / static_cast<float>(segments);
      mesh.vertices_O.emplace_back(radius * std::sin(a) * std::cos(b),
                                   radius * std::sin(a) * std::sin(b), radius * std::cos(a));
    }
  }
  mesh.vertices_O.emplace_back(0, 0, -radius);
  const auto last = static_cast<std::uint32_t>(mesh.vertices_O.size() - 1);
  const auto at = [segments](int ring, int k) {
    return static_cast<std::uint32_t>(1 + (ring - 1) * segments + k % segments);
  };
  for (int k = 0; k < segments; ++k) {
    mesh.triangles.push_back({0, at(1, k), at(1, k + 1)});
    for (int i = 1; i + 1 < rings; ++i) {
      mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i, k + 1)});
      mesh.triangles.push_back({at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)});
    }
    mesh.triangles.push_back({at(rings - 1, k), last, at(rings - 1, k + 1)});
  }
  return mesh;
}

std::string StlText(const scene::TriangleMesh& mesh) {
  std::string file = "solid shape\n";
  for (const scene::Triangle& triangle : mesh.triangles) {
    file += " facet normal 0 0 0\n  outer loop\n";
    for (const std::uint32_t i : triangle) {
      const Vec3f& p = mesh.vertices_O[i];
      file += fmt::format("   vertex {} {} {}\n", p.x(), p.y(), p.z());
    }
    file += "  endloop\n endfacet\n";
  }
  return file + "endsolid shape\n";
}

std::string BinaryPlyText(const scene::TriangleMesh& mesh) {
  std::string file = PlyHeader(mesh, "binary_little_endian");
  for (const Vec3f& p : mesh.vertices_O) file += BytesOf(p);
  for (const scene::Triangle& triangle : mesh.triangles) file += '\3' + BytesOf(triangle);
  return file;
}

std::string MeshFileText(const scene::TriangleMesh& mesh, cell::MeshFormat format) {
  switch (format) {
    case cell::MeshFormat::kVrml:
      return Vrml(mesh);
    case cell::MeshFormat::kStl:
      return BinaryStl(mesh);
    case cell::MeshFormat::kObj:
      return Obj(mesh);
    case cell::MeshFormat::kPly:
      return Ply(mesh);
    case cell::MeshFormat::kGltf:
      return Gltf(mesh);
    case cell::MeshFormat::kGlb:
      break;
  }
  return Glb(mesh);
}

}  // namespace plumbline::test
