// Kinds of simulated captures by cause; AllKinds() joins them.
#pragma once

#include "tests/lens_captures/capture_maker.h"

namespace plumbline::lens_captures {

void AddKindsOfLens(std::vector<Kind>& kinds);
void AddKindsOfBoard(std::vector<Kind>& kinds);
void AddKindsOfImage(std::vector<Kind>& kinds);
/// By the part that is disturbed, of random shape and size: image, board, view, time or detector.
void AddKindsByPart(std::vector<Kind>& kinds);
void AddGoodKinds(std::vector<Kind>& kinds);

}  // namespace plumbline::lens_captures
