#include "app/display/view/silent_daemon.h"

#include "app/display/view/health_message.h"

namespace plumbline::display {

bool DaemonIsSilent(const cell::ViewState& state, const std::string& link_problem, double now_s) {
  const double limit_s = link_problem.empty() ? kDaemonSilent_s : cell::kStateOld_s;
  return now_s - state.now_s > limit_s;
}

std::optional<cell::ViewState> WithdrawnState(const cell::ViewState& state,
                                              const std::string& link_problem, double now_s) {
  const bool done = WithoutDaemon(state);
  if (done || !DaemonIsSilent(state, link_problem, now_s)) return std::nullopt;
  cell::ViewState withdrawn = state;
  withdrawn.health = HealthOf({.daemon_silent = true});
  withdrawn.data_age_s += now_s - state.now_s;
  withdrawn.motion = {};
  for (cell::ViewPoint& point : withdrawn.points) point.valid = false;
  for (cell::ViewCamera& camera : withdrawn.cameras) {
    camera.status.state = lens::ZoomState::kUnknown;
  }
  return withdrawn;
}

std::string InvalidReason(const cell::ViewPoint& point, const cell::ViewState& state) {
  if (WithoutDaemon(state)) return Describe(state.health.reason);
  return CodeText(point.code);
}

}  // namespace plumbline::display
