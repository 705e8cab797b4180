#include "drivers/display/flat_pass.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace plumbline::display {
namespace {

constexpr int kInitialAtlas_px = 256, kMaxAtlas_px = 2048;

constexpr const char* kFlatVertex = R"(
layout(location = 0) in vec2 a_position;
layout(location = 1) in vec2 a_texel;
layout(location = 2) in vec4 a_colour;
uniform vec2 u_size;
uniform float u_atlas;
out vec2 texel;
out vec4 flat_colour;
void main() {
  gl_Position = vec4(2.0 * a_position / u_size - 1.0, 0.0, 1.0);
  texel = a_texel / u_atlas;
  flat_colour = a_colour;
}
)";

constexpr const char* kFlatFragment = R"(
in vec2 texel;
in vec4 flat_colour;
uniform sampler2D u_glyphs;
out vec4 colour;
void main() {
  colour = vec4(flat_colour.rgb, flat_colour.a * texture(u_glyphs, texel).r);
}
)";

int WholeSize(float height_px) {
  if (!(height_px > 0)) return Font::kMinSize_px;
  return static_cast<int>(std::lround(std::min(height_px, float{Font::kMaxSize_px})));
}

}  // namespace

Result<FlatPass> FlatPass::Create(std::optional<Font> font) {
  auto program = GlProgram::Build(kFlatVertex, kFlatFragment);
  if (!program) return program.failure();
  FlatPass pass;
  pass.program_ = std::move(program).value();
  pass.font_ = std::move(font);
  pass.triangles_.Describe(
      {{2, offsetof(Vertex, x)}, {2, offsetof(Vertex, s)}, {4, offsetof(Vertex, r)}});
  pass.ClearAtlas(kInitialAtlas_px);
  return pass;
}

void FlatPass::ClearAtlas(int width) {
  atlas_width_ = width;
  atlas_.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(width), 0);
  entries_.clear();
  for (const std::size_t row : {0U, 1U}) {
    for (const std::size_t column : {0U, 1U}) {
      atlas_[row * static_cast<std::size_t>(width) + column] = 255;
    }
  }
  shelf_s_ = 3;
  shelf_t_ = 0;
  shelf_height_ = 3;
  changed_ = true;
  full_ = false;
}

/// Makes room for a glyph and a one-pixel margin at (shelf_s_, shelf_t_). Returns false if the
/// atlas is full.
bool FlatPass::MakeRoom(int width, int height) {
  if (shelf_s_ + width + 1 > atlas_width_) {
    shelf_t_ += shelf_height_;
    shelf_s_ = shelf_height_ = 0;
  }
  if (shelf_t_ + height + 1 > atlas_width_) {
    if (2 * atlas_width_ > kMaxAtlas_px) return false;
    // Existing glyphs keep their coordinates: the new room is to the right and below.
    const int old_width = atlas_width_;
    std::vector<std::uint8_t> old = std::move(atlas_);
    atlas_width_ = 2 * old_width;
    atlas_.assign(static_cast<std::size_t>(atlas_width_) * static_cast<std::size_t>(atlas_width_),
                  0);
    for (int row = 0; row < old_width; ++row) {
      std::copy_n(old.begin() + std::ptrdiff_t{row} * old_width, old_width,
                  atlas_.begin() + std::ptrdiff_t{row} * atlas_width_);
    }
    changed_ = true;
    return MakeRoom(width, height);
  }
  return width + 1 <= atlas_width_;
}

