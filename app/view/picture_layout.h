// Picture layout: a bar at the top, the camera image, a column of panels, a message area.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "firmware-like/image/image_size.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::view {

struct PictureLayout {
  image::ImageSize size;
  float em = 16;  ///< height of plain text [px]
  scene::Area top, image, column, messages;

  float line() const { return 1.3F * em; }  ///< line spacing [px]
};

/// Text height is 1/38 of the picture height, at least 12 px. With 1080 lines on a 24-inch display
/// capitals are then 5.7 mm high, which subtends 10 arc minutes at 2 m: twice what normal vision
/// resolves.
PictureLayout LayoutOf(image::ImageSize size);

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

}  // namespace plumbline::view
