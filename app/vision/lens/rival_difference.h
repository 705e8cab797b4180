// Difference between the lens of a rival explanation and another lens.
#pragma once

#include "app/vision/lens/rival_fit.h"
#include "app/vision/lens/usable_region.h"

namespace plumbline::vision {

/// Largest distance between the pixels to which a lens and that of a rival map one direction, after
/// the rotation that minimizes the sum of squares, within each candidate radius [px]. A camera that
/// varies has another lens in each view; the largest over all views is then returned. Infinite
/// where a pixel has no direction.
RadiusErrors LensDifferences(const lens::Lens& lens, const Rival& rival, const RivalResult& result,
                             image::ImageSize size);

}  // namespace plumbline::vision