const FlatPass::AtlasEntry* FlatPass::Find(char32_t code_point, int size_px) {
  const auto key = std::pair(code_point, size_px);
  if (const auto known = entries_.find(key); known != entries_.end()) return &known->second;
  auto glyph = font_ && !full_ ? font_->Rasterise(code_point, size_px) : std::nullopt;
  if (!glyph) return nullptr;
  if (!MakeRoom(glyph->width, glyph->height)) {
    full_ = true;
    return nullptr;
  }
  AtlasEntry placed{.glyph = {}, .s = shelf_s_, .t = shelf_t_};
  for (int row = 0; row < glyph->height; ++row) {
    std::copy_n(glyph->coverage.begin() + std::ptrdiff_t{row} * glyph->width, glyph->width,
                atlas_.begin() + std::ptrdiff_t{shelf_t_ + row} * atlas_width_ + shelf_s_);
  }
  shelf_s_ += glyph->width + 1;
  shelf_height_ = std::max(shelf_height_, glyph->height + 1);
  changed_ = changed_ || glyph->width > 0;
  glyph->coverage.clear();
  placed.glyph = *std::move(glyph);
  return &entries_.emplace(key, std::move(placed)).first->second;
}

void FlatPass::AddRectangle(float x, float y, float width, float height, float s, float t,
                            bool glyph, const scene::Colour& colour) {
  const float ds = glyph ? width : 0, dt = glyph ? height : 0;
  const auto corner = [&](float right, float down) {
    triangles_.Add({x + right * width, y + down * height, s + right * ds, t + down * dt, colour.r,
                    colour.g, colour.b, colour.a});
  };
  corner(0, 0);
  corner(1, 0);
  corner(1, 1);
  corner(0, 0);
  corner(1, 1);
  corner(0, 1);
}

/// Each segment is a bar whose long edges fade over one pixel, so that it looks smooth.
void FlatPass::AddStroke(const scene::DrawnStroke& stroke) {
  const float inner = std::max(0.0F, stroke.width_px / 2 - 0.5F), outer = inner + 1;
  for (std::size_t k = 1; k < stroke.points.size(); ++k) {
    const scene::PicturePoint& a = stroke.points[k - 1];
    const scene::PicturePoint& b = stroke.points[k];
    const float length = std::hypot(b.x - a.x, b.y - a.y);
    if (!(length > 0) || !std::isfinite(length)) continue;
    const float nx = (a.y - b.y) / length, ny = (b.x - a.x) / length;
    const auto corner = [&](const scene::PicturePoint& at, float off, float opacity) {
      const scene::Colour& c = stroke.colour;
      triangles_.Add({at.x + off * nx, at.y + off * ny, 1, 1, c.r, c.g, c.b, opacity * c.a});
    };
    const auto bar = [&](float from, float from_opacity, float to, float to_opacity) {
      corner(a, from, from_opacity);
      corner(b, from, from_opacity);
      corner(b, to, to_opacity);
      corner(a, from, from_opacity);
      corner(b, to, to_opacity);
      corner(a, to, to_opacity);
    };
    bar(-outer, 0, -inner, 1);
    bar(-inner, 1, inner, 1);
    bar(inner, 1, outer, 0);
  }
  if (!stroke.filled) return;
  const auto corner = [&](const scene::PicturePoint& at) {
    const scene::Colour& c = stroke.colour;
    triangles_.Add({at.x, at.y, 1, 1, c.r, c.g, c.b, c.a});
  };
  for (std::size_t k = 2; k < stroke.points.size(); ++k) {
    corner(stroke.points[0]);
    corner(stroke.points[k - 1]);
    corner(stroke.points[k]);
  }
}

void FlatPass::AddText(const scene::DrawnText& text) {
  if (!std::isfinite(text.x) || !std::isfinite(text.y)) return;
  const int size_px = WholeSize(text.height_px);
  float pen = std::round(text.x);
  const float base = std::round(text.y);
  for (const char32_t code_point : CodePointsFromUtf8(text.text)) {
    if (code_point < U' ') continue;
    const AtlasEntry* placed = Find(code_point, size_px);
    if (placed == nullptr) continue;
    const Glyph& glyph = placed->glyph;
    if (glyph.width > 0) {
      AddRectangle(pen + static_cast<float>(glyph.left), base - static_cast<float>(glyph.top),
                   static_cast<float>(glyph.width), static_cast<float>(glyph.height),
                   static_cast<float>(placed->s), static_cast<float>(placed->t), true, text.colour);
    }
    pen += static_cast<float>(glyph.advance);
  }
}

