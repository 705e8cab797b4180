// Inputs of one control cycle: robot reading, PLC command, status of cameras and background
// workers.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "firmware-like/model/plc_command.h"
#include "firmware-like/model/robot_state.h"
#include "firmware-like/tip_fusion.h"

namespace plumbline {

/// Camera status that the control cycle needs.
struct CameraInput {
  bool configured = false;
  bool lens_valid = false;
  bool board_wanted = false;    ///< the camera requests a calibration
  bool fiducial_moved = false;  ///< a reference tag is not where it was declared
  bool tip_valid = false;       ///< `tip` was measured with the tool at standstill
  MeasuredTip tip;
  double tip_time_s = 0;  ///< time of the latest image used for `tip`, monotonic
};

/// One press of a gauge's button.
struct GaugePress {
  std::uint32_t number = 0;    ///< ascending; 0: none
  std::uint16_t artefact = 0;  ///< number of the gauge in the cell's list of artefacts, from 1
  double reading_m = 0;
  double time_s = 0;              ///< monotonic, of its arrival
  std::optional<double> sigma_m;  ///< standard deviation of the reading
};

/// Inputs of one cycle. Time and the status of background workers are inputs too: the machine reads
/// neither clocks nor devices.
struct MachineInput {
  double now_s = 0;          ///< monotonic
  double utc_s = 0;          ///< UTC since 1970, for time-dependent effects; never stepped in a run
  std::int64_t unix_ms = 0;  ///< wall clock, used only as the time stamp of results
  model::RobotState robot;   ///< the latest reading; may be the same as in the previous cycle
  model::PlcCommand command;  ///< the latest command, executed once per sequence number
  bool cycle_overrun = false;
  bool probes_recorded = false;           ///< probes are written to the journal
  bool probes_pending = false;            ///< not yet recorded: the journal is being opened
  bool storage_unavailable = false;       ///< not recorded: the journal's disk is not writable
  std::uint16_t background_warnings = 0;  ///< warning bits of the background workers
  bool scene_lost = false;                ///< interference was monitored and no longer is
  bool objects_near = false;              ///< monitored objects are nearer than declared
  bool scene_incomplete = false;          ///< some monitored pairs of objects are not measured
  bool reference_refused = false;         ///< the drift monitor's reference probes disagree
  bool radius_contradicted = false;       ///< the reference contradicts the stated 95 % radius
  bool quarantined = false;               ///< quarantined probes await a person's decision
  bool compensated_twice = false;         ///< the controller compensates what the cell corrects
  std::array<CameraInput, model::kMaxCameras> cameras;
  /// A press that was not handled yet. It waits while a probe of the PLC is recorded.
  std::optional<GaugePress> gauge;
};

/// True if the command refers to camera k, by its number or as one of all.
inline bool IsAddressed(const MachineInput& input, std::size_t k) {
  const std::uint16_t named = input.command.camera;
  return input.cameras[k].configured && (named == 0 || named == k + 1);
}

}  // namespace plumbline
