// Postures that do not fit the others, whatever the relation between controller and cell is.
#pragma once

#include <functional>
#include <vector>

#include "app/measure/controller/relation_fit.h"

namespace plumbline::measure {

/// A posture of a sample that contradicts the relation which the other postures have in common.
struct OutlyingRow {
  std::size_t row = 0;    ///< index into the postures of the sample
  int line = 0;           ///< of its file; 0: none
  PoseError error;        ///< of its reported pose, from where that relation puts it
  double chi_square = 0;  ///< of that error, with the resolution and the uncertainty of the fit
};

/// Looks for a relation that all but a few postures have in common. Each relation is fitted to
/// random sets of six postures [consensus sampling: M. Fischler, R. Bolles, Comm. ACM 24 (1981)
/// 381]; a posture belongs to it if the fit predicts its numbers (chi-square at 1e-8). At most one
/// posture in four may be left out, and six have to stay.
/// @param relations  of one each
/// @param go_on      called now and then; returns false to stop
/// @return           the postures left out by the relation that leaves out fewest; empty if none
///                   does with so few, or with none
std::vector<OutlyingRow> FindOutlyingRows(const RelationFitter& fitter,
                                          const std::vector<Relation>& relations,
                                          const std::function<bool(double share)>& go_on);

/// The sample without some of its rows.
ControllerSample Without(const ControllerSample& sample, const std::vector<OutlyingRow>& rows);

}  // namespace plumbline::measure
