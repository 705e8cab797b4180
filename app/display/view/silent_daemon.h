// Validity of a state that the daemon no longer updates.
#pragma once

#include <optional>
#include <string>

#include "app/cell/view_link/view_state.h"

namespace plumbline::display {

/// Age of the state at which a connected daemon hangs; if the connection is lost,
/// cell::kStateOld_s.
inline constexpr double kDaemonSilent_s = 2.0;

/// Whether the daemon has ended or hangs; nothing it reported may then be shown as current.
/// @param link_problem  why no states arrive; empty while connected
bool DaemonIsSilent(const cell::ViewState& state, const std::string& link_problem, double now_s);

/// The last state of a silent daemon as page and display may show it: health "no daemon", no point
/// valid, no lens known to be valid, and the present age of the robot reading.
/// @return  nullopt while the daemon reports, or if the state is already withdrawn
std::optional<cell::ViewState> WithdrawnState(const cell::ViewState& state,
                                              const std::string& link_problem, double now_s);

/// Whether the state is that of a silent daemon, as WithdrawnState() returns it.
inline bool WithoutDaemon(const cell::ViewState& state) {
  return state.health.reason == HealthReason::kNoDaemon;
}

/// Why a displayed point has no valid correction.
std::string InvalidReason(const cell::ViewPoint& point, const cell::ViewState& state);

}  // namespace plumbline::display
