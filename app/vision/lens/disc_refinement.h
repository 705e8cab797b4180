// Sub-pixel refinement of disc centres.
#pragma once

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "app/vision/lens/disc_lattice.h"
#include "firmware-like/image/luma_view.h"

namespace plumbline::vision {

/// Fits an ellipse to the rim of each disc. A rim pixel q whose gradient has unit direction n and
/// magnitude g defines the tangent n . q = d; the tangents l = (n, -d) of an ellipse satisfy
///   l^T C l = 0,   C the dual conic,
/// which is solved by least squares over the rim with weights g^2
/// [J.-N. Ouellet and P. Hebert, Precise ellipse estimation without contour point extraction,
/// Machine Vision and Applications 21 (2009)]. The centre is (C13, C23) / C33; symmetric blur and
/// shading do not move it. The image is smoothed by a Gaussian of 1 px first.
/// @param discs   in full-resolution pixels, one per point; ignored where `seen` is false
/// @param gap_px  distance to the nearest rim of another disc
/// @param view    on input, corners_px and seen; corners_px is refined, `seen` is cleared where the
///                fit fails, and blur_px is set
void RefineDiscs(const image::LumaView& image, const std::vector<Disc>& discs, double gap_px,
                 BoardView& view);

}  // namespace plumbline::vision
