// Centres of discs to a few hundredths of a pixel.
#pragma once

#include "app/lens/board.h"
#include "app/lens/disc_lattice.h"
#include "firmware-like/lens/luma_view.h"

namespace plumbline {

/// Fits an ellipse to the rim of each disc: every pixel there, with gradient of unit direction n
/// and length g, has a tangent n . q = d, and tangents l = (n, -d) of an ellipse satisfy
///   l^T C l = 0,   C the dual conic; least squares over the rim with weights g^2
/// [J.-N. Ouellet and P. Hebert, Precise ellipse estimation without contour point extraction,
/// Machine Vision and Applications 21 (2009)]. The centre is (C13, C23) / C33; symmetric blur and
/// shade do not move it. The image is smoothed by a Gaussian of 1 px before.
/// @param discs   of the whole image [px], one for each point that is seen
/// @param gap_px  to the nearest rim of another disc
/// @param view    corners_px and seen are set; blur_px is
void RefineDiscs(const LumaView& image, const std::vector<Disc>& discs, double gap_px,
                 BoardView& view);

}  // namespace plumbline
