// Detection of gross errors: mistakes in the data or the cell that no effect should explain.
#pragma once

#include <optional>
#include <string>

#include "app/measure/diagnosis/data/dataset.h"
#include "app/measure/diagnosis/linear/linearisation.h"

namespace plumbline::measure {

/// No effect moves the median row farther than this.
inline constexpr double kGross_m = 0.025;
/// A mistake explains the data if correcting it reduces the median residual below this share.
inline constexpr double kExplainedRatio = 0.2;

struct GrossMistake {
  std::string sentence;    ///< with the evidence and a remedy
  bool row_order = false;  ///< measurements and joint readings are not of the same row
};

/// Corrects every known mistake (mistakes.h) in turn, aligns the frames, and compares the median
/// distance r_m of the measured from the predicted points with the distance r of the uncorrected
/// data.
///  - A column whose unit changes from one line on is tried first (unit_change_search.h).
///  - If r > 25 mm, more than effects move the median row, the data are refused. (A base rotated by
///  one degree, which base_frame considers plausible, reaches this limit; it is reported instead of
///  corrected.) The mistake with the smallest r_m is named if r_m < r / 5. A fit of tip or base
///  must be better by a factor of 1.5 than a hypothesis without free parameters. The ratio 1/5 is a
///  judgement, not a quantile; it matters little, since the best hypothesis is named together with
///  its figures.
///  - If r is smaller, a mistake without free parameters is named if correcting it reduces the
///  residual to the noise (RobustSigma < 1.5 sigma) from at least three times the noise.
/// @return  nullopt if the residual is no larger than effects can be and no mistake explains all of
/// it
std::optional<GrossMistake> GrossError(const Dataset& data, const Linearisation& aligned,
                                       int threads);

/// The declared cell with its free frames fitted to the rows.
struct DeclaredFit {
  Model model;
  Linearisation linear;
  std::optional<GrossMistake> mistake;
};

/// Fits the declared cell and looks for gross errors (GrossError).
/// @return  an error if the fit fails
Result<DeclaredFit> FitDeclared(const Dataset& data, int threads);

/// Detects a unit change that explains gross errors: as read, some measured points are at least 25
/// mm (kGross_m) from the predicted ones; with the column converted from one line on, or up to it,
/// the median distance of the converted rows falls below a fifth, and at most one row in ten
/// remains gross. The line minimises the loss sum_k min(r_k, 25 mm) of the distances r_k, as read
/// on one side and converted on the other. If several columns qualify, the one with the smallest
/// loss is reported.
/// @return  a sentence with column, line, evidence and remedy
std::optional<std::string> ChangedUnit(const Dataset& data, int threads);

}  // namespace plumbline::measure
