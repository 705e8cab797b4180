#include "drivers/display/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace plumbline::display {
namespace {

constexpr float kEmpty = 0.13F;  ///< grey level without an image

constexpr const char* kBackgroundFragment = R"(
uniform vec4 u_pinhole;    // 1/fx, 1/fy, -(cx + 1/2)/fx, -(cy + 1/2)/fy
uniform vec4 u_image;      // fx/width, fy/height, (cx + 1/2)/width, (cy + 1/2)/height
uniform vec3 u_radial;     // k1, k2, k3
uniform vec3 u_below;      // k4, k5, k6
uniform vec2 u_tangential; // p1, p2
uniform vec4 u_prism;      // s1, s2, s3, s4
uniform bool u_fisheye;    // k1..k4 are those of a fisheye
uniform float u_r2_max;
uniform float u_empty;
uniform sampler2D u_pixels;
out vec4 colour;
void main() {
  vec2 n = gl_FragCoord.xy * u_pinhole.xy + u_pinhole.zw;
  float r2 = dot(n, n);
  float radial = 1.0 + r2 * (u_radial.x + r2 * (u_radial.y + r2 * u_radial.z));
  radial /= 1.0 + r2 * (u_below.x + r2 * (u_below.y + r2 * u_below.z));
  if (u_fisheye && r2 > 1e-8) {
    float r = sqrt(r2), theta = atan(r), t2 = theta * theta;
    float bent = u_radial.y + t2 * (u_radial.z + t2 * u_below.x);
    radial = theta / r * (1.0 + t2 * (u_radial.x + t2 * bent));
  }
  vec2 d = n * (radial + 2.0 * dot(u_tangential.yx, n)) + u_tangential.yx * r2 +
           r2 * (u_prism.xz + r2 * u_prism.yw);
  vec2 at = d * u_image.xy + u_image.zw;
  vec2 inside = step(abs(at - 0.5), vec2(0.5)) * step(r2, u_r2_max);
  colour = vec4(mix(vec3(u_empty), texture(u_pixels, at).rgb, inside.x * inside.y), 1.0);
}
)";

/// Lens that scales an image without a lens to fit into the picture.
lens::Lens FittingLens(image::ImageSize image, const lens::Lens& pinhole,
                       image::ImageSize picture) {
  const double scale = std::min(static_cast<double>(picture.width) / image.width,
                                static_cast<double>(picture.height) / image.height);
  // Picture pixel u sees image pixel (u - (W - 1)/2) / scale + (w - 1)/2.
  lens::Lens lens;
  lens.fx = pinhole.fx / scale;
  lens.fy = pinhole.fy / scale;
  lens.cx = (pinhole.cx - (picture.width - 1) / 2.0) / scale + (image.width - 1) / 2.0;
  lens.cy = (pinhole.cy - (picture.height - 1) / 2.0) / scale + (image.height - 1) / 2.0;
  return lens;
}

}  // namespace

double LargestRadiusSquared(const lens::Lens& lens) {
  constexpr double kMost = 100, kStep = 1.002;
  lens::Lens radial = lens;  // without the terms that depend on the direction
  radial.fx = radial.fy = 1;
  radial.cx = radial.cy = radial.p1 = radial.p2 = 0;
  radial.s1 = radial.s2 = radial.s3 = radial.s4 = 0;
  double r2 = 1e-3;
  while (r2 < kMost) {
    // d (r c(r)) / dr; along x the Jacobian is diagonal.
    if (lens::PixelJacobian(radial, {std::sqrt(r2), 0})(0, 0) <= 0) return r2 / kStep;
    r2 *= kStep;
  }
  return kMost;
}

Result<BackgroundPass> BackgroundPass::Create() {
  auto program = GlProgram::Build(kWholePictureVertex, kBackgroundFragment);
  if (!program) return program.failure();
  BackgroundPass pass;
  pass.program_ = std::move(program).value();
  return pass;
}

void BackgroundPass::Load(const scene::Background& background, Image& image) {
  const image::LumaView& luma = background.luma;
  const bool colour = background.bgr != nullptr;
  const bool fits = luma.size() == image.size && colour == image.colour;
  if (fits && image.sequence == background.sequence) return;
  glBindTexture(GL_TEXTURE_2D, *image.texture);
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glPixelStorei(GL_UNPACK_ROW_LENGTH, colour ? 0 : static_cast<GLint>(luma.stride));
  const GLenum format = colour ? GL_RGB : GL_RED;
  const void* pixels = colour ? background.bgr : luma.data;
  if (fits) {
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, luma.width, luma.height, format, GL_UNSIGNED_BYTE,
                    pixels);
  } else {
    glTexImage2D(GL_TEXTURE_2D, 0, colour ? GL_RGB8 : GL_R8, luma.width, luma.height, 0, format,
                 GL_UNSIGNED_BYTE, pixels);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_R, colour ? GL_BLUE : GL_RED);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_G, colour ? GL_GREEN : GL_RED);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_SWIZZLE_B, GL_RED);
  }
  glPixelStorei(GL_UNPACK_ROW_LENGTH, 0);
  image.size = luma.size();
  image.colour = colour;
  image.sequence = background.sequence;
}

