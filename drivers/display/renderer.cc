#include "drivers/display/renderer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

namespace plumbline::display {
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
