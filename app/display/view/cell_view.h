// The cell in three dimensions, as shown without a camera: viewpoint, and solids of arm and tool.
#pragma once

#include <Eigen/Geometry>
#include <set>

#include "app/cell/scene/carriers.h"
#include "firmware-like/scene/display_list.h"

namespace plumbline::display {

/// A viewpoint from which the arm is visible in its present posture and at every assembly point. It
/// moves only when something leaves the region seen so far, never with each movement of the arm.
class Viewpoint {
 public:
  /// @return  X_CW for PlainLens, three quarters from the front and slightly above
  Pose Update(const cell::ViewState& state, const cell::ViewModel& model);

 private:
  int version_ = -1;  ///< of the model that `seen_W_` belongs to
  Eigen::AlignedBox3d seen_W_;
};

/// World, base and flange as seen from a viewpoint instead of by a camera.
cell::Carriers SeenFrom(const Pose& X_CW, cell::Carriers carriers, const cell::ViewModel& model);

/// Adds the arm: for each joint a hub about its axis, and for each link the offsets d and a of its
/// row of the Denavit-Hartenberg table as rods. A grey arm is in the posture of the last reading.
/// @param carriers  from SeenFrom()
/// @param declared  numbers of the links that have a mesh, which are left out
/// @param centres_C  receives points along the arm's axes
void AddArm(const cell::ViewState& state, const cell::ViewModel& model,
            const cell::Carriers& carriers, const std::set<int>& declared, scene::DisplayList& list,
            std::vector<Vec3>& centres_C);

/// Adds the mounted tool as rods of the outermost fibre of each segment, bent as the list states.
void AddTool(const cell::ViewState& state, const cell::ViewModel& model,
             const cell::Carriers& carriers, scene::DisplayList& list);

}  // namespace plumbline::display
