// Panels of the display, from alarms to the model in force.
#pragma once

#include <string>
#include <vector>

#include "app/display/view/status_text.h"

namespace plumbline::display {

struct Panel {
  std::string title;
  std::vector<PanelLine> lines;  ///< most important first; the last may be hidden for lack of room
};

/// All panels, in display order.
std::vector<Panel> PanelsOf(const ViewFacts& facts);

/// The panels of the display: fewer than the page's, without remarks on files.
std::vector<Panel> WallPanelsOf(const ViewFacts& facts);

}  // namespace plumbline::display
