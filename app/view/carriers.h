// Where the things that carry virtual objects are, seen from each camera: the cell, the robot's
// base, the loaded flange, bodies and tags.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>

#include "app/scene/object_table.h"
#include "app/view/view_model.h"
#include "app/view_link/view_state.h"
#include "firmware-like/scene/bend_field.h"

namespace plumbline {

/// A pose, and whether it may have changed since it was measured.
struct PlacedCarrier {
  Pose X_CK;
  bool stale = false;
};

/// What the newest state says of the loaded tool.
struct ToolNow {
  Pose X_WF;          ///< the flange, seated so that the drawn tip is the model's tip
  Pose X_WF_nominal;  ///< of the arm without load, as its controller believes
  BendField bend;
  Vec3 tip_W = Vec3::Zero();          ///< of the loaded tool
  Vec3 tip_nominal_W = Vec3::Zero();  ///< of the straight tool on X_WF_nominal
};

/// @return  nothing where the joints do not fit the model, or the payload is not known
std::optional<ToolNow> ToolOf(const ViewState& state, const ViewModel& model);

/// Poses of one moment, in the frame of one camera.
struct Carriers {
  std::optional<PlacedCarrier> world;  ///< X_CW
  std::optional<PlacedCarrier> base, flange;
  std::map<std::string, PlacedCarrier> bodies;
  std::map<int, PlacedCarrier> tags;
  std::optional<ToolNow> tool;
  double focal_px = 0;      ///< of its lens; 0: not known
  bool lens_stale = true;   ///< the lens does not belong to this zoom, or nobody knows
  bool image_stale = true;  ///< no image, or an old one
  bool robot_stale = true;  ///< no trusted reading of the joints

  const PlacedCarrier* Find(const Carrier& carrier) const;
  /// The same in the measurement frame; nothing where the cell is not seen and it hangs on that.
  std::optional<Pose> InWorld(const Carrier& carrier) const;
};

/// Remembers what one camera saw: a carrier that is hidden for a moment stays where it was, and is
/// stale after kFresh_s; it is forgotten after kForgotten_s, the cell's frame only with the lens,
/// since camera and cell stand still.
class CarrierMemory {
 public:
  static constexpr double kFresh_s = 0.5, kForgotten_s = 3.0, kImageFresh_s = 0.5;

  /// @param model  null: the configuration cannot be read; bodies and tags alone
  /// @param now_s  monotonic, of this computer
  /// @param camera  its number in the state
  Carriers Take(const ViewState& state, std::size_t camera, const ViewModel* model, double now_s);

 private:
  struct Seen {
    Pose X_CK;
    double time_s = 0;
  };
  std::optional<Lens> lens_;
  std::optional<Seen> world_;
  std::map<std::string, Seen> bodies_;
  std::map<int, Seen> tags_;
};

/// What several cameras see, in the measurement frame itself (C is W): a body or tag that more than
/// one sees stands where the camera has it for which a metre there is the most pixels, f / z. It is
/// what distances are measured in. Of one camera it is what that one sees.
Carriers InMeasurementFrame(std::span<const Carriers> cameras);

/// What a camera does not see now and another does is placed where that one has it, by the cell's
/// frame of both: X_AK = X_AW X_BW^-1 X_BK. What it sees itself stays as it sees it, so that the
/// error of the other camera's pose is not in its picture. Nothing is taken from, or given to, a
/// camera whose lens, image or marks are stale.
void ShareSights(std::span<Carriers> cameras);

}  // namespace plumbline
