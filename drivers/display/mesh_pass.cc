#include "drivers/display/mesh_pass.h"

#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include "drivers/display/colour_scale.h"
#include "drivers/display/mesh_normals.h"
#include "drivers/display/projection.h"

namespace plumbline::display {
namespace {

constexpr int kStressColours = 256;

static_assert(scene::kBendStations == 33, "the shader assumes it");

constexpr const char* kMeshVertex = R"(
layout(location = 0) in vec3 a_p_O;
layout(location = 1) in vec3 a_n_O;
uniform mat4 u_X_FO;  // includes the scale
uniform mat4 u_X_CF;
uniform mat4 u_clip;
uniform float u_length;        // [m]; 0: straight
uniform float u_exaggeration;
uniform float u_per_stress;    // [1/Pa]
uniform vec4 u_station[66];    // d, z; then r, stress
out vec3 p_C;
out float light;
out float stress;

void main() {
  vec3 p = (u_X_FO * vec4(a_p_O, 1.0)).xyz;
  vec3 n = mat3(u_X_FO) * a_n_O;
  stress = u_length > 0.0 ? u_station[1].w * u_per_stress : 0.0;  // inboard: as at root
  if (u_length > 0.0 && p.z > 0.0) {
    float z = min(p.z, u_length);
    int i = min(int(z / u_length * 32.0), 31);
    while (i > 0 && z < u_station[2 * i].w) --i;
    while (i < 31 && z > u_station[2 * i + 2].w) ++i;
    vec4 d_a = u_station[2 * i], r_a = u_station[2 * i + 1];
    vec4 d_b = u_station[2 * i + 2], r_b = u_station[2 * i + 3];
    float dz = d_b.w - d_a.w;
    float t = (z - d_a.w) / dz;
    float t2 = t * t, t3 = t2 * t;
    vec3 d = (2.0 * t3 - 3.0 * t2 + 1.0) * d_a.xyz + (3.0 * t2 - 2.0 * t3) * d_b.xyz +
             dz * ((t3 - 2.0 * t2 + t) * vec3(r_a.y, -r_a.x, 0.0) +
                   (t3 - t2) * vec3(r_b.y, -r_b.x, 0.0));
    vec4 r = mix(r_a, r_b, t);
    p += u_exaggeration * (d + cross(r.xyz, p - vec3(0.0, 0.0, z)));
    n += u_exaggeration * cross(r.xyz, n);
    stress = r.w * u_per_stress;
  }
  p_C = (u_X_CF * vec4(p, 1.0)).xyz;
  vec3 n_C = normalize(mat3(u_X_CF) * n);
  light = 0.25 + 0.5 * abs(dot(n_C, normalize(p_C))) +
          0.25 * abs(dot(n_C, vec3(-0.48, -0.8, -0.36)));
  gl_Position = u_clip * vec4(p_C, 1.0);
}
)";

constexpr const char* kMeshFragment = R"(
in vec3 p_C;
in float light;
in float stress;
uniform vec4 u_colour;
uniform sampler2D u_stress_colours;
uniform vec4 u_plane;  // normal, distance
out vec4 colour;
void main() {
#ifdef CUT
  if (dot(u_plane.xyz, p_C) > u_plane.w) discard;
#endif
#ifdef BY_STRESS
  vec3 surface = texture(u_stress_colours, vec2(stress * (255.0 / 256.0) + 0.5 / 256.0, 0.5)).rgb;
#else
  vec3 surface = u_colour.rgb;
#endif
  colour = vec4(surface * light, u_colour.a);
}
)";

Eigen::Matrix4f MatrixOf(const Pose& X, const Vec3& scale = Vec3::Ones()) {
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  matrix.topLeftCorner<3, 3>() = (X.R * scale.asDiagonal()).cast<float>();
  matrix.topRightCorner<3, 1>() = X.p.cast<float>();
  return matrix;
}

/// A surface of revolution about z with closed ends, from a profile of (radius, z).
scene::TriangleMesh Revolved(const std::vector<std::pair<float, float>>& profile) {
  constexpr std::uint32_t kAround = 32;
  scene::TriangleMesh mesh;
  for (const auto& [radius, z] : profile) {
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const auto angle = static_cast<float>(2 * std::numbers::pi * k / kAround);
      mesh.vertices_O.emplace_back(radius * std::cos(angle), radius * std::sin(angle), z);
    }
  }
  for (std::uint32_t ring = 0; ring + 1 < profile.size(); ++ring) {
    for (std::uint32_t k = 0; k < kAround; ++k) {
      const std::uint32_t a = ring * kAround + k, b = ring * kAround + (k + 1) % kAround;
      mesh.triangles.push_back({a, b, b + kAround});
      mesh.triangles.push_back({a, b + kAround, a + kAround});
    }
  }
  return mesh;
}

