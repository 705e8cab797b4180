// Colour scale of the tool's bending stress, with ticks.
#pragma once

#include "app/display/view/label_placement.h"
#include "app/display/view/overlay.h"
#include "app/display/view/picture_writer.h"

namespace plumbline::display {

/// Adds the scale in a corner of the image if stress is shown: round ticks from 0 to the upper end
/// of the scale, and a mark at the largest stress in the tool.
void AddStressScale(const OverlayInput& input, LabelPlacer& placer, PictureWriter& writer);

/// Round values from 0 to at most `full` > 0, four to eight of them.
std::vector<double> ScaleTicks(double full);

}  // namespace plumbline::display
