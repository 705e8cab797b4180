// Difference between the lens of a rival explanation and the plain lens.
#pragma once

#include "app/lens/rival_fit.h"
#include "app/lens/usable_region.h"

namespace plumbline::lens {

/// Largest distance between the pixels of equal directions by the plain lens and by the rival's,
/// after the rotation that minimizes the sum of squares, within each candidate radius [px]. A
/// camera that varies has another lens in each view: the largest over all views. Infinite where a
/// pixel has no direction.
RadiusErrors LensDifferences(const SharedVector& plain, const Rival& rival,
                             const RivalResult& result, image::ImageSize size);

}  // namespace plumbline::lens
