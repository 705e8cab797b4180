// Overlay of virtual objects, tool axis and assembly points on the camera image, as a display list.
#pragma once

#include <vector>

#include "app/display/view/picture_layout.h"
#include "app/display/view/status_text.h"
#include "firmware-like/scene/mesh_facts.h"

namespace plumbline::display {

/// Text attached to a point of the picture.
struct Label {
  float x = 0, y = 0;  ///< the labelled point [px]
  std::string text;
  scene::Colour colour;
  int rank = 0;         ///< labels of a lower rank are placed first
  std::string shorter;  ///< in place of a text without room; empty: none
};

/// Marks of the overlay in the picture.
struct ImageMarks {
  std::vector<Label> labels;
  std::vector<scene::Area> keep_clear;  ///< tool, tip and points: nothing may cover them [px]
};

/// Input of the overlay. Everything it refers to must outlive the display list.
struct OverlayInput {
  const ViewFacts& facts;  ///< must contain a state and carriers
  const config::OverlayConfig& config;
  const std::vector<int>& meshes;  ///< renderer's mesh number of each table object; 0: none
  std::vector<const std::uint8_t*> pixels = {};  ///< of each camera's image; null if none
  /// Properties of each table object's mesh, for its extent; empty or null if unknown.
  std::vector<const scene::MeshFacts*> mesh_facts = {};
};

/// Adds the undistorted image of the k-th camera to the layout's image area and, drawn over it in
/// the newest state:
///   - the table's objects, bent if configured so, and the unloaded tool if requested;
///   - the tool axis, solid as bent and dashed as the controller assumes it;
///   - assembly points: a cross at the taught position X_WP; a line to the position the tip would
///     reach without correction, p = X_WP.p - e R_WB t_B with t_B the correction's translation
///     (first order: the correction changes the deflection by micrometres only); a circle of
///     radius e u, with u the 95 % radius of the corrected position;
///   - the tip as the camera measures it: a circle with an oblique cross;
///   - datum lines, approach paths, nearest points of watched pairs, the clip plane.
/// e is the exaggeration; the picture states it if it is not 1. It does not apply to the joint
/// deflection: the flange is drawn where it is. Everything that depends on stale data is grey, and
/// what has no pose is not drawn.
/// @param marks  receives the texts to be placed by AddAnnotations(), and what they must not cover
void AddOverlay(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                scene::DisplayList& list, ImageMarks& marks);

/// Replacement colour for stale objects; keeps half the opacity.
scene::Colour Greyed(const scene::Colour& colour);

}  // namespace plumbline::display
