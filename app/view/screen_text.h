// Panels, messages and labels as boxes and texts of a display list.
#pragma once

#include <vector>

#include "app/view/overlay.h"
#include "app/view/picture_layout.h"
#include "app/view/status_text.h"

namespace plumbline {

/// Adds the bar, the column and the messages. Every panel has its title and first line,
/// then what is urgent gets room, then the others in turn; a title says how many lines had none. No
/// two texts overlap, and none leaves its area.
void AddPanels(const ViewFacts& facts, const PictureLayout& layout, const TextWidth& text_width,
               DisplayList& list);

/// Marks the image of the k-th camera: its name, a frame and the reasons where it is stale, the
/// exaggeration where it is not 1, the scale of stress where that is shown. Then the labels, moved
/// down where others stand already and left out where there is no room.
void AddMarks(const OverlayInput& input, std::size_t k, const PictureLayout& layout,
              const std::vector<Label>& labels, const TextWidth& text_width, DisplayList& list);

/// A whole picture: the cameras that are shown, each in a part of the image area, and the panels.
DisplayList PictureOf(const OverlayInput& input, const PictureLayout& layout,
                      const TextWidth& text_width);

/// A picture without a state: what is missing, in words.
DisplayList PictureWithoutState(const ViewFacts& facts, const PictureLayout& layout,
                                const TextWidth& text_width);

}  // namespace plumbline