/// With a ring for each station of a bend field.
scene::TriangleMesh UnitCylinder() {
  std::vector<std::pair<float, float>> profile = {{0.0F, 0.0F}};
  for (int k = 0; k < scene::kBendStations; ++k)
    profile.emplace_back(1.0F, static_cast<float>(k) / (scene::kBendStations - 1));
  profile.emplace_back(0.0F, 1.0F);
  return Revolved(profile);
}

scene::TriangleMesh UnitSphere() {
  constexpr int kRings = 16;
  std::vector<std::pair<float, float>> profile;
  for (int k = 0; k <= kRings; ++k) {
    const auto angle = static_cast<float>(std::numbers::pi * k / kRings);
    profile.emplace_back(std::sin(angle), -std::cos(angle));
  }
  return Revolved(profile);
}

bool IsFinite(const scene::DrawnMesh& drawn) {
  return drawn.X_CF.R.allFinite() && drawn.X_CF.p.allFinite() && drawn.X_FO.R.allFinite() &&
         drawn.X_FO.p.allFinite() && std::isfinite(drawn.scale) && drawn.stretch.allFinite();
}

}  // namespace

Result<MeshPass> MeshPass::Create() {
  MeshPass pass;
  for (std::size_t i = 0; i < pass.programs_.size(); ++i) {
    std::string defines = (i & 1U) != 0 ? "#define BY_STRESS\n" : "";
    if ((i & 2U) != 0) defines += "#define CUT\n";
    auto program = GlProgram::Build(kMeshVertex, defines + kMeshFragment, {"p_C"});
    if (!program) return program.failure();
    pass.programs_[i] = std::move(program).value();
  }
  std::vector<std::uint8_t> scale;
  for (int i = 0; i < kStressColours; ++i) {
    const scene::Colour colour = StressColour(i / (kStressColours - 1.0));
    for (const float c : {colour.r, colour.g, colour.b}) {
      scale.push_back(static_cast<std::uint8_t>(std::lround(255 * c)));
    }
  }
  glBindTexture(GL_TEXTURE_2D, *pass.stress_colours_);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, kStressColours, 1, 0, GL_RGB, GL_UNSIGNED_BYTE,
               scale.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  for (const auto& [number, solid] : {std::pair(scene::kUnitCylinder, UnitCylinder()),
                                      std::pair(scene::kUnitSphere, UnitSphere())}) {
    if (const auto loaded = pass.LoadAs(number, solid); !loaded) return loaded.failure();
  }
  return pass;
}

Result<int> MeshPass::LoadAs(int number, const scene::TriangleMesh& mesh) {
  if (mesh.triangles.empty()) return Error{"the mesh has no triangles"};
  if (mesh.triangles.size() > kMaxTriangles) {
    return Error{"the mesh has more than 5 million triangles. Simplify it."};
  }
  for (const scene::Triangle& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) {
      if (vertex >= mesh.vertices_O.size())
        return Error{"a triangle of the mesh refers to a vertex that does not exist"};
    }
  }
  LitMesh lit = ComputeNormals(mesh);
  Loaded loaded;
  glBindVertexArray(*loaded.array);
  glBindBuffer(GL_ARRAY_BUFFER, *loaded.vertices);
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(lit.vertices.size() * sizeof(LitVertex)),
               lit.vertices.data(), GL_STATIC_DRAW);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, *loaded.indices);
  glBufferData(GL_ELEMENT_ARRAY_BUFFER,
               static_cast<GLsizeiptr>(lit.triangles.size() * sizeof(scene::Triangle)),
               lit.triangles.data(), GL_STATIC_DRAW);
  const auto offset = [](std::size_t bytes) { return reinterpret_cast<const void*>(bytes); };
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(LitVertex),
                        offset(offsetof(LitVertex, p_O)));
  glVertexAttribPointer(1, 3, GL_SHORT, GL_TRUE, sizeof(LitVertex),
                        offset(offsetof(LitVertex, n_O)));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  glBindVertexArray(0);
  loaded.index_count = static_cast<GLsizei>(3 * lit.triangles.size());
  loaded.vertex_count = mesh.vertices_O.size();
  loaded.source = std::move(lit.source);
  if (const std::string problem = GlProblem(); !problem.empty()) return Error{problem};
  meshes_.insert_or_assign(number, std::move(loaded));
  return number;
}

const GlProgram& MeshPass::ProgramFor(const scene::DisplayList& list,
                                      const scene::DrawnMesh& drawn) const {
  return programs_[(drawn.by_stress && !drawn.occludes ? 1U : 0U) + (list.clip ? 2U : 0U)];
}

