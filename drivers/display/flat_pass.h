// Render pass for 2D boxes, strokes and text on top of the picture.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drivers/display/font.h"
#include "drivers/display/gl_objects.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

/// Glyphs are cached in an atlas texture when they are first drawn at a given size. The atlas grows
/// from 256 to 2048 pixels of width; if it is full, the remaining glyphs of that picture are
/// missing and the next picture starts with an empty atlas.
class FlatPass {
 public:
  /// @param font  if nullopt, only boxes and strokes are drawn
  static Result<FlatPass> Create(std::optional<Font> font);

  void Draw(const scene::DisplayList& list);

  /// Advance width of a text [px]; 0 without a font.
  float TextWidth(const std::string& text, float height_px);

 private:
  struct Vertex {
    float x, y;  ///< pixel edges: 0 is the left or top edge of the picture
    float s, t;  ///< atlas coordinates [px]
    float r, g, b, a;
  };
  struct AtlasEntry {
    Glyph glyph;  ///< without bitmap
    int s = 0, t = 0;
  };

  const AtlasEntry* Find(char32_t code_point, int size_px);
  bool MakeRoom(int width, int height);
  void ClearAtlas(int width);
  void AddRectangle(float x, float y, float width, float height, float s, float t, bool glyph,
                    const scene::Colour& colour);
  void AddBoxes(const scene::DisplayList& list);
  void AddStroke(const scene::DrawnStroke& stroke);
  void AddText(const scene::DrawnText& text);
  void Upload();

  std::optional<Font> font_;
  GlProgram program_;
  TriangleStream<Vertex> triangles_;
  GlTexture texture_;
  std::vector<std::uint8_t> atlas_;  ///< coverage; texel (0, 0) is fully covered, for boxes
  std::map<std::pair<char32_t, int>, AtlasEntry> entries_;
  int atlas_width_ = 0;  ///< also the height
  int shelf_s_ = 0, shelf_t_ = 0, shelf_height_ = 0;
  bool changed_ = false, full_ = false;
};

}  // namespace plumbline::display
