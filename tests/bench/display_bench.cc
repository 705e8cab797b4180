// Benchmark of the overlay on one CPU core without a GPU against the same picture in plain OpenGL:
// 1080p, a new camera image each time, 50,000 triangles, read back. ./dev bench
#include <GLES3/gl3.h>
#include <fmt/format.h>
#include <sched.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "drivers/display/gl_objects.h"
#include "drivers/display/mesh_normals.h"
#include "drivers/display/projection.h"
#include "drivers/display/renderer.h"
#include "firmware-like/beam/beam.h"
#include "firmware-like/geometry/rotation.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/model/materials.h"
#include "firmware-like/scene/loaded_tool.h"
#include "tests/bench/bench_timing.h"
#include "tests/bench/rows.h"

namespace plumbline {
namespace {

constexpr image::ImageSize kPicture{1920, 1080};

/// CPU time of all threads, independent of other load on the machine.
double Milliseconds(const std::function<void()>& work) {
  const auto now_ms = [] {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
  };
  const double start_ms = now_ms();
  work();
  return now_ms() - start_ms;
}

/// A round bar along z with 50,000 triangles.
scene::TriangleMesh Bar(double radius_m, double length_m) {
  constexpr int kRings = 250, kAround = 100;
  scene::TriangleMesh mesh;
  for (int i = 0; i <= kRings; ++i) {
    for (int k = 0; k < kAround; ++k) {
      const double angle = 2 * std::numbers::pi * k / kAround;
      mesh.vertices_O.push_back(
          Vec3(radius_m * std::cos(angle), radius_m * std::sin(angle), length_m * i / kRings)
              .cast<float>());
    }
  }
  const auto index = [](int i, int k) {
    return static_cast<std::uint32_t>(i * kAround + k % kAround);
  };
  for (int i = 0; i < kRings; ++i) {
    for (int k = 0; k < kAround; ++k) {
      mesh.triangles.push_back({index(i, k), index(i, k + 1), index(i + 1, k + 1)});
      mesh.triangles.push_back({index(i, k), index(i + 1, k + 1), index(i + 1, k)});
    }
  }
  return mesh;
}

/// Peer: the distorted image and the straight mesh with the same light, nothing else.
class PlainPicture {
 public:
  explicit PlainPicture(const scene::TriangleMesh& mesh) : lit_(display::ComputeNormals(mesh)) {
    image_program_ = display::GlProgram::Build(
                         "out vec2 at; void main() { vec2 c = vec2(gl_VertexID == 1 ? 3.0 : -1.0, "
                         "gl_VertexID == 2 ? 3.0 : -1.0); at = 0.5 * c + 0.5; "
                         "gl_Position = vec4(c, 0.0, 1.0); }",
                         "in vec2 at; uniform sampler2D u_pixels; out vec4 colour; void main() { "
                         "colour = vec4(texture(u_pixels, at).rrr, 1.0); }")
                         .value();
    mesh_program_ =
        display::GlProgram::Build(
            "layout(location = 0) in vec3 p; layout(location = 1) in vec3 n; uniform mat4 u_pose; "
            "uniform mat4 u_clip; out float light; void main() { vec4 q = u_pose * vec4(p, 1.0); "
            "vec3 m = normalize(mat3(u_pose) * n); light = 0.25 + 0.5 * abs(dot(m, "
            "normalize(q.xyz))) + 0.25 * abs(dot(m, vec3(-0.48, -0.8, -0.36))); "
            "gl_Position = u_clip * q; }",
            "in float light; uniform vec4 u_colour; out vec4 colour; void main() { "
            "colour = vec4(u_colour.rgb * light, u_colour.a); }")
            .value();
    glBindRenderbuffer(GL_RENDERBUFFER, *colour_);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, kPicture.width, kPicture.height);
    glBindRenderbuffer(GL_RENDERBUFFER, *depth_);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, kPicture.width, kPicture.height);
    glBindFramebuffer(GL_FRAMEBUFFER, *framebuffer_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, *colour_);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, *depth_);
    glBindTexture(GL_TEXTURE_2D, *image_);
    glTexStorage2D(GL_TEXTURE_2D, 1, GL_R8, kPicture.width, kPicture.height);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glBindVertexArray(*array_);
    glBindBuffer(GL_ARRAY_BUFFER, *vertices_);
    glBufferData(GL_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(lit_.vertices.size() * sizeof(display::LitVertex)),
                 lit_.vertices.data(), GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, *indices_);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER,
                 static_cast<GLsizeiptr>(lit_.triangles.size() * sizeof(scene::Triangle)),
                 lit_.triangles.data(), GL_STATIC_DRAW);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(display::LitVertex), nullptr);
    glVertexAttribPointer(1, 3, GL_SHORT, GL_TRUE, sizeof(display::LitVertex),
                          reinterpret_cast<const void*>(sizeof(Vec3f)));
    glEnableVertexAttribArray(0);
    glEnableVertexAttribArray(1);
    pixels_.resize(std::size_t{4} * kPicture.width * kPicture.height);
  }

  void Draw(const std::vector<std::uint8_t>& grey, const scene::DisplayList& list) {
    glBindFramebuffer(GL_FRAMEBUFFER, *framebuffer_);
    glViewport(0, 0, kPicture.width, kPicture.height);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDisable(GL_DEPTH_TEST);
    image_program_.Use();
    glBindTexture(GL_TEXTURE_2D, *image_);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, kPicture.width, kPicture.height, GL_RED,
                    GL_UNSIGNED_BYTE, grey.data());
    glBindVertexArray(*array_);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glEnable(GL_DEPTH_TEST);
    mesh_program_.Use();
    const scene::DrawnMesh& drawn = list.meshes[0];
    Eigen::Matrix4f pose = Eigen::Matrix4f::Identity();
    pose.topLeftCorner<3, 3>() = drawn.X_CF.R.cast<float>();
    pose.topRightCorner<3, 1>() = drawn.X_CF.p.cast<float>();
    glUniformMatrix4fv(mesh_program_.UniformLocation("u_pose"), 1, GL_FALSE, pose.data());
    const Eigen::Matrix4f clip = display::ClipOfCamera(list.pinhole, list.size);
    glUniformMatrix4fv(mesh_program_.UniformLocation("u_clip"), 1, GL_FALSE, clip.data());
    glUniform4f(mesh_program_.UniformLocation("u_colour"), 1, 0.5F, 0, 1);
    glDrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * lit_.triangles.size()), GL_UNSIGNED_INT,
                   nullptr);
    glBindVertexArray(0);
    glReadPixels(0, 0, kPicture.width, kPicture.height, GL_RGBA, GL_UNSIGNED_BYTE, pixels_.data());
  }

 private:
  display::LitMesh lit_;
  display::GlProgram image_program_, mesh_program_;
  display::GlFramebuffer framebuffer_;
  display::GlRenderbuffer colour_, depth_;
  display::GlTexture image_;
  display::GlVertexArray array_;
  display::GlBuffer vertices_, indices_;
  std::vector<std::uint8_t> pixels_;
};

