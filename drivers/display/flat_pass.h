// Boxes and text over the picture.
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

namespace plumbline {

/// Letters lie in an atlas that takes each one, in each size, when it is first drawn. It grows from
/// 256 to 2048 pixels of width; a picture with more letters than fit lacks the rest, and the next
/// picture starts with an empty one.
class FlatPass {
 public:
  /// @param font  nothing: boxes only
  static Result<FlatPass> Create(std::optional<Font> font);

  void Draw(const DisplayList& list);

  /// How far the pen goes [px]; 0 without a font.
  float TextWidth(const std::string& text, float height_px);
  int atlas_width_px() const { return atlas_width_; }

 private:
  struct Vertex {
    float x, y;  ///< of pixel edges: 0 is the left or upper edge of the picture
    float s, t;  ///< in the atlas [px]
    float r, g, b, a;
  };
  struct Placed {
    Glyph glyph;  ///< without its bitmap
    int s = 0, t = 0;
  };

  const Placed* Find(char32_t letter, int size_px);
  bool MakeRoom(int width, int height);
  void ClearAtlas(int width);
  void AddRectangle(float x, float y, float width, float height, float s, float t, bool glyph,
                    const Colour& colour);
  void AddText(const DrawnText& text);
  void Upload();

  std::optional<Font> font_;
  GlProgram program_;
  GlVertexArray array_;
  GlBuffer buffer_;
  GlTexture texture_;
  std::vector<Vertex> vertices_;
  std::vector<std::uint8_t> atlas_;  ///< coverages; its texel (0, 0) is full, for boxes
  std::map<std::pair<char32_t, int>, Placed> placed_;
  int atlas_width_ = 0;  ///< and height
  int shelf_s_ = 0, shelf_t_ = 0, shelf_height_ = 0;
  bool changed_ = false, full_ = false;
};

}  // namespace plumbline
