// Poses of the carriers of virtual objects (cell, robot base, loaded flange, bodies, tags) in each
// camera's frame.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "app/base/config/daemon_config.h"
#include "app/base/config/fault.h"
#include "app/cell/scene/object_table.h"
#include "app/cell/view_link/view_state.h"
#include "firmware-like/deflection/loaded_arm.h"
#include "firmware-like/scene/bend_field.h"

namespace plumbline::cell {

struct ViewModel {
  config::DaemonConfig config;
  deflection::LoadedArm arm;
  int version = 0;  ///< in the model store; 0: the cell file
};

/// Reads the configuration with the model version that the daemon reports as in force. Writes
/// nothing: the model store belongs to the daemon.
/// @param version  ViewState::model_version; 0 for the cell file named by the
///                 configuration
/// @return         nullopt if the configuration, a file it names or that version has a fault
std::optional<ViewModel> ReadViewModel(const std::string& path, int version,
                                       config::FaultList& faults);

/// Pose of a carrier in the camera frame.
struct PlacedCarrier {
  Pose X_CK;
  bool stale = false;  ///< the carrier may have moved since it was measured
};

/// Loaded tool in the newest state, bent by weight and, while the robot moves, by its acceleration
/// as far as the readings resolve it.
struct ToolState {
  Pose X_WF;          ///< flange, placed so that the drawn tip coincides with the model's tip
  Pose X_WF_nominal;  ///< flange of the unloaded arm, as the controller assumes it
  std::vector<Pose> links_W;  ///< frame of each link of the deflected arm
  scene::BendField bend;
  Vec3 tip_W = Vec3::Zero();          ///< tip of the loaded tool
  Vec3 tip_nominal_W = Vec3::Zero();  ///< tip of the straight tool on X_WF_nominal
};

/// @return  nullopt if the joints do not fit the model or the payload is unknown
std::optional<ToolState> ComputeToolState(const ViewState& state, const ViewModel& model);

/// Carrier poses at one instant, in the frame of one camera.
struct Carriers {
  std::optional<PlacedCarrier> world;  ///< X_CW
  std::optional<PlacedCarrier> base, flange;
  std::vector<PlacedCarrier> links;  ///< empty if their poses are unknown
  std::map<std::string, PlacedCarrier> bodies;
  std::map<int, PlacedCarrier> tags;
  std::optional<ToolState> tool;
  /// Places base, links and flange from the pose of the world and the state of the tool.
  void PlaceArm(const ViewModel& model);

  double focal_px = 0;      ///< focal length of the camera's lens; 0: unknown
  bool lens_stale = true;   ///< the lens is not verified at the present zoom
  bool image_stale = true;  ///< there is no image, or it is too old
  bool robot_stale = true;  ///< there is no trusted joint reading

  /// @return  null if the carrier has no pose
  const PlacedCarrier* Find(const Carrier& carrier) const;
  /// Pose in the measurement frame W.
  /// @return  nullopt if the pose is unknown or stale, or depends on a cell frame that is
  std::optional<Pose> InWorld(const Carrier& carrier) const;
};

/// Last known carrier poses of one camera. A hidden carrier keeps its pose, becomes stale after
/// kFresh_s and is dropped after kForgotten_s. The cell frame is dropped only with the lens, since
/// camera and cell do not move relative to each other.
class CarrierTracker {
 public:
  static constexpr double kFresh_s = 0.5, kForgotten_s = 3.0, kImageFresh_s = 0.5;

  /// @param camera  index in the state
  /// @param model   null if the configuration cannot be read; then only bodies and tags are placed
  /// @param now_s   monotonic clock of this computer
  Carriers Update(const ViewState& state, std::size_t camera, const ViewModel* model, double now_s);

 private:
  struct Seen {
    Pose X_CK;
    double time_s = 0;
  };
  std::optional<lens::Lens> lens_;
  std::optional<Seen> world_;
  std::map<std::string, Seen> bodies_;
  std::map<int, Seen> tags_;
};

/// Merges the detections of all cameras in the measurement frame (C is W); distances are measured
/// in the result. If several cameras see a body or tag, the one with the highest image resolution
/// there, f / z, determines its pose.
Carriers MergeInMeasurementFrame(std::span<const Carriers> cameras);

/// Fills in carriers that one camera does not see from another that does, through the cell frame
/// of both: X_AK = X_AW X_BW^-1 X_BK. A camera's own detections are never replaced, so that the
/// other camera's pose error does not enter its picture. Cameras whose lens, image or cell tags
/// are stale neither contribute nor receive.
void ShareDetections(std::span<Carriers> cameras);

}  // namespace plumbline::cell
