// Ways to hold rows out: blocks of time, regions of the joint space, sessions.
#pragma once

#include <string>
#include <vector>

#include "app/diagnosis/dataset.h"

namespace plumbline::diagnosis {

/// Which rows are predicted together from all others. Rows of one cluster (repeats of a pose) share
/// a fold.
struct FoldPlan {
  std::string by;       ///< "blocks of time", as answers print it
  PerRow<int> fold_of;  ///< 0..folds-1
  int folds = 0;        ///< 0: the rows allow none
  /// Frames that the cell leaves free are fitted to the held-out rows too: a session left out has
  /// no other rows to say where its instrument stood.
  bool aligned = false;
};

/// Five folds of four blocks of consecutive rows each, dealt in turn: prediction between the rows.
FoldPlan BlocksOfTime(const Dataset& data);

/// Up to five regions of the joint space, of distinct poses whatever their load: prediction beyond
/// the rows. k-means from the farthest
/// points [Gonzalez, Theor. Comput. Sci. 38 (1985) 293; Lloyd, IEEE Trans. Inf. Theory 28 (1982)
/// 129], joints scaled by their standard deviation.
FoldPlan RegionsOfJointSpace(const Dataset& data);

/// Two folds: the distinct poses on either side of the median along the line between two poses far
/// apart, as pose_distance.h counts distances. Prediction as far as the rows allow to test it.
FoldPlan OppositeHalves(const Dataset& data);

/// One fold a session: prediction of another day. No folds where there is one session.
FoldPlan Sessions(const Dataset& data);

}  // namespace plumbline::diagnosis
