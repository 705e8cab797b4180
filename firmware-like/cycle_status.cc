#include "firmware-like/cycle_status.h"

#include <algorithm>
#include <cmath>

namespace plumbline {
namespace {

int WarningsOf(const status::MonitoringStatus& monitoring) {
  int warnings = 0;
  if (monitoring.drift_alarm || monitoring.radius_contradicted) warnings |= warning::kDrift;
  if (monitoring.proposal_waiting()) warnings |= warning::kProposalWaiting;
  if (monitoring.fault) warnings |= warning::kMonitoringFault;
  if (monitoring.storage_unavailable) warnings |= warning::kStorage;
  return warnings;
}

int WarningsOf(const status::CameraStatus& camera) {
  int warnings = 0;
  if (!camera.configured) return warnings;
  if (camera.lens_stale) warnings |= warning::kLensStale;
  if (camera.camera_lost || camera.zoom_unknown) warnings |= warning::kCameraLost;
  if (camera.board_wanted) warnings |= warning::kBoardWanted;
  return warnings;
}

int WarningsOf(const status::SceneStatus& scene) {
  int warnings = 0;
  if (scene.interferences > 0) warnings |= warning::kInterference;
  if (scene.blocked > 0) warnings |= warning::kApproachBlocked;
  return warnings;
}

CameraInput CameraInputFrom(const status::CameraStatus& camera) {
  return {camera.configured,   camera.state == lens::ZoomState::kValid,
          camera.board_wanted, camera.fiducial_moved,
          camera.tip_valid,    {camera.tip_W, camera.tip_covariance_W, camera.tip_tag_covariance_W},
          camera.tip_time_s};
}

}  // namespace

std::uint16_t AlarmOf(InputFault fault) {
  switch (fault) {
    case InputFault::kOk:
      return 0;
    case InputFault::kMissing:
      return alarm::kRobotMissing;
    case InputFault::kStale:
      return alarm::kRobotStale;
    case InputFault::kTcpMismatch:
      return alarm::kDecodingWrong;
    default:
      return alarm::kRobotImplausible;
  }
}

std::uint16_t AlarmsOf(const std::vector<PointResult>& points) {
  unsigned alarms = 0;
  for (const PointResult& point : points) {
    if (point.valid || point.code == correction::CorrectionCode::kNoRobot ||
        point.code == correction::CorrectionCode::kPending) {
      continue;
    }
    alarms |= point.code == correction::CorrectionCode::kPayloadUnknown ? alarm::kPayloadUnknown
                                                                        : alarm::kPointRefused;
  }
  return static_cast<std::uint16_t>(alarms);
}

HealthInputs HealthInputsFrom(const Snapshot& snapshot, const MachineInput& input,
                              double max_radius_m) {
  HealthInputs facts{.alarms = snapshot.alarms, .warnings = snapshot.warnings};
  for (const PointResult& point : snapshot.points) {
    facts.pending =
        facts.pending || (!point.valid && point.code == correction::CorrectionCode::kPending);
    if (!point.valid) continue;
    facts.extrapolating = facts.extrapolating || point.correction.extrapolated;
    facts.weakest_basis = model::Weakest(facts.weakest_basis.value_or(point.correction.basis),
                                         point.correction.basis);
    facts.radius_too_large =
        facts.radius_too_large || point.correction.uncertainty_m > max_radius_m;
  }
  for (const CameraInput& camera : input.cameras) {
    facts.fiducial_moved = facts.fiducial_moved || (camera.configured && camera.fiducial_moved);
  }
  facts.required_lens_missing = snapshot.lenses_missing != 0;
  facts.scene_lost = input.scene_lost;
  facts.objects_near = input.objects_near;
  facts.scene_incomplete = input.scene_incomplete;
  facts.no_points = snapshot.points.empty();
  facts.reference_refused = input.reference_refused;
  facts.radius_contradicted = input.radius_contradicted;
  facts.quarantined = input.quarantined;
  facts.compensated_twice = input.compensated_twice;
  return facts;
}

std::uint16_t StatusWordOf(const Snapshot& snapshot, const MachineInput& input,
                           bool plc_heartbeat) {
  std::uint16_t word = 0;
  const auto set = [&word](std::uint16_t bit, bool on) {
    if (on) word = static_cast<std::uint16_t>(word | bit);
  };
  const bool robot_trusted = snapshot.input_fault == InputFault::kOk;
  const auto valid = [](const PointResult& point) { return point.valid; };
  const auto extrapolated = [](const PointResult& point) {
    return point.valid && point.correction.extrapolated;
  };
  const auto stale = [](const CameraInput& one) { return one.configured && !one.lens_valid; };
  const auto& points = snapshot.points;
  set(status::kReady, robot_trusted && std::all_of(points.begin(), points.end(), valid));
  set(status::kResultValid, snapshot.result.valid);
  set(status::kRobotLink, robot_trusted);
  set(status::kWarning, snapshot.warnings != 0 || input.compensated_twice);
  set(status::kError, snapshot.alarms != 0);
  set(status::kLensCalibrated, input.cameras.front().configured &&
                                   std::none_of(input.cameras.begin(), input.cameras.end(), stale));
  set(status::kExtrapolating, std::any_of(points.begin(), points.end(), extrapolated));
  set(status::kTemperatureValid, robot_trusted && snapshot.robot.temp_C.has_value());
  set(status::kPayloadValid, snapshot.payload_valid);
  set(status::kPlcHeartbeatSeen, plc_heartbeat);
  set(status::kManual, input.command.manual || snapshot.robot.mode == model::RobotMode::kManual);
  set(status::kToggle, std::fmod(input.now_s, 2.0) >= 1.0);
  set(status::kCompensatedTwice, input.compensated_twice);
  return word;
}

void AddBackground(const status::MonitoringStatus& monitoring,
                   const std::array<status::CameraStatus, model::kMaxCameras>& cameras,
                   const status::SceneStatus& scene, MachineInput& input) {
  int warnings = input.background_warnings | WarningsOf(monitoring);
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    input.cameras[k] = CameraInputFrom(cameras[k]);
    warnings |= WarningsOf(cameras[k]);
  }
  const bool scene_fresh = scene.FreshAt(input.now_s);
  if (scene_fresh) warnings |= WarningsOf(scene);
  input.background_warnings = static_cast<std::uint16_t>(warnings);
  input.scene_lost = std::isfinite(scene.time_s) && !scene_fresh;
  input.objects_near = scene_fresh && scene.near > 0;
  input.scene_incomplete = scene_fresh && scene.unmeasured > 0;
  input.storage_unavailable = monitoring.storage_unavailable;
  input.reference_refused = monitoring.reference_refused;
  input.radius_contradicted = monitoring.radius_contradicted;
  input.quarantined = monitoring.quarantined > 0;
}

}  // namespace plumbline
