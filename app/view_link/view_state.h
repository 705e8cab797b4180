// What the daemon shows of itself: one moment, for the picture on the monitor and the status page.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "drivers/lateness.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/camera_status.h"
#include "firmware-like/status/monitoring_status.h"

namespace plumbline {

/// Where viewers of a daemon find it.
inline std::string ViewSocketOf(const std::string& state_directory) {
  return state_directory + "/view.socket";
}

/// The image that goes with a state; its pixels lie in shared memory.
struct ViewImage {
  int slot = 0;             ///< of the shared memory
  std::uint32_t stamp = 0;  ///< of the slot when it was filled
  int width = 0, height = 0;
  bool colour = false;         ///< BGR instead of luma; rows without padding
  double time_s = 0;           ///< when it was taken, monotonic
  std::uint64_t sequence = 0;  ///< of the camera
};

struct ViewTag {
  int id = 0;
  std::array<Vec2, 4> corners_px;  ///< from the tag's own top left, clockwise as seen upright
  std::optional<Pose> X_CM;
  bool ambiguous = false;
};

struct ViewBody {
  std::string name;
  Pose X_CK;
  bool ambiguous = false;
};

/// A camera: what it saw, all of one image, and its status.
struct ViewCamera {
  CameraStatus status;  ///< its name, state of the zoom and the lens, prompts, measured tip
  std::string serial, mode;
  std::optional<ViewImage> image;  ///< nothing: none came
  std::optional<Lens> lens;        ///< in use at that image
  std::vector<ViewTag> tags;
  std::vector<ViewBody> bodies;
};

/// A line of the log.
struct ViewLine {
  std::uint64_t number = 0;  ///< counts up from 1 since the start
  double utc_s = 0;
  int level = 5;  ///< of syslog(3)
  std::string text;
};

struct ViewPoint {
  int id = 0;
  bool valid = false, extrapolated = false;
  CorrectionCode code = CorrectionCode::kPending;
  Pose X_BP_command;
  Vec3 translation_B = Vec3::Zero();  ///< command minus wanted position [m]
  double uncertainty_m = 0;           ///< radius that holds 95 % of the landings
  RadiusBasis basis = RadiusBasis::kUnknown;
  JointVector q{};       ///< of the commanded posture [rad] or [m]
  bool taught = false;   ///< the point names the joints where it was taught
  bool differs = false;  ///< the posture is another one
};

/// How the machine cycle keeps its time, since the daemon started.
struct ViewCycle {
  double uptime_s = 0, longest_s = 0;  ///< of computation, without the wait for the robot
  std::uint64_t cycles = 0, late = 0;
  LatenessCounts starts;  ///< of cycles, against their ticks
};

/// One moment of the daemon. SI; times are of the monotonic clock of this computer where not UTC.
struct ViewState {
  double now_s = 0, utc_s = 0;
  std::string version, cell;
  int model_version = 0;  ///< in force; 0: the cell file, not known to the model store
  std::uint16_t status = 0, alarms = 0, warnings = 0;  ///< bits as in the register map
  CellHealth health;
  double data_age_s = 0;  ///< of the robot reading
  ViewCycle cycle;
  JointVector q;  ///< of the last trusted reading; may be empty
  std::optional<double> payload_kg, temp_C;
  Vec3 payload_cog_F = Vec3::Zero();
  std::vector<ViewPoint> points;  ///< in configured order
  MonitoringStatus monitoring;
  std::vector<ViewCamera> cameras;  ///< in configured order; empty: none is configured
  std::vector<ViewLine> lines;      ///< the newest, oldest first
};

/// The k-th camera; where there is none, one that saw nothing.
inline const ViewCamera& CameraOf(const ViewState& state, std::size_t k) {
  static const ViewCamera kNone;
  return k < state.cameras.size() ? state.cameras[k] : kNone;
}

}  // namespace plumbline
