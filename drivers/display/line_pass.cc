#include "drivers/display/line_pass.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "drivers/display/projection.h"

namespace plumbline::display {
namespace {

constexpr const char* kLineVertex = R"(
layout(location = 0) in vec3 a_position;
layout(location = 1) in vec3 a_segment;   // along, across, length
layout(location = 2) in vec3 a_line;    // start, half width, dash
layout(location = 3) in vec4 a_colour;
uniform vec2 u_size;
out vec3 segment;
flat out vec3 line;
flat out vec4 line_colour;
void main() {
  gl_Position = vec4(2.0 * (a_position.xy + 0.5) / u_size - 1.0, a_position.z, 1.0);
  segment = a_segment;
  line = a_line;
  line_colour = a_colour;
}
)";

constexpr const char* kLineFragment = R"(
in vec3 segment;
flat in vec3 line;
flat in vec4 line_colour;
out vec4 colour;
void main() {
  float beyond = max(max(-segment.x, segment.x - segment.z), 0.0);
  float cover = clamp(line.y + 0.5 - length(vec2(beyond, segment.y)), 0.0, 1.0);
  if (line.z > 0.0 && mod(line.x + segment.x, 2.0 * line.z) > line.z) cover = 0.0;
  if (cover <= 0.0) discard;
  colour = vec4(line_colour.rgb, line_colour.a * cover);
}
)";

constexpr const char* kGridFragment = R"(
uniform vec4 u_pinhole;  // 1/fx, 1/fy, -(cx + 1/2)/fx, -(cy + 1/2)/fy
uniform vec4 u_plane;    // normal, distance
uniform vec3 u_first;    // directions of the grid
uniform vec3 u_second;
uniform vec2 u_origin;   // in cells
uniform vec2 u_opacity;  // of the lines, and of lines at a tenth of their distance
uniform float u_nearest;
out vec4 colour;
float Lines(vec2 at, vec2 a_pixel) {  // at: in grid cells
  vec2 from_line = abs(fract(at + 0.5) - 0.5) / a_pixel;
  vec2 cover = clamp(1.2 - from_line, 0.0, 1.0) * clamp(0.5 / a_pixel - 1.0, 0.0, 1.0);
  return max(cover.x, cover.y);
}
void main() {
  vec3 ray = vec3(gl_FragCoord.xy * u_pinhole.xy + u_pinhole.zw, 1.0);
  float z = u_plane.w / dot(u_plane.xyz, ray);
  vec3 p = ray * z;
  vec2 at = vec2(dot(u_first, p), dot(u_second, p)) - u_origin;
  vec2 a_pixel = max(fwidth(at), vec2(1e-9));
  if (!(z > u_nearest)) discard;
  float cover = max(u_opacity.y * Lines(at * 10.0, a_pixel * 10.0), u_opacity.x * Lines(at, a_pixel));
  if (cover <= 0.0) discard;
  gl_FragDepth = 1.0 - u_nearest / z;
  colour = vec4(0.75, 0.85, 1.0, cover);
}
)";

constexpr double kLineDepthScale = 0.999;  ///< draws lines slightly closer than surfaces

float DepthOf(double Z) {
  return static_cast<float>(1 - 2 * static_cast<double>(kNearPlane_m) / Z);
}

/// Keeps the part of a-b where value >= 0, given at both ends; false: none is left.
bool ClipAgainstPlane(Vec3& a, Vec3& b, double at_a, double at_b) {
  if (!(at_a >= 0) && !(at_b >= 0)) return false;
  if (at_a >= 0 && at_b >= 0) return true;
  const Vec3 middle = a + at_a / (at_a - at_b) * (b - a);
  (at_a < 0 ? a : b) = middle;
  return true;
}

/// Clips a segment to its visible part. Returns false if nothing is visible.
bool ClipSegment(const std::optional<scene::ClipPlane>& clip, Vec3& a, Vec3& b) {
  if (!a.allFinite() || !b.allFinite()) return false;
  const double nearest = 1.01 * static_cast<double>(kNearPlane_m);
  if (!ClipAgainstPlane(a, b, a.z() - nearest, b.z() - nearest)) return false;
  if (!clip) return true;
  return ClipAgainstPlane(a, b, clip->distance_m - clip->normal_C.dot(a),
                          clip->distance_m - clip->normal_C.dot(b));
}

}  // namespace

Result<LinePass> LinePass::Create() {
  LinePass pass;
  auto lines = GlProgram::Build(kLineVertex, kLineFragment);
  if (!lines) return lines.failure();
  auto grid = GlProgram::Build(kWholePictureVertex, kGridFragment);
  if (!grid) return grid.failure();
  pass.line_program_ = std::move(lines).value();
  pass.grid_program_ = std::move(grid).value();
  pass.triangles_.Describe({{3, offsetof(Vertex, x)},
                            {3, offsetof(Vertex, along)},
                            {3, offsetof(Vertex, start)},
                            {4, offsetof(Vertex, r)}});
  return pass;
}

