// Initial instrument frame and tool tips of every session, from the unloaded arm, and their prior.
#pragma once

#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

/// Prior of a session's frames: each tip is the declared one within 100 mm (95 %); the base is
/// within the cell, in any orientation. Negligible along directions that the rows determine; along
/// the others the declared value is kept. Frames that are not free are fixed by an infinite
/// precision.
struct FramePrior {
  Eigen::Matrix<double, 6, 1> base_information =
      Eigen::Matrix<double, 6, 1>::Zero();  ///< 1 / variance; practically infinite if not free
  double tip_information = 0;
  std::vector<Pose> X_FT;  ///< declared, of each tool
};

FramePrior FramePriorOf(const std::vector<Pose>& X_FT, bool frame_free, bool tip_free);

/// Replaces the frames of each session that has measured points by the best of several starting
/// values, refined by Gauss-Newton: the declared ones, those of the lifted linear problem, and the
/// 24 right-angled orientations of the base. Without measured points they stay as they are.
void StartFrames(const Dataset& data, const Indexed<SessionIndex, FramePrior>& priors,
                 Model& model);

}  // namespace plumbline::measure
