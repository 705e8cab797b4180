// Validity of a state that its daemon no longer renews.
#pragma once

#include <optional>
#include <string>

#include "app/view_link/view_state.h"

namespace plumbline {

/// The daemon sends five states a second at least.
inline constexpr double kStateOld_s = 1.0;      ///< known to be cut off, or late
inline constexpr double kDaemonSilent_s = 2.0;  ///< connected, but sends nothing: it hangs

/// Whether the daemon is gone or hangs: nothing that it reported may be shown as present.
/// @param link_problem  why no states come; empty: the connection stands
bool DaemonIsSilent(const ViewState& state, const std::string& link_problem, double now_s);

/// The last state of a silent daemon as page and display may show it: health "no daemon", no point
/// valid, the age of the robot's reading as it is now. Nothing while the daemon reports,
/// and of a state that is withdrawn already.
std::optional<ViewState> WithdrawnState(const ViewState& state, const std::string& link_problem,
                                        double now_s);

/// Why a point of a shown state has no correction.
std::string WhyNotValid(const ViewPoint& point, const ViewState& state);

}  // namespace plumbline