void MeshPass::SetUniforms(const GlProgram& program, const scene::DisplayList& list,
                           const scene::DrawnMesh& drawn) {
  program.Use();
  const Eigen::Matrix4f clip = ClipOfCamera(list.pinhole, list.size);
  const Eigen::Matrix4f X_CF = MatrixOf(drawn.X_CF),
                        X_FO = MatrixOf(drawn.X_FO, drawn.scale * drawn.stretch);
  glUniformMatrix4fv(program.UniformLocation("u_clip"), 1, GL_FALSE, clip.data());
  glUniformMatrix4fv(program.UniformLocation("u_X_CF"), 1, GL_FALSE, X_CF.data());
  glUniformMatrix4fv(program.UniformLocation("u_X_FO"), 1, GL_FALSE, X_FO.data());
  const scene::Colour& c = drawn.colour;
  glUniform4f(program.UniformLocation("u_colour"), c.r, c.g, c.b, c.a);
  if (list.clip) {
    const Vec3f normal = list.clip->normal_C.cast<float>();
    glUniform4f(program.UniformLocation("u_plane"), normal.x(), normal.y(), normal.z(),
                static_cast<float>(list.clip->distance_m));
  }
  glUniform1i(program.UniformLocation("u_stress_colours"), 0);
  glUniform1f(program.UniformLocation("u_length"), drawn.bends ? list.bend.length_m : 0);
  if (!drawn.bends) return;
  glUniform1f(program.UniformLocation("u_exaggeration"), static_cast<float>(list.exaggeration));
  glUniform1f(program.UniformLocation("u_per_stress"),
              list.stress_full_Pa > 0 ? static_cast<float>(1 / list.stress_full_Pa) : 0);
  std::array<Eigen::Vector4f, std::size_t{2} * scene::kBendStations> stations;
  for (int i = 0; i < scene::kBendStations; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const scene::BendStation& station = list.bend.stations[k];
    stations[2 * k] << station.d_F, static_cast<float>(list.bend.StationZ(i));
    stations[2 * k + 1] << station.r_F, station.stress_Pa;
  }
  glUniform4fv(program.UniformLocation("u_station"), 2 * scene::kBendStations, stations[0].data());
}

void MeshPass::DrawOne(const scene::DisplayList& list, const scene::DrawnMesh& drawn) {
  const auto found = meshes_.find(drawn.mesh);
  if (found == meshes_.end() || !IsFinite(drawn)) return;
  SetUniforms(ProgramFor(list, drawn), list, drawn);
  glBindVertexArray(*found->second.array);
  const GLsizei count = found->second.index_count;
  const bool transparent = drawn.colour.a < 1;
  if (drawn.occludes || transparent) {
    glColorMask(GL_FALSE, GL_FALSE, GL_FALSE, GL_FALSE);
    glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
    glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  }
  if (drawn.occludes) return;
  if (transparent) {  // the depth prepass leaves only its nearest surface to blend
    glEnable(GL_BLEND);
  }
  glDrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
  glDisable(GL_BLEND);
}

void MeshPass::Draw(const scene::DisplayList& list) {
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDisable(GL_BLEND);
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, *stress_colours_);
  for (const scene::DrawnMesh& drawn : list.meshes) {
    if (drawn.occludes) DrawOne(list, drawn);
  }
  for (const scene::DrawnMesh& drawn : list.meshes) {
    if (!drawn.occludes && drawn.colour.a >= 1) DrawOne(list, drawn);
  }
  for (const scene::DrawnMesh& drawn : list.meshes) {
    if (!drawn.occludes && drawn.colour.a < 1) DrawOne(list, drawn);
  }
  glBindVertexArray(0);
}

std::vector<Vec3f> MeshPass::TransformedVertices(const scene::DisplayList& list,
                                                 const scene::DrawnMesh& drawn) {
  const auto found = meshes_.find(drawn.mesh);
  if (found == meshes_.end()) return {};
  Loaded& mesh = found->second;
  const auto bytes = static_cast<GLsizeiptr>(mesh.source.size() * sizeof(Vec3f));
  GlBuffer captured;
  glBindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, *captured);
  glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, bytes, nullptr, GL_STREAM_READ);
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, *captured);
  SetUniforms(ProgramFor(list, drawn), list, drawn);
  glBindVertexArray(*mesh.array);
  glEnable(GL_RASTERIZER_DISCARD);
  glBeginTransformFeedback(GL_POINTS);
  glDrawArrays(GL_POINTS, 0, static_cast<GLsizei>(mesh.source.size()));
  glEndTransformFeedback();
  glDisable(GL_RASTERIZER_DISCARD);
  glBindVertexArray(0);
  std::vector<Vec3f> placed(mesh.vertex_count, Vec3f::Zero());
  const void* memory = glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0, bytes, GL_MAP_READ_BIT);
  if (memory != nullptr) {
    const auto* p_C = static_cast<const float*>(memory);
    for (std::size_t i = 0; i < mesh.source.size(); ++i) {
      placed[mesh.source[i]] = Vec3f(p_C[3 * i], p_C[3 * i + 1], p_C[3 * i + 2]);
    }
    glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);
  }
  glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, 0);
  return placed;
}

}  // namespace plumbline::display
