// Cross-validation folds: by blocks of time, regions of the joint space, sessions, or places of
// artefacts.
#pragma once

#include <string>
#include <vector>

#include "app/measure/diagnosis/data/dataset.h"

namespace plumbline::measure {

/// Assignment of rows to folds; each fold is predicted from all others. Replicates of a pose share
/// a fold.
struct FoldPlan {
  std::string by;       ///< name in the output: "blocks of time"
  PerRow<int> fold_of;  ///< 0..folds-1; -1: never held out
  int folds = 0;        ///< 0 if the rows cannot be divided this way
  /// True if free frames are fitted to the held-out rows, too: no other rows determine the
  /// instrument pose of a session that is left out.
  bool aligned = false;
  /// True if the positions of held-out artefacts are fitted to the held-out rows: no other rows
  /// determine them.
  bool places = false;
};

/// Five folds of four blocks of consecutive rows each, assigned in turn. Tests interpolation
/// between the rows.
FoldPlan BlocksOfTime(const Dataset& data);

/// Up to five regions of the joint space, regardless of payload. Tests prediction beyond the
/// measured poses. k-means with farthest-point initialisation [Gonzalez, Theor. Comput. Sci. 38
/// (1985) 293; Lloyd, IEEE Trans. Inf. Theory 28 (1982) 129], joints scaled by their standard
/// deviation.
FoldPlan RegionsOfJointSpace(const Dataset& data);

/// Two folds: the poses on either side of the median along the line between two distant poses, in
/// the metric of pose_distance.h. Tests prediction at the largest distance that the rows permit.
FoldPlan OppositeHalves(const Dataset& data);

/// One fold per session: tests prediction on another day. No folds if there is only one session.
FoldPlan Sessions(const Dataset& data);

/// Artefacts whose position is estimated, together with those at a known distance from them, up to
/// ten folds; other rows are never held out. Tests prediction at another place. No folds for fewer
/// than three places.
FoldPlan Places(const Dataset& data);

}  // namespace plumbline::measure
