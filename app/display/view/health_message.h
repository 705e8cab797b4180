// Messages about the health of the cell: what is wrong, with the names of the things, and what to
// do.
#pragma once

#include <string>

#include "app/display/view/status_text.h"

namespace plumbline::display {

struct HealthMessage {
  std::string reason;  ///< "no correction at left bracket (point 3): joint limit, code 2"
  std::string remedy;  ///< the action; empty: none is needed
};

/// The message that strip, headline, panels and status.json show. It names the points, cameras,
/// tags and objects concerned where the state knows them; otherwise the texts of cell_health.h.
/// Never asks for an action that this process has already taken, such as starting it.
HealthMessage MessageOf(const CellHealth& health, const ViewFacts& facts);

/// "joint limit (code 2)".
std::string CodeText(correction::CorrectionCode code);

/// "learning the reference: 7 of 20 probes", while the drift monitor collects its reference.
std::string LearningText(const status::MonitoringStatus& monitoring);

}  // namespace plumbline::display
