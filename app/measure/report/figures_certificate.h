// Figures of the report's first page.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/report/achieved_accuracy.h"
#include "app/measure/report/certificate_layout.h"
#include "app/measure/report/figures.h"

namespace plumbline::measure {

/// One panel as wide as the page, or two beside each other, with a sentence that states what they
/// show.
struct CertificateFigure {
  std::string title, sentence;  ///< plain text
  std::vector<Panel> panels;    ///< none if there is nothing to show
};

/// Error at each measured pose with its expanded uncertainty, one panel each before and after
/// correction, and the tolerance. No panel if there are no errors.
/// @param tolerance_m  [m]; absent if none was stated
/// @param height       of the panel [px]
CertificateFigure PointsFigure(const AchievedAccuracy& achieved, std::optional<double> tolerance_m,
                               int height = FigureHeights{}.points);

/// The residual against the signal that decides the verdict, one panel each before and after
/// correction, at one scale. If the cause is unknown, the signal is its driver. Otherwise it is the
/// signal and the direction whose binned means explain most of the residual before correction; the
/// directions are x, y, z of W and, if the base is known, radial and tangential to its axis. No
/// panel if no signal was recorded.
/// @param height  of the panel [px]
CertificateFigure DecidingFigure(const Diagnosis& diagnosis, const model::CellModel& cell,
                                 int height = FigureHeights{}.deciding);

}  // namespace plumbline::measure
