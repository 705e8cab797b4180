// Alarms, health and status word that follow from the results of a cycle.
#pragma once

#include <array>
#include <cstdint>

#include "firmware-like/machine_input.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/camera_status.h"
#include "firmware-like/status/monitoring_status.h"
#include "firmware-like/status/scene_status.h"

namespace plumbline {

/// Alarm bit of a fault of the robot reading; 0 for none.
std::uint16_t AlarmOf(InputFault fault);

/// Alarm bits of the points that are refused, not merely pending or without a robot.
std::uint16_t AlarmsOf(const std::vector<PointResult>& points);

/// Adds what runs beside the cycle to its input: cameras, warning bits, and facts for the health.
/// @param input  with the time of the cycle; its warning bits are kept
void AddBackground(const status::MonitoringStatus& monitoring,
                   const std::array<status::CameraStatus, model::kMaxCameras>& cameras,
                   const status::SceneStatus& scene, MachineInput& input);

/// Inputs of the health decision.
/// @param snapshot    with the cycle's points, alarms and warnings
/// @param max_radius_m  largest acceptable 95 % radius of a point
HealthInputs HealthInputsFrom(const Snapshot& snapshot, const MachineInput& input,
                              double max_radius_m);

/// Status word, without kBusy.
/// @param snapshot  with everything but the word itself
std::uint16_t StatusWordOf(const Snapshot& snapshot, const MachineInput& input, bool plc_heartbeat);

}  // namespace plumbline
