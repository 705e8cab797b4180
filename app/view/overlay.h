// The virtual things over the camera's image, as a display list.
#pragma once

#include <vector>

#include "app/view/picture_layout.h"
#include "app/view/status_text.h"

namespace plumbline {

/// A word at a place of the picture.
struct Label {
  float x = 0, y = 0;  ///< the place that it is about [px]
  std::string text;
  Colour colour;
};

/// Everything that the overlay is made from; what it points to outlives the display list.
struct OverlayInput {
  const ViewFacts& facts;  ///< with a state and carriers
  const OverlayConfig& config;
  const std::vector<int>& meshes;  ///< the renderer's number of each object of the table; 0: none
  std::vector<const std::uint8_t*> pixels = {};  ///< of each camera's image; null: none
};

/// The image of the k-th camera, undistorted in the layout's image area, and over it, each where
/// the newest state has it:
///   - the objects of the table, bent where they say so, and the tool without load where asked for;
///   - the tool's axis as it is bent, and, dashed, as its controller believes it;
///   - assembly points: a cross where it was taught, X_WP; a line to where the tip would land
///     without correction, p = X_WP.p - e R_WB t_B with t_B the correction's translation (first
///     order: the deflection itself changes by a share of the correction over the arm's length,
///     micrometres); a circle of radius e u, that holds 95 % of where it lands with it;
///   - datum lines, approach paths, nearest points of watched pairs, the clip plane.
/// e is the exaggeration, and is told in the picture when it is not 1. What hangs on something
/// stale is grey; what cannot be placed is not drawn. Joint deflection is not exaggerated: the
/// flange stands where it is.
/// @param labels  get what is to be written beside things
void AddOverlay(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                DisplayList& list, std::vector<Label>& labels);

/// What stale things are drawn in, in place of their own colour.
Colour Greyed(const Colour& colour);

}  // namespace plumbline
