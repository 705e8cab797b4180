// Figures of the report as gnuplot scripts, one per panel.
#pragma once

#include <string>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"

namespace plumbline::measure {

/// One panel. The panels of a group are arranged side by side, or stacked on a narrow page.
struct Panel {
  std::string title;  ///< above the panel; plain text
  std::string note;   ///< below the title; may be empty
  std::string script;
  std::string svg;  ///< for embedding in HTML, once drawn; empty if it could not be drawn
};

/// Panels with a common caption.
struct PanelGroup {
  std::vector<Panel> panels;
  std::string caption;       ///< plain text: what is drawn, with scale and units
  std::string colour_end{};  ///< text at the end of the colour scale; empty: colour has no meaning
  int across = 3;            ///< panels beside each other in print: 2, 3 or 6
};

/// Residuals at the measured points with the declared and the corrected model at one scale, then
/// the remaining residuals enlarged, if they would be too small to see; from above, then from the
/// side.
PanelGroup ArrowFigures(const Diagnosis& diagnosis, const model::CellModel& cell);

/// One panel for each of the signals on which the residual depends most, after correction or before
/// it. Each shows the axis of the residual that depends on the signal most.
PanelGroup SignalFigures(const Diagnosis& diagnosis);

/// One panel per joint: amplitude against cycles per turn. Empty if no search was made.
PanelGroup SpectrumFigures(const Diagnosis& diagnosis);

/// Difference between the predictions of the first rivals and of the corrected model, in the cell.
PanelGroup RivalFigures(const Diagnosis& diagnosis, const model::CellModel& cell);

/// The arm in the proposed poses.
PanelGroup NextPoseFigures(const Diagnosis& diagnosis, const model::CellModel& cell);

}  // namespace plumbline::measure
