// Estimation of the instrument frame and the tool tip from measured rows.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

/// Covariance of the frames of a session for one tool: base translation in W [m], base rotation
/// about its origin in W [rad], tip in F [m]; zero for frames that are not free.
using FrameCovariance = Eigen::Matrix<double, 9, 9>;

struct Alignment {
  Model model;
  /// Of each session, and there of each tool of the cell.
  Indexed<SessionIndex, std::vector<FrameCovariance>> covariance;
};

/// Estimates the frames that the cell leaves free for each session, with the effects of `model`
/// acting: the instrument pose (anywhere) and the tip of each tool (up to about 100 mm from the
/// declared one).
///
/// With measured points the search is global: the lifted linear problem
/// p_W = R p_BF + sum_l (R t)_l .. and the 24 right-angled orientations give starting values, and
/// the best is refined by Gauss-Newton with robust weights. With measured ranges only the
/// refinement is done, so the declared pose must be close. If nothing is free, the model is
/// returned unchanged.
///
/// The estimate is the maximum a posteriori under a prior: the tip as declared with 50 mm standard
/// deviation, the base within 5 m and 1 rad of the start. Well distributed rows determine the
/// frames to fractions of a millimetre and the prior is negligible. With a constant tool
/// orientation a shift of the tip cannot be distinguished from the opposite shift of the base; the
/// tip then stays as declared.
/// @return  an error if the rows do not determine the frames
Result<Alignment> AlignFrames(const Dataset& data, const Model& model, int threads);

/// Like AlignFrames, without the covariance.
Result<Model> Align(const Dataset& data, const Model& model, int threads);

/// Warning about frames of a session that the rows do not determine and that therefore stayed as
/// declared (for the tip: a posterior standard deviation above a fifth of the prior's); nullopt if
/// they determine all.
std::optional<std::string> UndeterminedFramesText(const Dataset& data, const Alignment& alignment,
                                                  SessionIndex session);

}  // namespace plumbline::measure