Result<void> BackgroundPass::Draw(const scene::Background& background, const lens::Lens& pinhole,
                                  image::ImageSize size, std::size_t view) {
  glClearColor(kEmpty, kEmpty, kEmpty, 1);
  glClear(GL_COLOR_BUFFER_BIT);
  const image::LumaView& luma = background.luma;
  if (luma.data == nullptr) return {};
  GLint most = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &most);
  if (luma.width < 1 || luma.height < 1 || luma.width > most || luma.height > most ||
      luma.stride < luma.width) {
    return Error{"the camera image has a size that cannot be drawn"};
  }
  const lens::Lens lens = background.lens.value_or(FittingLens(luma.size(), pinhole, size));
  if (images_.size() <= view) images_.resize(view + 1);
  Load(background, images_[view]);
  const auto f = [](double value) { return static_cast<GLfloat>(value); };
  program_.Use();
  glUniform4f(program_.UniformLocation("u_pinhole"), f(1 / pinhole.fx), f(1 / pinhole.fy),
              f(-(pinhole.cx + 0.5) / pinhole.fx), f(-(pinhole.cy + 0.5) / pinhole.fy));
  glUniform4f(program_.UniformLocation("u_image"), f(lens.fx / luma.width),
              f(lens.fy / luma.height), f((lens.cx + 0.5) / luma.width),
              f((lens.cy + 0.5) / luma.height));
  glUniform3f(program_.UniformLocation("u_radial"), f(lens.k1), f(lens.k2), f(lens.k3));
  glUniform3f(program_.UniformLocation("u_below"), f(lens.k4), f(lens.k5), f(lens.k6));
  glUniform2f(program_.UniformLocation("u_tangential"), f(lens.p1), f(lens.p2));
  glUniform4f(program_.UniformLocation("u_prism"), f(lens.s1), f(lens.s2), f(lens.s3), f(lens.s4));
  glUniform1i(program_.UniformLocation("u_fisheye"), lens.fisheye ? 1 : 0);
  glUniform1f(program_.UniformLocation("u_r2_max"), f(LargestRadiusSquared(lens)));
  glUniform1f(program_.UniformLocation("u_empty"), kEmpty);
  glUniform1i(program_.UniformLocation("u_pixels"), 0);
  glBindTexture(GL_TEXTURE_2D, *images_[view].texture);
  glBindVertexArray(*empty_array_);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  return {};
}

namespace {

constexpr int kMaxPicture_px = 8192;

}  // namespace

Renderer::Renderer(GlContext& context, BackgroundPass background, MeshPass meshes, LinePass lines,
                   FlatPass flat)
    : context_(context),
      background_(std::move(background)),
      meshes_(std::move(meshes)),
      lines_(std::move(lines)),
      flat_(std::move(flat)) {}

Result<std::unique_ptr<Renderer>> Renderer::Create(GlContext& context,
                                                   const RendererOptions& options) {
  glActiveTexture(GL_TEXTURE0);
  auto background = BackgroundPass::Create();
  if (!background) return background.failure();
  auto meshes = MeshPass::Create();
  if (!meshes) return meshes.failure();
  auto lines = LinePass::Create();
  if (!lines) return lines.failure();
  auto font = Font::Open(options.font_paths);
  const std::string no_font = font ? "" : font.error();
  auto flat = FlatPass::Create(font ? std::optional<Font>(std::move(font).value()) : std::nullopt);
  if (!flat) return flat.failure();
  std::unique_ptr<Renderer> renderer(
      new Renderer(context, std::move(background).value(), std::move(meshes).value(),
                   std::move(lines).value(), std::move(flat).value()));
  if (!no_font.empty()) renderer->Remark(no_font);
  if (const std::string problem = GlProblem(); !problem.empty()) return Error{problem};
  return renderer;
}

std::string Renderer::CheckList(const scene::DisplayList& list) const {
  const auto& [width, height] = list.size;
  if (width < 1 || height < 1 || width > kMaxPicture_px || height > kMaxPicture_px) {
    return fmt::format("a picture of {} x {} pixels cannot be drawn", width, height);
  }
  const lens::Lens& pinhole = list.pinhole;
  if (!(pinhole.fx > 0) || !(pinhole.fy > 0) || !std::isfinite(pinhole.fx + pinhole.fy) ||
      !std::isfinite(pinhole.cx + pinhole.cy)) {
    return "the focal length of the picture is not positive";
  }
  return "";
}