float FlatPass::TextWidth(const std::string& text, float height_px) {
  int width = 0;
  for (const char32_t code_point : CodePointsFromUtf8(text)) {
    if (code_point < U' ') continue;
    const int size_px = WholeSize(height_px);
    if (const AtlasEntry* placed = Find(code_point, size_px)) {
      width += placed->glyph.advance;
    } else if (const auto glyph = font_ ? font_->Rasterise(code_point, size_px) : std::nullopt) {
      width += glyph->advance;  // the atlas is full; it is cleared before the next drawing
    }
  }
  return static_cast<float>(width);
}

void FlatPass::Upload() {
  glActiveTexture(GL_TEXTURE0);
  glBindTexture(GL_TEXTURE_2D, *texture_);
  if (!changed_) return;
  glPixelStorei(GL_UNPACK_ALIGNMENT, 1);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R8, atlas_width_, atlas_width_, 0, GL_RED, GL_UNSIGNED_BYTE,
               atlas_.data());
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  changed_ = false;
}

namespace {

/// Fills a box by clearing it, which is much faster than drawing it: the pixels whose centre is
/// inside.
void ClearBox(const scene::DrawnBox& box) {
  const auto first = [](float edge) { return static_cast<GLint>(std::ceil(edge - 0.5F)); };
  const GLint left = first(box.x), top = first(box.y);
  const GLint width = first(box.x + box.width) - left, height = first(box.y + box.height) - top;
  if (width <= 0 || height <= 0) return;
  glScissor(left, top, width, height);
  glClearColor(box.colour.r, box.colour.g, box.colour.b, 1);
  glClear(GL_COLOR_BUFFER_BIT);
}

}  // namespace

/// Clears large opaque boxes that no earlier box shines through, and adds the others.
void FlatPass::AddBoxes(const scene::DisplayList& list) {
  constexpr float kLarge_px2 = 4096, kMost_px = 1e5F;
  std::vector<const scene::DrawnBox*> added;
  const auto overlap = [](const scene::DrawnBox& a, const scene::DrawnBox& b) {
    return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height &&
           b.y < a.y + a.height;
  };
  glEnable(GL_SCISSOR_TEST);
  for (const scene::DrawnBox& box : list.boxes) {
    const bool sound = std::abs(box.x) + std::abs(box.y) + box.width + box.height < kMost_px;
    const bool clear = sound && box.colour.a == 1 && box.width * box.height >= kLarge_px2 &&
                       std::none_of(added.begin(), added.end(),
                                    [&](const scene::DrawnBox* one) { return overlap(*one, box); });
    if (clear) {
      ClearBox(box);
    } else {
      added.push_back(&box);
      AddRectangle(box.x, box.y, box.width, box.height, 1, 1, false, box.colour);
    }
  }
  glDisable(GL_SCISSOR_TEST);
}

void FlatPass::Draw(const scene::DisplayList& list) {
  if (full_) ClearAtlas(atlas_width_);
  triangles_.Clear();
  AddBoxes(list);
  for (const scene::DrawnStroke& stroke : list.strokes) AddStroke(stroke);
  for (const scene::DrawnText& text : list.texts) AddText(text);
  if (triangles_.empty()) return;
  Upload();
  program_.Use();
  glUniform2f(program_.UniformLocation("u_size"), static_cast<float>(list.size.width),
              static_cast<float>(list.size.height));
  glUniform1f(program_.UniformLocation("u_atlas"), static_cast<float>(atlas_width_));
  glUniform1i(program_.UniformLocation("u_glyphs"), 0);
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  triangles_.Draw();
  glDisable(GL_BLEND);
}

}  // namespace plumbline::display