/// Largest deviation of a vertex from the finite elements of the beam [mm].
double BendError(display::Renderer& renderer, const scene::DisplayList& list,
                 const scene::TriangleMesh& mesh, const beam::BeamSolution& beam) {
  const scene::DrawnMesh& drawn = list.meshes[0];
  const std::vector<Vec3f> placed = renderer.TransformedVertices(list, drawn);
  const double length_m = beam.NodeZ(beam.node_count() - 1);
  double worst_m = placed.empty() ? 1 : 0;
  for (std::size_t i = 0; i < placed.size(); ++i) {
    const Vec3 p_F = mesh.vertices_O[i].cast<double>();
    const double z = std::clamp(p_F.z(), 0.0, length_m);
    const beam::SectionState section = beam.At(z);
    const Vec3 bent_F = p_F + section.d_F + section.r_F.cross(p_F - Vec3(0, 0, z));
    worst_m = std::max(worst_m, (placed[i].cast<double>() - drawn.X_CF * bent_F).norm());
  }
  return 1e3 * worst_m;
}

int Run(bench::Effort effort) {
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  sched_setaffinity(0, sizeof one, &one);
  setenv("LP_NUM_THREADS", "1", 1);  // read when the context is created
  auto context = display::GlContext::Create();
  if (!context) {
    bench::ReportSkipped("the display's picture", context.error());
    return 0;
  }
  auto renderer = display::Renderer::Create(**context);
  if (!renderer) {
    fmt::print("the renderer cannot be created: {}\n", renderer.error());
    return 1;
  }

  model::Tool tool;
  tool.rigid = false;
  tool.segments = {{1.2, model::SquareTubeSection(0.06, 0.004), *model::MaterialByName("steel")}};
  deflection::LoadedState state;
  state.tool.g_F = Vec3(9.8, 0, 0);
  state.tool.payload = {60, Vec3(0, 0.05, 1.3)};
  const beam::BeamSolution beam =
      beam::Beam(tool, 4).Solve({.masses = {{60, 1.2, Vec3(0, 0.05, 1.3)}}, .g_F = state.tool.g_F});

  const scene::TriangleMesh mesh = Bar(0.15, 1.2);
  std::vector<std::uint8_t> grey(std::size_t{1920} * 1080);
  for (std::size_t i = 0; i < grey.size(); ++i) {
    grey[i] = static_cast<std::uint8_t>((i / 1920 / 4 + i % 1920 / 4) % 256);
  }
  scene::DisplayList list;
  list.size = kPicture;
  list.pinhole = {.fx = 1700, .fy = 1700, .cx = 959.5, .cy = 539.5};
  list.background.luma = {grey.data(), 1920, 1080, 1920};
  list.background.lens = list.pinhole;
  list.background.lens->k1 = -0.2;
  list.background.lens->k2 = 0.05;
  list.background.lens->p1 = 1e-3;
  list.bend = scene::BendFieldOf(tool, state);
  scene::DrawnMesh drawn;
  drawn.mesh = (*renderer)->LoadMesh(mesh).value();
  drawn.X_CF.R = RotationFromRollPitchYaw(Vec3(0.1, 1.4, 0.2));
  drawn.X_CF.p = Vec3(-0.6, 0, 1.6);
  drawn.bends = true;
  drawn.colour = {1, 0.5F, 0, 1};
  list.meshes = {drawn};
  PlainPicture plain(mesh);

  const auto draw_ours = [&] {
    ++list.background.sequence;
    if ((*renderer)->Draw(list) != display::DrawResult::kDrawn) std::abort();
    display::ReadInStrips(**renderer, [](int, const display::PictureView&) {});
  };
  const auto draw_plain = [&] { plain.Draw(grey, list); };
  std::vector<double> ours_ms, plain_ms;
  const int pictures = bench::Choose(effort, 2, 30, 200);
  for (int i = effort == bench::Effort::kSmoke ? -1 : -5; i < pictures; ++i) {
    const double ours = Milliseconds(draw_ours), other = Milliseconds(draw_plain);
    if (i < 0) continue;
    ours_ms.push_back(ours);
    plain_ms.push_back(other);
  }
  fmt::print("{}, {} triangles, {} pictures\n", (*context)->description(), mesh.triangles.size(),
             pictures);
  bench::Report({.what = "1080p, undistorted, 50,000 bent triangles, one core, read back",
                 .ours = bench::Median(ours_ms),
                 .unit = "ms",
                 .goal = bench::RatioAtMost(1.5),
                 .peer = "plain OpenGL, distorted and straight",
                 .peers = bench::Median(plain_ms)});
  bench::Report({.what = "bending in the shader against the finite elements",
                 .ours = BendError(**renderer, list, mesh, beam),
                 .unit = "mm",
                 .goal = bench::AtMost(0.01),
                 .timed = false});
  return 0;
}

}  // namespace
}  // namespace plumbline

int main(int argc, char** argv) {
  return plumbline::Run(plumbline::bench::EffortFrom(argc, argv));
}
