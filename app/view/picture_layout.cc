#include "app/view/picture_layout.h"

#include <algorithm>
#include <cmath>

namespace plumbline::view {
namespace {

constexpr float kLinesOfText = 38, kSmallestText_px = 12;
constexpr float kColumn_em = 22, kMostColumn = 0.42F;
constexpr int kMessages = 4;

/// Largest scale at which the whole image fits the area.
double ScaleIn(const scene::Area& area, image::ImageSize image) {
  return std::min(static_cast<double>(area.width) / image.width,
                  static_cast<double>(area.height) / image.height);
}

bool StartsCharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
}

}  // namespace

PictureLayout LayoutOf(image::ImageSize size) {
  PictureLayout layout;
  layout.size = size;
  const auto width = static_cast<float>(size.width), height = static_cast<float>(size.height);
  layout.em = std::max(kSmallestText_px, std::round(height / kLinesOfText));
  const float top = std::round(2.0F * layout.em);
  const float messages = std::round(kMessages * layout.line() + 0.6F * layout.em);
  const float column = std::round(std::min(kColumn_em * layout.em, kMostColumn * width));
  layout.top = {0, 0, width, top};
  layout.messages = {0, height - messages, width, messages};
  layout.image = {0, top, width - column, height - top - messages};
  layout.column = {width - column, top, column, height - top - messages};
  return layout;
}

std::vector<scene::Area> SplitArea(const scene::Area& area, std::size_t count,
                                   image::ImageSize image, float gap) {
  const auto n = static_cast<float>(count);
  scene::Area beside = area, below = area;
  beside.width = (area.width - (n - 1) * gap) / n;
  below.height = (area.height - (n - 1) * gap) / n;
  const bool stacked = ScaleIn(below, image) > ScaleIn(beside, image);
  std::vector<scene::Area> parts(count, stacked ? below : beside);
  for (std::size_t k = 0; k < count; ++k) {
    const auto before = static_cast<float>(k);
    if (stacked) parts[k].y += before * (below.height + gap);
    if (!stacked) parts[k].x += before * (beside.width + gap);
  }
  return parts;
}

lens::Lens PinholeIn(const scene::Area& area, const lens::Lens& lens, image::ImageSize image) {
  const double s = ScaleIn(area, image);
  const double left =
      static_cast<double>(area.x) + (static_cast<double>(area.width) - s * image.width) / 2;
  const double upper =
      static_cast<double>(area.y) + (static_cast<double>(area.height) - s * image.height) / 2;
  lens::Lens pinhole;
  pinhole.fx = s * lens.fx;
  pinhole.fy = s * lens.fy;
  pinhole.cx = s * (lens.cx + 0.5) + left - 0.5;
  pinhole.cy = s * (lens.cy + 0.5) + upper - 0.5;
  return pinhole;
}

lens::Lens PlainLens(image::ImageSize image) {
  lens::Lens lens;
  lens.fx = lens.fy = image.width;
  lens.cx = (image.width - 1) / 2.0;
  lens.cy = (image.height - 1) / 2.0;
  return lens;
}

std::string Elided(const std::string& text, float height_px, float width_px,
                   const TextWidth& text_width) {
  if (text_width(text, height_px) <= width_px) return text;
  static const std::string kEllipsis = "…";
  std::size_t fits = 0, beyond = text.size();  // bytes; the first fits, the second does not
  if (text_width(kEllipsis, height_px) > width_px) return "";
  while (beyond - fits > 1) {
    const std::size_t middle = fits + (beyond - fits) / 2;
    (text_width(text.substr(0, middle) + kEllipsis, height_px) <= width_px ? fits : beyond) =
        middle;
  }
  while (fits > 0 && !StartsCharacter(text[fits])) --fits;
  while (fits > 0 && text[fits - 1] == ' ') --fits;
  return text.substr(0, fits) + kEllipsis;
}

std::vector<std::string> Wrapped(const std::string& text, float height_px, float width_px,
                                 const TextWidth& text_width) {
  std::vector<std::string> lines;
  std::string line;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t to = std::min(text.find(' ', from), text.size());
    const std::string word = text.substr(from, to - from);
    std::string longer = line;
    if (!line.empty()) longer += ' ';
    longer += word;
    if (!line.empty() && text_width(longer, height_px) > width_px) {
      lines.push_back(line);
      line = word;
    } else {
      line = longer;
    }
    from = to + 1;
  }
  lines.push_back(line);
  return lines;
}

}  // namespace plumbline::view
