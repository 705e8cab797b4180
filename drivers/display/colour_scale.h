// The colours that stand for stress, from none to full.
#pragma once

#include "firmware-like/scene/display_list.h"

namespace plumbline {

/// A scale that reads in one order: dark blue, green, bright yellow, the lightness rising evenly,
/// so that equal steps of stress look equally far apart, in print and to the colour-blind, too.
///   Oklab: L = 0.30 .. 0.93, hue 285 .. 105 degrees, chroma 0.13 or what sRGB can show
/// [Ottosson, "A perceptual color space for image processing", 2020]
/// @param share  0..1; what lies outside, or is not a number, counts as the nearer end, or as 0
Colour StressColour(double share);

}  // namespace plumbline
