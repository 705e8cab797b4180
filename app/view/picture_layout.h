// How a picture is divided: a bar at the top, the camera's image, a column of panels, messages.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "firmware-like/scene/display_list.h"

namespace plumbline {

struct PictureLayout {
  ImageSize size;
  float em = 16;  ///< height of plain text [px]
  Area top, image, column, messages;

  float line() const { return 1.3F * em; }  ///< from base line to base line
};

/// Text is a 38th of the picture's height, at least 12 px: at 1080 lines on a 24-inch monitor its
/// capitals are 5.7 mm high, which two metres away is 10 minutes of arc, twice the smallest that a
/// sound eye reads.
PictureLayout LayoutOf(ImageSize size);

/// The area in equal parts with a gap between them: beside each other, or below each other where
/// that leaves an image of this size larger.
std::vector<Area> PartsOf(const Area& area, std::size_t count, ImageSize image, float gap);

/// The lens without its distortion, scaled so that the whole of the camera's image (as wide and
/// high as `image`) fills the area in one direction and is in its middle in the other.
///   u' + 1/2 = s (u + 1/2) + offset
Lens PinholeIn(const Area& area, const Lens& lens, ImageSize image);

/// For an image whose lens is not known: one that leaves it as it is.
Lens PlainLens(ImageSize image);

/// How far the pen goes [px]; Renderer::TextWidth.
using TextWidth = std::function<float(const std::string&, float)>;

/// The longest beginning of the text that fits, with an ellipsis where something is missing; cut
/// between letters of UTF-8. Empty where not even the ellipsis fits.
std::string Fitted(const std::string& text, float height_px, float width_px,
                   const TextWidth& text_width);

/// The text in lines that fit, divided between words; a word that is too long for a line of its own
/// stays whole. At least one line.
std::vector<std::string> Wrapped(const std::string& text, float height_px, float width_px,
                                 const TextWidth& text_width);

}  // namespace plumbline
