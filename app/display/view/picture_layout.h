// Picture layout: a state strip, the camera images, tiles of assembly points, a band of details.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "firmware-like/image/image_size.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

/// Text is scaled with s = min(height / 1080, width / 1440) and never smaller than 12 px. On a
/// 24-inch display of 1080 lines (0.277 mm a pixel) capitals are 0.73 em high: the state word
/// 14 mm, legible at 3 m (16 arc minutes); values 12 mm; names 7 mm, legible at 1.5 m; details
/// 4.9 mm (24 px of em, at least 15 px per metre of distance up to 1.6 m).
struct PictureLayout {
  image::ImageSize size;
  float em = 16;                                    ///< height of details [px]
  float word_em = 60, value_em = 48, name_em = 28;  ///< state word, values, names [px]
  scene::Area strip, image, tiles, band;
  std::vector<scene::Area> images;  ///< of each displayed camera, within `image`

  float line() const { return 1.175F * em; }  ///< line spacing of details [px]
};

/// The strip is at least 6 % of the picture's height. The images get the largest area of their
/// aspect ratio that leaves room for one column of tiles beside them or one row below them, and for
/// a title and four lines of details, so that there are no bars beside an image. Where that leaves
/// the images less than 60 % of the picture, and they reach it over the whole width, they get the
/// whole width, with one row of low tiles below and fewer details or none. Several images are
/// placed side by side or one below the other, whichever is larger.
/// @param cameras  number of displayed cameras, at least one
/// @param image    size of their images
PictureLayout LayoutOf(image::ImageSize size, std::size_t cameras = 1,
                       image::ImageSize image = {1920, 1080});

/// Distance between tiles, images and details [px].
float Gap(const PictureLayout& layout);

/// Size of one tile [px], without margins.
image::ImageSize TileSize(const PictureLayout& layout);

/// Splits the area into equal parts with a gap between them, side by side or stacked, whichever
/// shows an image of this aspect ratio larger.
std::vector<scene::Area> SplitArea(const scene::Area& area, std::size_t count,
                                   image::ImageSize image, float gap);

/// The lens without its distortion, scaled so that the whole camera image fits the area and is
/// centred in it.
///   u' + 1/2 = s (u + 1/2) + offset
lens::Lens PinholeIn(const scene::Area& area, const lens::Lens& lens, image::ImageSize image);

/// Distortion-free lens for an image whose lens is unknown.
lens::Lens PlainLens(image::ImageSize image);

/// Advance width of a text at a height [px]; see Renderer::TextWidth.
using TextWidth = std::function<float(const std::string&, float)>;

/// Shortens the text to fit the width, with an ellipsis if something was cut; never splits a UTF-8
/// character. Empty if not even the ellipsis fits.
std::string Elided(const std::string& text, float height_px, float width_px,
                   const TextWidth& text_width);

/// Breaks the text between words into lines that fit. A word longer than a line is not broken.
/// @return  at least one line
std::vector<std::string> Wrapped(const std::string& text, float height_px, float width_px,
                                 const TextWidth& text_width);

}  // namespace plumbline::display
