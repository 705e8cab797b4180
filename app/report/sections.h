// Sections of the report as HTML; empty if a section has no content.
#pragma once

#include <string>

#include "app/report/figures.h"
#include "app/report/report.h"

namespace plumbline::report {

/// The verdict with the key figures.
std::string VerdictBlock(const diagnosis::Diagnosis& diagnosis);

/// Residuals with the declared and the corrected model, fitted and held out: RMS, percentiles,
/// maximum.
std::string ErrorTable(const diagnosis::Diagnosis& diagnosis);

/// Each effect's physical meaning, its remedy, its parameters and their plausible ranges.
std::string EffectsBlock(const diagnosis::Diagnosis& diagnosis);

/// Correlation matrix of the parameters; for many parameters, the strongest pairs.
std::string CorrelationBlock(const diagnosis::Diagnosis& diagnosis);

/// Smallest detectable value of each effect.
std::string DetectableTable(const diagnosis::Diagnosis& diagnosis);

/// All candidate effects with the outcome for each, sorted by evidence.
std::string ConsideredTable(const diagnosis::Diagnosis& diagnosis);

std::string RivalText(const diagnosis::Rival& rival);
std::string NextPosesTable(const diagnosis::Diagnosis& diagnosis, const model::CellModel& cell);
std::string NotRecordedList(const diagnosis::Diagnosis& diagnosis);
std::string NotesList(const diagnosis::Diagnosis& diagnosis);
std::string OutlierTable(const diagnosis::Diagnosis& diagnosis);
std::string DataTable(const diagnosis::Diagnosis& diagnosis, const model::CellModel& cell,
                      const ReportSource& source);

/// A group of panels with titles, colour scale and caption.
std::string FigureHtml(const PanelGroup& group);

}  // namespace plumbline::report