void LinePass::AddLine(const scene::DisplayList& list, const scene::DrawnLine& line) {
  const float half_width = std::max(line.width_px, 1.0F) / 2;
  const float margin = half_width + 1;
  const float dash = line.dashed ? 4 * std::max(line.width_px, 1.0F) : 0;
  double start = 0;
  for (std::size_t i = 1; i < line.points_C.size(); ++i) {
    Vec3 a = line.points_C[i - 1], b = line.points_C[i];
    if (!ClipSegment(list.clip, a, b)) continue;
    const lens::Vec2 from = Project(list.pinhole, a), to = Project(list.pinhole, b);
    // Far outside the picture single precision would lose the direction of the segment.
    if (from.cwiseAbs().maxCoeff() > 1e6 || to.cwiseAbs().maxCoeff() > 1e6) continue;
    const double length = (to - from).norm();
    const lens::Vec2 along = length > 0 ? lens::Vec2((to - from) / length) : lens::Vec2(1, 0);
    const lens::Vec2 across(-along.y(), along.x());
    const float depth_from = line.always_in_front ? 0 : DepthOf(kLineDepthScale * a.z());
    const float depth_to = line.always_in_front ? 0 : DepthOf(kLineDepthScale * b.z());
    const auto corner = [&](bool end, double side) {
      const double s = end ? length + static_cast<double>(margin) : -static_cast<double>(margin);
      const double t = side * static_cast<double>(margin);
      const lens::Vec2 p = from + s * along + t * across;
      const scene::Colour& c = line.colour;
      triangles_.Add({static_cast<float>(p.x()), static_cast<float>(p.y()),
                      end ? depth_to : depth_from, static_cast<float>(s), static_cast<float>(t),
                      static_cast<float>(length), static_cast<float>(start), half_width, dash, c.r,
                      c.g, c.b, c.a});
    };
    for (const auto& [end, side] : {std::pair(false, -1.0),
                                    {true, -1.0},
                                    {true, 1.0},
                                    {false, -1.0},
                                    {true, 1.0},
                                    {false, 1.0}}) {
      corner(end, side);
    }
    start += length;
  }
}

void LinePass::DrawLines(const scene::DisplayList& list) {
  if (triangles_.empty()) return;
  line_program_.Use();
  glUniform2f(line_program_.UniformLocation("u_size"), static_cast<float>(list.size.width),
              static_cast<float>(list.size.height));
  triangles_.Draw();
}

void LinePass::DrawGrid(const lens::Lens& pinhole, const Grid& grid) {
  const auto f = [](double value) { return static_cast<GLfloat>(value); };
  const auto put = [&](const char* name, const Vec3& v) {
    glUniform3f(grid_program_.UniformLocation(name), f(v.x()), f(v.y()), f(v.z()));
  };
  grid_program_.Use();
  glUniform4f(grid_program_.UniformLocation("u_pinhole"), f(1 / pinhole.fx), f(1 / pinhole.fy),
              f(-(pinhole.cx + 0.5) / pinhole.fx), f(-(pinhole.cy + 0.5) / pinhole.fy));
  glUniform4f(grid_program_.UniformLocation("u_plane"), f(grid.normal_C.x()), f(grid.normal_C.y()),
              f(grid.normal_C.z()), f(grid.distance_m));
  put("u_first", grid.first_per_m);
  put("u_second", grid.second_per_m);
  glUniform2f(grid_program_.UniformLocation("u_origin"), f(grid.first_per_m.dot(grid.origin_C)),
              f(grid.second_per_m.dot(grid.origin_C)));
  glUniform2f(grid_program_.UniformLocation("u_opacity"), grid.opacity, grid.fine_opacity);
  glUniform1f(grid_program_.UniformLocation("u_nearest"), kNearPlane_m);
  glBindVertexArray(*empty_array_);
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void LinePass::DrawClipGrid(const scene::DisplayList& list) {
  const scene::ClipPlane& clip = *list.clip;
  const double length = clip.normal_C.norm();
  if (!(length > 0) || !std::isfinite(length) || !std::isfinite(clip.distance_m)) return;
  const Vec3 normal = clip.normal_C / length;
  const Vec3 beside = std::abs(normal.x()) < 0.9 ? Vec3::UnitX() : Vec3::UnitY();
  const Vec3 first = (beside - normal.dot(beside) * normal).normalized();
  DrawGrid(list.pinhole, {.normal_C = normal,
                          .distance_m = clip.distance_m / length,
                          .first_per_m = first,
                          .second_per_m = normal.cross(first)});
}

void LinePass::DrawGround(const scene::DisplayList& list) {
  if (!list.ground) return;
  const scene::GroundGrid& ground = *list.ground;
  const Pose& X_CG = ground.X_CG;
  if (!X_CG.p.allFinite() || !X_CG.R.allFinite() || !(ground.cell_m > 0)) return;
  glEnable(GL_BLEND);
  glDisable(GL_DEPTH_TEST);
  const Vec3 normal = X_CG.R.col(2);
  DrawGrid(list.pinhole, {.normal_C = normal,
                          .distance_m = normal.dot(X_CG.p),
                          .first_per_m = X_CG.R.col(0) / ground.cell_m,
                          .second_per_m = X_CG.R.col(1) / ground.cell_m,
                          .origin_C = X_CG.p,
                          .opacity = ground.opacity,
                          .fine_opacity = 0});
  glDisable(GL_BLEND);
}

void LinePass::Draw(const scene::DisplayList& list) {
  glEnable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_FALSE);
  if (list.clip && list.clip->grid) DrawClipGrid(list);
  for (const bool in_front : {false, true}) {
    triangles_.Clear();
    for (const scene::DrawnLine& line : list.lines) {
      if (line.always_in_front == in_front) AddLine(list, line);
    }
    if (in_front) glDisable(GL_DEPTH_TEST);
    DrawLines(list);
  }
  glDepthMask(GL_TRUE);
  glDisable(GL_BLEND);
}

}  // namespace plumbline::display
