#include "app/display/view/picture_writer.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "app/display/view/palette.h"

namespace plumbline::display {

namespace {

/// Closed polygon with sides of about three pixels.
std::vector<scene::PicturePoint> CornersOfCircle(scene::PicturePoint centre, float radius) {
  const auto corners = static_cast<int>(std::clamp(2.1F * radius, 12.0F, 96.0F));
  std::vector<scene::PicturePoint> points;
  points.reserve(static_cast<std::size_t>(corners) + 1);
  for (int k = 0; k <= corners; ++k) {
    const auto angle = static_cast<float>(2 * std::numbers::pi * k / corners);
    points.push_back({centre.x + radius * std::cos(angle), centre.y + radius * std::sin(angle)});
  }
  return points;
}

}  // namespace

std::string MarkedText(const PanelLine& line) {
  const StateClass state = ClassOf(line.tone);
  const bool plain = state == StateClass::kHealthy || state == StateClass::kAdvisory;
  const bool marked = line.text.starts_with("→");  // an instruction
  return plain || marked ? line.text : std::string(MarkOf(state).glyph) + " " + line.text;
}

void PictureWriter::Box(const scene::Area& area, const scene::Colour& colour) {
  list_.boxes.push_back({area.x, area.y, area.width, area.height, colour});
}

void PictureWriter::Frame(const scene::Area& area, float width, const scene::Colour& colour) {
  Box({area.x, area.y, area.width, width}, colour);
  Box({area.x, area.bottom() - width, area.width, width}, colour);
  Box({area.x, area.y + width, width, area.height - 2 * width}, colour);
  Box({area.right() - width, area.y + width, width, area.height - 2 * width}, colour);
}

void PictureWriter::Stroke(std::vector<scene::PicturePoint> points, const scene::Colour& colour,
                           float width) {
  list_.strokes.push_back({std::move(points), colour, width, false});
}

void PictureWriter::Circle(scene::PicturePoint centre, float radius, const scene::Colour& colour,
                           float width) {
  Stroke(CornersOfCircle(centre, radius), colour, width);
}

void PictureWriter::Polygon(std::vector<scene::PicturePoint> points, const scene::Colour& colour) {
  list_.strokes.push_back({std::move(points), colour, 1, true});
}

void PictureWriter::Disc(scene::PicturePoint centre, float radius, const scene::Colour& colour) {
  Polygon(CornersOfCircle(centre, radius), colour);
}

void PictureWriter::Cross(scene::PicturePoint centre, float arm, const scene::Colour& colour,
                          float width) {
  Stroke({{centre.x - arm, centre.y}, {centre.x + arm, centre.y}}, colour, width);
  Stroke({{centre.x, centre.y - arm}, {centre.x, centre.y + arm}}, colour, width);
}

float PictureWriter::FittingEm(const std::string& text, float em, float width) const {
  // In proportion: each size that is measured takes room in the renderer's glyph atlas.
  const float taken = WidthOf(text, em);
  if (taken > width) em = std::max(layout_.em, std::floor(em * width / taken));
  while (em > layout_.em && WidthOf(text, em) > width) em -= 1;
  return em;
}

void PictureWriter::Text(float x, float y, float width, float em, const std::string& text,
                         const scene::Colour& colour) {
  const std::string fitted = Elided(text, em, width, text_width_);
  if (fitted.empty()) return;
  list_.texts.push_back({x, y + em, em, colour, fitted});
}

void PictureWriter::TextAtRight(float right, float y, float width, float em,
                                const std::string& text, const scene::Colour& colour) {
  const std::string fitted = Elided(text, em, width, text_width_);
  if (!fitted.empty()) Text(right - WidthOf(fitted, em), y, width, em, fitted, colour);
}

void PictureWriter::Line(float x, float y, float width, const PanelLine& line) {
  Text(x, y, width, layout_.em, MarkedText(line), palette::OfTone(line.tone));
}

}  // namespace plumbline::display
