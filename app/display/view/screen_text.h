// The complete picture of the display: strip, images with labels, tiles and details, as a display
// list.
#pragma once

#include <vector>

#include "app/display/view/label_placement.h"
#include "app/display/view/overlay.h"
#include "app/display/view/picture_layout.h"
#include "app/display/view/picture_writer.h"
#include "app/display/view/status_text.h"

namespace plumbline::display {

// Colour scale of the tool's bending stress, with ticks.

/// Adds the scale in a corner of the image if stress is shown: round ticks from 0 to the upper end
/// of the scale, and a mark at the largest stress in the tool.
void AddStressScale(const OverlayInput& input, LabelPlacer& placer, PictureWriter& writer);

/// Round values from 0 to at most `full` > 0, four to eight of them.
std::vector<double> ScaleTicks(double full);

/// Layout for the displayed cameras and the size of their images.
PictureLayout LayoutFor(const ViewFacts& facts, image::ImageSize size);

/// Adds the state strip, the tiles of the points and the band of details, or in place of the last
/// two the guidance of the person who holds the calibration board. Texts never overlap or leave
/// their area.
void AddPanels(const ViewFacts& facts, const PictureLayout& layout, const TextWidth& text_width,
               scene::DisplayList& list);

/// Annotates the image of the k-th camera in the layout's image area. While it captures the
/// calibration board: where to hold that. Otherwise: its name, a frame and the
/// reasons if the overlay is stale, the exaggeration if it is not 1, and in the first image the
/// stress scale if stress is shown. Then adds the inset at the tip if there is room, and the labels
/// with leader lines; a label without room is omitted. Nothing covers what `marks` keeps clear,
/// unless the image has no other corner for notes and scale.
/// @param pinhole       projection of the image
/// @param inset_wanted  the inset has not been added to another image
/// @return              whether the inset was added
bool AddAnnotations(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                    const ImageMarks& marks, const TextWidth& text_width, const lens::Lens& pinhole,
                    bool inset_wanted, scene::DisplayList& list);

/// The complete picture: each displayed camera in its part of the image area, and the panels.
scene::DisplayList PictureOf(const OverlayInput& input, const PictureLayout& layout,
                             const TextWidth& text_width);

/// The picture shown before the first state has arrived: panels that explain what is missing.
scene::DisplayList PictureWithoutState(const ViewFacts& facts, const PictureLayout& layout,
                                       const TextWidth& text_width);

}  // namespace plumbline::display
