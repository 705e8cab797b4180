// Refusal of a reloaded model that would move points farther than its data explain.
#pragma once

#include <optional>
#include <stop_token>

#include "app/cell/daemon/model_in_force.h"

namespace plumbline::cell {

enum class ModelDecision {
  kAccepted,
  kWithdrawn,  ///< refused, and withdrawn in the store, which has the model in force again
  kRefused,    ///< refused, but the store was not changed
  kStopped,    ///< not decided
};

/// Decides whether the model of a reloaded configuration may come into force: not if there are
/// Objections to what it changes of the points, and no person has confirmed it. A
/// refusal is logged (kModelRefused) and withdrawn in the store, so that the model in force remains
/// applied after a restart. May take seconds, but not more than tens of milliseconds after a stop
/// is requested.
/// @param fresh     as read at the reload
/// @param running   the versions in force
/// @param in_force  the cell in force
/// @param carried   the present payload, if it is known
ModelDecision DecideOnModel(const ConfigInForce& fresh, const RunningDaemon& running,
                            const model::CellModel& in_force,
                            const std::optional<loads::Payload>& carried,
                            const std::stop_token& stop);

}  // namespace plumbline::cell
