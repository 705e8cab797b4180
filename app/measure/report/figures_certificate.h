// Figures of the report's first page.
#pragma once

#include <optional>
#include <string>

#include "app/measure/report/achieved_accuracy.h"
#include "app/measure/report/certificate_layout.h"
#include "app/measure/report/figures.h"

namespace plumbline::measure {

/// A large panel with a sentence that states what it shows.
struct CertificateFigure {
  Panel panel;
  std::string sentence;  ///< plain text
};

/// Error at each measured pose before and after correction with its expanded uncertainty, and the
/// tolerance. The axis is logarithmic if the errors before correction would otherwise press those
/// after it against the axis. Empty panel if there are no errors.
/// @param tolerance_m  [m]; absent if none was stated
/// @param height       of the panel [px]
CertificateFigure PointsFigure(const AchievedAccuracy& achieved, std::optional<double> tolerance_m,
                               int height = FigureHeights{}.points);

/// The residual against the signal that decides the verdict, before and after correction at one
/// scale. If the cause is unknown, the signal is its driver. Otherwise it is the signal and the
/// direction whose binned means explain most of the residual before correction; the directions are
/// x, y, z of W and, if the base is known, radial and tangential to its axis. Empty panel if no
/// signal was recorded.
/// @param height  of the panel [px]
CertificateFigure DecidingFigure(const Diagnosis& diagnosis, const model::CellModel& cell,
                                 int height = FigureHeights{}.deciding);

}  // namespace plumbline::measure
