#include "app/view/silent_daemon.h"

#include "app/view/health_message.h"

namespace plumbline::view {

bool DaemonIsSilent(const view_link::ViewState& state, const std::string& link_problem,
                    double now_s) {
  const double limit_s = link_problem.empty() ? kDaemonSilent_s : kStateOld_s;
  return now_s - state.now_s > limit_s;
}

std::optional<view_link::ViewState> WithdrawnState(const view_link::ViewState& state,
                                                   const std::string& link_problem, double now_s) {
  const bool done = WithoutDaemon(state);
  if (done || !DaemonIsSilent(state, link_problem, now_s)) return std::nullopt;
  view_link::ViewState withdrawn = state;
  withdrawn.health = HealthOf({.daemon_silent = true});
  withdrawn.data_age_s += now_s - state.now_s;
  withdrawn.motion = {};
  for (view_link::ViewPoint& point : withdrawn.points) point.valid = false;
  for (view_link::ViewCamera& camera : withdrawn.cameras) {
    camera.status.state = lens::ZoomState::kUnknown;
  }
  return withdrawn;
}

std::string InvalidReason(const view_link::ViewPoint& point, const view_link::ViewState& state) {
  if (WithoutDaemon(state)) return Describe(state.health.reason);
  return CodeText(point.code);
}

}  // namespace plumbline::view
