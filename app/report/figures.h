// The report's pictures as gnuplot scripts, one panel each.
#pragma once

#include <string>
#include <vector>

#include "app/diagnosis/diagnosis.h"

namespace plumbline {

/// One panel. Panels of a group stand beside each other, and below each other on a narrow page.
struct Panel {
  std::string title;  ///< above the panel; plain text
  std::string note;   ///< below the title; may be empty
  std::string script;
  std::string svg;  ///< as part of a page, once drawn; empty: could not be drawn
};

/// Panels that are read together.
struct PanelGroup {
  std::vector<Panel> panels;
  std::string caption;  ///< plain text: what is drawn, with scale and units
  /// Largest length of the colour scale [mm]; 0 where colour means nothing.
  double colour_to_mm = 0;
};

/// Measured minus model at the measured points, before and after, seen from above and from the
/// side, with one factor; then what remains, enlarged, where it would be too small to see.
std::vector<PanelGroup> ArrowFigures(const Diagnosis& diagnosis, const CellModel& cell);

/// One panel a signal, those that the remaining residual follows most first; of the residual, the
/// axis that follows the signal most.
PanelGroup SignalFigures(const Diagnosis& diagnosis);

/// One panel a joint: amplitude against cycles a turn. Empty where nothing was searched.
PanelGroup SpectrumFigures(const Diagnosis& diagnosis);

/// How far a rival's prediction is from the answer's, row by row and in the cell.
PanelGroup RivalFigures(const Diagnosis& diagnosis, const Rival& rival, const CellModel& cell);

/// The arm in the proposed poses.
PanelGroup NextPoseFigures(const Diagnosis& diagnosis, const CellModel& cell);

}  // namespace plumbline
