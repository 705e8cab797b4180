// View state: the daemon's published state at one instant, for display, page and fleet publisher.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/cell/view_link/scene_measurements.h"
#include "drivers/lateness.h"
#include "firmware-like/lens/board_guidance.h"
#include "firmware-like/lens/lens.h"
#include "firmware-like/snapshot.h"
#include "firmware-like/status/camera_status.h"
#include "firmware-like/status/monitoring_status.h"

namespace plumbline::cell {

/// Socket of the view link.
inline std::string ViewSocketOf(const std::string& state_directory) {
  return state_directory + "/view.socket";
}

/// A state older than this is not current: the daemon sends at least five per second.
inline constexpr double kStateOld_s = 1.0;

/// Image that belongs to a state; its pixels are in shared memory.
struct ViewImage {
  int slot = 0;             ///< slot of the shared memory
  std::uint32_t stamp = 0;  ///< the slot's stamp when it was filled
  int width = 0, height = 0;
  bool colour = false;         ///< BGR instead of luma; rows without padding
  double time_s = 0;           ///< time of exposure, monotonic
  std::uint64_t sequence = 0;  ///< frame number of the camera
};

struct ViewTag {
  int id = 0;
  std::array<lens::Vec2, 4> corners_px;  ///< from the tag's own top left, clockwise as seen upright
  std::optional<Pose> X_CM;
  bool ambiguous = false;
};

struct ViewBody {
  std::string name;
  Pose X_CK;
  bool ambiguous = false;
};

/// A camera with its status and the detections in its newest image.
struct ViewCamera {
  status::CameraStatus status;
  std::string serial, mode;
  std::optional<ViewImage> image;  ///< nullopt if there is no image yet
  std::optional<lens::Lens> lens;  ///< the lens in use for that image
  /// Distance from the middle of the image up to which the lens is trusted; nullopt if it is
  /// trusted everywhere.
  std::optional<double> usable_radius_px;
  std::vector<ViewTag> tags;
  std::vector<ViewBody> bodies;
  std::optional<lens::BoardGuidance> guidance;  ///< while the calibration board is captured
};

/// A log line.
struct ViewLine {
  std::uint64_t number = 0;  ///< counted from 1 since the process started
  double utc_s = 0;
  int level = 5;  ///< syslog(3) level
  std::string text;
};

/// Corrected assembly point.
struct ViewPoint {
  int id = 0;
  bool valid = false, extrapolated = false;
  correction::CorrectionCode code = correction::CorrectionCode::kPending;
  Pose X_BP_command;
  Vec3 translation_B = Vec3::Zero();  ///< command position minus target position [m]
  double uncertainty_m = 0;           ///< 95 % radius of the attained position
  model::RadiusBasis basis = model::RadiusBasis::kUnknown;
  model::JointVector q{};  ///< commanded posture [rad] or [m]
  bool taught = false;     ///< the configuration states the joints at which the point was taught
  bool differs = false;    ///< the commanded posture is not the taught one
};

/// Timing of the control cycle since the daemon started.
struct ViewCycle {
  double uptime_s = 0;
  double longest_s = 0;  ///< longest computation, without the wait for the robot
  std::uint64_t cycles = 0, late = 0;
  LatenessHistogram starts;  ///< lateness of cycle starts
};

/// Motion of the arm and what it does to the tip; see motion::MotionStatus.
struct ViewMotion {
  motion::MotionState state = motion::MotionState::kUnknown;
  double age_s = 0;
  model::JointVector sag{};                    ///< joint deflections from the motion [rad] or [m]
  Vec3 acceleration_F = Vec3::Zero();          ///< of the flange [m/s^2]
  Vec3 angular_acceleration_F = Vec3::Zero();  ///< of the flange [rad/s^2]
  double tip_acceleration = 0;                 ///< [m/s^2]
  Vec3 tip_W = Vec3::Zero();                   ///< displacement of the tip [m]
  double radius_m = 0;                         ///< 95 %, noise of the readings only

  /// True if the displacement exceeds the noise of the readings.
  bool resolved() const { return state == motion::MotionState::kMoving && tip_W.norm() > radius_m; }
};

/// State of the daemon at one instant, in SI units. Times are monotonic unless named UTC.
struct ViewState {
  double now_s = 0, utc_s = 0;
  std::string version, cell;
  /// Of the configuration in force: another number says that the daemon has read its files again.
  std::uint64_t generation = 0;
  int model_version = 0;  ///< in force; 0: the cell file, not in the model store
  std::uint16_t status = 0, alarms = 0, warnings = 0;  ///< bits as in the register map
  CellHealth health;
  double data_age_s = 0;  ///< age of the robot reading
  ViewCycle cycle;
  model::JointVector q;  ///< last trusted reading [rad] or [m]; may be empty
  ViewMotion motion;
  std::optional<double> payload_kg, temp_C;
  Vec3 payload_cog_F = Vec3::Zero();
  /// Why the payload is unknown and what to do, if a number that the controller reports is the
  /// reason; else empty.
  std::string payload_problem{}, payload_remedy{};
  /// Why the robot cannot be read and what to do; empty while it can.
  std::string robot_problem{}, robot_remedy{};
  int tool = 0;                   ///< index of the mounted tool, see CellModel::ToolAt
  std::vector<ViewPoint> points;  ///< in configured order
  /// Number of this list, above 0: lists with equal numbers are equal, so that a list is encoded
  /// and sent once, however often the rest changes. Daemon and viewer count independently.
  std::uint64_t points_number = 1;
  status::MonitoringStatus monitoring;
  std::vector<ViewCamera> cameras;         ///< in configured order; empty: no camera configured
  std::optional<SceneMeasurements> scene;  ///< of the virtual objects; nullopt if none are measured
  std::vector<ViewLine> lines;             ///< the newest, oldest first
};

/// The k-th camera, or an empty one if there are fewer.
inline const ViewCamera& CameraOf(const ViewState& state, std::size_t k) {
  static const ViewCamera kNone;
  return k < state.cameras.size() ? state.cameras[k] : kNone;
}

}  // namespace plumbline::cell
