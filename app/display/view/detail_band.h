// Band of details below the images: camera, distances, robot and model, messages.
#pragma once

#include "app/display/view/picture_writer.h"

namespace plumbline::display {

/// Adds the band. In each cell urgent lines come first and are wrapped; its title states how many
/// lines are hidden. Messages come newest first.
void AddDetailBand(const ViewFacts& facts, PictureWriter& writer);

}  // namespace plumbline::display
