// Panels, messages, labels and stale marks of the display, as boxes and texts of a display list.
#pragma once

#include <vector>

#include "app/view/overlay.h"
#include "app/view/picture_layout.h"
#include "app/view/status_text.h"

namespace plumbline::view {

/// Adds the top bar, the column of panels and the messages. Every panel gets its title and first
/// line; the remaining rows go to urgent lines first, then to the panels in turn. A title states
/// how many of its lines are hidden. Texts never overlap or leave their area.
void AddPanels(const ViewFacts& facts, const PictureLayout& layout, const TextWidth& text_width,
               scene::DisplayList& list);

/// Annotates the image of the k-th camera: its name, a frame and the reasons if the overlay is
/// stale, the exaggeration if it is not 1, and the stress scale if stress is shown. Then adds the
/// labels; a label is moved down to avoid others and omitted if there is no room.
void AddAnnotations(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
                    const std::vector<Label>& labels, const TextWidth& text_width,
                    scene::DisplayList& list);

/// The complete picture: each displayed camera in its part of the image area, and the panels.
scene::DisplayList PictureOf(const OverlayInput& input, const PictureLayout& layout,
                             const TextWidth& text_width);

/// The picture shown before the first state has arrived: panels that explain what is missing.
scene::DisplayList PictureWithoutState(const ViewFacts& facts, const PictureLayout& layout,
                                       const TextWidth& text_width);

}  // namespace plumbline::view
