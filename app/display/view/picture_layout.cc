#include "app/display/view/picture_layout.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace plumbline::display {
namespace {

constexpr float kReferenceHeight_px = 1080, kReferenceWidth_px = 1440;  ///< where s = 1
constexpr float kStrip_px = 82, kStripShare = 0.06F, kSmallestText_px = 12;
constexpr float kTileWidth_em = 17.3F, kTileHeight_em = 7.7F, kGap_em = 0.25F;
constexpr float kBandLines = 5, kLeastBandLines = 3;  ///< a title and four or two lines
constexpr float kBandMargins_em = 0.8F;
constexpr float kShortTile_em = 6.3F;  ///< height of a tile without its note
constexpr float kImageShare = 0.6F;    ///< of the picture, where an arrangement can reach it

/// Largest scale at which the whole image fits the area.
double ScaleIn(const scene::Area& area, image::ImageSize image) {
  return std::min(static_cast<double>(area.width) / image.width,
                  static_cast<double>(area.height) / image.height);
}

bool StartsCharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0U) != 0x80U;
}

}  // namespace

namespace {

/// Room of the images between strip and band: the whole width, or without the column of tiles.
struct Room {
  float width, height;
  float area = 0;  ///< that images of the given aspect ratio cover [px^2]
  float covered_width = 0, covered_height = 0;
};

Room Filled(float width, float height, std::size_t cameras, double aspect, float gap) {
  Room room{width, height};
  if (!(width > 0) || !(height > 0)) return room;
  const auto n = static_cast<float>(cameras), ratio = static_cast<float>(aspect);
  const float gaps = (n - 1) * gap;
  const float side = std::min((width - gaps) / n / ratio, height);   // height of each image
  const float below = std::min(width / ratio, (height - gaps) / n);  // the same, stacked
  const bool stacked = below > side;
  const float each = stacked ? below : side;
  room.covered_width = stacked ? each * ratio : n * each * ratio + gaps;
  room.covered_height = stacked ? n * each + gaps : each;
  room.area = n * each * each * ratio;
  return room;
}

float BandHeight(const PictureLayout& layout, float lines) {
  return std::round(lines * layout.line() + kBandMargins_em * layout.em);
}

void SetTextSizes(PictureLayout& layout) {
  const auto width = static_cast<float>(layout.size.width);
  const auto height = static_cast<float>(layout.size.height);
  const float s = std::min(height / kReferenceHeight_px, width / kReferenceWidth_px);
  const auto size = [s](float px, float least) { return std::max(least, std::round(px * s)); };
  layout.em = size(24, kSmallestText_px);
  layout.name_em = size(34, kSmallestText_px + 2);
  layout.value_em = size(60, 24);
  layout.word_em = size(70, 28);
  layout.strip = {
      0, 0, width,
      std::round(std::max({kStrip_px * s, kStripShare * height + 1, 1.17F * layout.word_em}))};
}

}  // namespace

float Gap(const PictureLayout& layout) {
  return std::round(kGap_em * layout.em);
}

image::ImageSize TileSize(const PictureLayout& layout) {
  return {static_cast<int>(std::round(kTileWidth_em * layout.em)),
          static_cast<int>(std::round(kTileHeight_em * layout.em))};
}

namespace {

/// Strip, images, tiles and details in their usual sizes.
PictureLayout FullLayout(PictureLayout layout, std::size_t cameras, double aspect) {
  const auto width = static_cast<float>(layout.size.width);
  const auto height = static_cast<float>(layout.size.height);
  const float strip = layout.strip.height, gap = Gap(layout), band = BandHeight(layout, kBandLines);
  const float column = static_cast<float>(TileSize(layout).width) + 2 * gap;
  const float row = static_cast<float>(TileSize(layout).height) + layout.line() + 2 * gap;
  const Room beside = Filled(width - column, height - strip - band, cameras, aspect, gap);
  const Room below = Filled(width, height - strip - band - row, cameras, aspect, gap);
  const bool tiles_below = below.area > beside.area && below.covered_width > width - gap;
  const Room& room = tiles_below ? below : beside;
  const float image_width = tiles_below ? width : std::round(room.covered_width);
  const float image_height = std::round(room.covered_height);
  layout.image = {0, strip, image_width, image_height};
  layout.tiles = tiles_below ? scene::Area{0, strip + image_height, width, row}
                             : scene::Area{image_width, strip, width - image_width, image_height};
  const float top = tiles_below ? layout.tiles.bottom() : layout.image.bottom();
  layout.band = {0, top, width, height - top};
  return layout;
}

/// The images over the whole width, one row of tiles below them, and details only where there is
/// room left; nullopt if the images would not cover the width.
std::optional<PictureLayout> ImageFirstLayout(PictureLayout layout, std::size_t cameras,
                                              double aspect) {
  const auto width = static_cast<float>(layout.size.width);
  const auto height = static_cast<float>(layout.size.height);
  const float strip = layout.strip.height, gap = Gap(layout);
  const float row = std::ceil(kShortTile_em * layout.em) + 2 * gap;
  const Room room = Filled(width, height - strip - row, cameras, aspect, gap);
  if (!(room.covered_width > width - gap)) return std::nullopt;
  layout.image = {0, strip, width, std::round(room.covered_height)};
  const float left = height - layout.image.bottom();
  const bool details = left - row >= BandHeight(layout, kLeastBandLines);
  layout.tiles = {0, layout.image.bottom(), width, details ? row : left};
  layout.band = {0, layout.tiles.bottom(), width, height - layout.tiles.bottom()};
  return layout;
}

float ImageShare(const PictureLayout& layout) {
  const float all = static_cast<float>(layout.size.width) * static_cast<float>(layout.size.height);
  return layout.image.width * layout.image.height / all;
}

}  // namespace

PictureLayout LayoutOf(image::ImageSize size, std::size_t cameras, image::ImageSize image) {
  PictureLayout layout;
  layout.size = size;
  SetTextSizes(layout);
  const double aspect = static_cast<double>(image.width) / image.height;
  const PictureLayout full = FullLayout(layout, cameras, aspect);
  const auto image_first = ImageFirstLayout(layout, cameras, aspect);
  const bool larger =
      image_first && ImageShare(full) < kImageShare && ImageShare(*image_first) >= kImageShare;
  layout = larger ? *image_first : full;
  layout.images = SplitArea(layout.image, cameras, image, Gap(layout));
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

}  // namespace plumbline::display
