// The report's sections as HTML; an empty text where there is nothing to say.
#pragma once

#include <string>

#include "app/report/figures.h"
#include "app/report/report.h"

namespace plumbline {

/// The verdict in words, with the numbers that matter.
std::string VerdictBlock(const Diagnosis& diagnosis);

/// Error before and after, fitted and held out, with medians and largest.
std::string ErrorTable(const Diagnosis& diagnosis);

/// What each effect is on the machine, what to do about it, its parameters and their plausibility.
std::string EffectsBlock(const Diagnosis& diagnosis);

/// Correlations of the parameters as a heat table; of many, the strongest pairs.
std::string CorrelationBlock(const Diagnosis& diagnosis);

/// What size of each effect would have been seen.
std::string DetectableTable(const Diagnosis& diagnosis);

/// Every candidate and what became of it, sorted by evidence.
std::string ConsideredTable(const Diagnosis& diagnosis);

std::string RivalText(const Rival& rival);
std::string NextPosesTable(const Diagnosis& diagnosis, const CellModel& cell);
std::string NotRecordedList(const Diagnosis& diagnosis);
std::string NotesList(const Diagnosis& diagnosis);
std::string OutlierTable(const Diagnosis& diagnosis);
std::string DataTable(const Diagnosis& diagnosis, const CellModel& cell,
                      const ReportSource& source);

/// The panels with their titles, the colour scale and the caption.
std::string FigureHtml(const PanelGroup& group);

}  // namespace plumbline
