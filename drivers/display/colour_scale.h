// Colour scale for stress.
#pragma once

#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

/// Perceptually uniform scale from dark blue over green to bright yellow. Lightness increases
/// linearly, so equal steps of stress look equally large, also in greyscale print and to the
/// colour-blind.
///   Oklab: L = 0.30 .. 0.93, hue 285 .. 105 degrees, chroma 0.13 or the largest within sRGB
/// [Ottosson, "A perceptual color space for image processing", 2020]
/// @param fraction  of full stress, clamped to 0..1; NaN counts as 0
scene::Colour StressColour(double fraction);

}  // namespace plumbline::display
