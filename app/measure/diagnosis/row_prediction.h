// Residual of a row by its kind of observation, from the predicted TCP pose.
#pragma once

#include "app/measure/diagnosis/linearisation.h"

namespace plumbline::measure {

/// The predicted TCP at a row.
struct TipAtRow {
  const deflection::Sensitivity& at;  ///< gradients are valid only if requested
  const effects::Influence<double>& influence;
  Eigen::Matrix<double, 3, 9> frames;  ///< d tip / d (base translation, base rotation, tip)
  bool gradients = false;              ///< whether to set the row's gradient
};

/// Sets residual, gradient and derivatives with respect to the nuisances of a row:
///   position     r = measured - p_WT, with the errors of the instrument
///   orientation  r = rotation vector of R_measured (R_WT R_FT)^T
///   range        r = measured - ((1 + scale) |p - anchor| + zero)
///   point        r = a - p
///   sphere       r = radius - |p - a|
///   plane        r = n . (a - p)
///   gauge        r = reading - d . (p - a)
/// with p the TCP and a the artefact's position. Rows on an artefact involve no errors of an
/// instrument's frame; an artefact of the base frame moves with the base.
void SetRow(const Dataset& data, const Model& model, RowIndex row, const TipAtRow& tip,
            LinearRow& result, Gradient& gradient);

}  // namespace plumbline::measure
