// Writer of boxes, strokes and fitted texts into a display list.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "app/display/view/picture_layout.h"
#include "app/display/view/state_strip.h"

namespace plumbline::display {

/// Everything is in pixels of the picture. A text is shortened to its width.
class PictureWriter {
 public:
  PictureWriter(const PictureLayout& layout, TextWidth text_width, scene::DisplayList& list)
      : layout_(layout), text_width_(std::move(text_width)), list_(list) {}

  void Box(const scene::Area& area, const scene::Colour& colour);
  /// Four edges inside the area.
  void Frame(const scene::Area& area, float width, const scene::Colour& colour);
  void Stroke(std::vector<scene::PicturePoint> points, const scene::Colour& colour, float width);
  void Circle(scene::PicturePoint centre, float radius, const scene::Colour& colour, float width);
  /// Filled. @param points  closed and convex
  void Polygon(std::vector<scene::PicturePoint> points, const scene::Colour& colour);
  void Disc(scene::PicturePoint centre, float radius, const scene::Colour& colour);
  /// Plus-shaped.
  void Cross(scene::PicturePoint centre, float arm, const scene::Colour& colour, float width);

  /// One line of text. @param y  upper edge; the line is 1.3 em high
  void Text(float x, float y, float width, float em, const std::string& text,
            const scene::Colour& colour);
  void TextAtRight(float right, float y, float width, float em, const std::string& text,
                   const scene::Colour& colour);
  /// A line of details with the glyph of its tone in front if it is abnormal.
  void Line(float x, float y, float width, const PanelLine& line);

  /// The largest size up to `em` at which the text fits, not below that of details.
  float FittingEm(const std::string& text, float em, float width) const;
  float WidthOf(const std::string& text, float em) const { return text_width_(text, em); }
  std::string Shortened(const std::string& text, float em, float width) const {
    return Elided(text, em, width, text_width_);
  }
  std::vector<std::string> Rows(const std::string& text, float em, float width) const {
    return Wrapped(text, em, width, text_width_);
  }
  const PictureLayout& layout() const { return layout_; }

 private:
  const PictureLayout& layout_;
  const TextWidth text_width_;
  scene::DisplayList& list_;
};

/// The text with the glyph of its tone in front if it is abnormal and not an instruction ("→ ...").
std::string MarkedText(const PanelLine& line);

}  // namespace plumbline::display
