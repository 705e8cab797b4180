// Refusal of a reloaded model that would move points farther than its data explain.
#pragma once

#include <optional>

#include "app/daemon/model_in_force.h"

namespace plumbline::daemon {

/// Whether the model of a reloaded configuration must not come into force: there are
/// model_store::Objections to what it changes of the points, and no person has confirmed it. The
/// refusal is logged (kModelRefused) and withdrawn in the store, so that the model in force remains
/// applied after a restart. May take seconds.
/// @param fresh     as read at the reload
/// @param running   the versions in force
/// @param in_force  the cell in force
/// @param carried   the present payload, if it is known
bool RefusesModel(const ConfigInForce& fresh, const RunningDaemon& running,
                  const model::CellModel& in_force, const std::optional<loads::Payload>& carried);

}  // namespace plumbline::daemon
