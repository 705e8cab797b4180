// Frames of an instrument and tip of a tool, found from the rows alone.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/diagnosis/linearisation.h"

namespace plumbline {

struct Alignment {
  Model model;
  /// Of each session's frames: base shift in W [m], base turn about its origin in W [rad], tip in F
  /// [m]; zero where not free.
  Indexed<SessionIndex, Eigen::Matrix<double, 9, 9>> covariance;
};

/// Finds what the cell leaves free, for each session: the instrument's pose (any) and the tip
/// (the declared one may be 100 mm off), the effects of `model` acting. Of points globally: the
/// lifted linear problem p_W = R p_F + sum_l (R t)_l .. gives a start, the 24 right-angled poses
/// are others, and the best is kept. It is polished by Gauss-Newton on robust weights; of ranges
/// that is all, so that the declared pose must be near. Nothing is changed where the cell leaves
/// nothing free.
///
/// The estimate is the most probable one under a prior: the tip as declared to 50 mm, the base
/// anywhere within 5 m and 1 rad of the start (one standard deviation). Rows determine frames to
/// fractions of a millimetre, where the prior has no say; rows of one orientation leave a shift of
/// the tip and the opposite shift of the base open, and then the tip stays as declared.
/// @return  an error where the rows cannot hold the frames
Result<Alignment> AlignedFrames(const Dataset& data, const Model& model, int threads);

/// The model alone.
Result<Model> Aligned(const Dataset& data, const Model& model, int threads);

/// What the rows of a session did not determine, so that it stayed as declared (a posterior
/// deviation above a fifth of the prior's for the tip); nothing where they determine all.
std::optional<std::string> WhatStaysDeclared(const Dataset& data, const Alignment& alignment,
                                             SessionIndex session);

}  // namespace plumbline