bool Renderer::Resize(image::ImageSize size) {
  if (size == size_) return true;
  glBindRenderbuffer(GL_RENDERBUFFER, *colour_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, size.width, size.height);
  glBindRenderbuffer(GL_RENDERBUFFER, *depth_);
  glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, size.width, size.height);
  glBindFramebuffer(GL_FRAMEBUFFER, *framebuffer_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, *colour_);
  glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, *depth_);
  const bool complete = glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  size_ = complete ? size : image::ImageSize{};
  return complete;
}

/// Draws one camera view into its area. @param index  of the view in the picture
void Renderer::DrawView(const scene::DisplayList& view, std::size_t index) {
  if (view.area) {
    const auto pixel = [](float edge) { return static_cast<GLint>(std::lround(edge)); };
    glEnable(GL_SCISSOR_TEST);
    glScissor(pixel(view.area->x), pixel(view.area->y), pixel(view.area->width),
              pixel(view.area->height));
  }
  glDepthMask(GL_TRUE);
  glClear(GL_DEPTH_BUFFER_BIT);
  const auto drawn = background_.Draw(view.background, view.pinhole, view.size, index);
  if (!drawn) Remark(drawn.error());
  lines_.DrawGround(view);
  for (const scene::DrawnMesh& mesh : view.meshes) {
    if (!meshes_.Knows(mesh.mesh)) Remark(fmt::format("mesh {} is not loaded", mesh.mesh));
  }
  meshes_.Draw(view);
  lines_.Draw(view);
  glDisable(GL_SCISSOR_TEST);
}

DrawResult Renderer::Draw(const scene::DisplayList& list) {
  problem_ = CheckList(list);
  for (const scene::DisplayList& view : list.beside) {
    if (problem_.empty())
      problem_ =
          view.size == list.size ? CheckList(view) : "the views of the picture differ in size";
  }
  if (!problem_.empty()) return DrawResult::kRefused;
  if (!Resize(list.size)) problem_ = "OpenGL cannot allocate the picture";
  if (problem_.empty()) {
    glBindFramebuffer(GL_FRAMEBUFFER, *framebuffer_);
    glViewport(0, 0, size_.width, size_.height);
    glDisable(GL_CULL_FACE);
    glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    glClearColor(0, 0, 0, 1);
    if (list.area) glClear(GL_COLOR_BUFFER_BIT);
    DrawView(list, 0);
    for (std::size_t k = 0; k < list.beside.size(); ++k) DrawView(list.beside[k], k + 1);
    flat_.Draw(list);
    problem_ = GlProblem();
  }
  if (context_.Lost()) {
    problem_ = "the GPU was reset and lost its contents";
    return DrawResult::kContextLost;
  }
  return problem_.empty() ? DrawResult::kDrawn : DrawResult::kRefused;
}

PictureView Renderer::ReadRows(int first, int count) {
  pixels_.resize(std::size_t{4} * static_cast<std::size_t>(size_.width) *
                 static_cast<std::size_t>(count));
  glBindFramebuffer(GL_FRAMEBUFFER, *framebuffer_);
  glPixelStorei(GL_PACK_ALIGNMENT, 4);
  glReadPixels(0, first, size_.width, count, GL_RGBA, GL_UNSIGNED_BYTE, pixels_.data());
  return {pixels_.data(), {size_.width, count}};
}

RgbImage Renderer::ReadBack() {
  const auto pixels = [](image::ImageSize size) {
    return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  };
  RgbImage image{.rgb = std::vector<std::uint8_t>(3 * pixels(size_)), .size = size_};
  std::uint8_t* to = image.rgb.data();
  ReadInStrips(*this, [&](int, const PictureView& rows) {
    for (std::size_t i = 0; i < pixels(rows.size); ++i, to += 3) {
      std::copy_n(rows.rgbx + 4 * i, 3, to);
    }
  });
  return image;
}

std::vector<Vec3f> Renderer::TransformedVertices(const scene::DisplayList& list,
                                                 const scene::DrawnMesh& drawn) {
  if (!CheckList(list).empty() || !Resize(list.size)) return {};
  glBindFramebuffer(GL_FRAMEBUFFER, *framebuffer_);  // without a framebuffer OpenGL draws nothing
  return meshes_.TransformedVertices(list, drawn);
}

void Renderer::Remark(const std::string& remark) {
  constexpr std::size_t kMaxRemarks = 100;
  if (reported_.size() >= kMaxRemarks ||
      std::find(reported_.begin(), reported_.end(), remark) != reported_.end()) {
    return;
  }
  reported_.push_back(remark);
  remarks_.push_back(remark);
}

std::vector<std::string> Renderer::TakeRemarks() {
  return std::exchange(remarks_, {});
}

}  // namespace plumbline::display
