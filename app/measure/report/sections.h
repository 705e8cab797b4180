// Sections of the report as HTML; empty if a section has no content.
#pragma once

#include <string>
#include <vector>

#include "app/measure/report/figures.h"
#include "app/measure/report/report.h"

namespace plumbline::measure {

/// Why a correction was withheld, an effect is in doubt, or a check failed.
std::vector<std::string> Reservations(const Diagnosis& diagnosis);

/// Time of the measurement: that of the rows if its origin is known, otherwise as stated; empty if
/// it is not.
std::string MeasuredText(const Diagnosis& diagnosis, const CertificateDetails& details);

/// Residuals with the declared and the corrected model, fitted and held out: RMS, percentiles,
/// maximum.
std::string ErrorTable(const Diagnosis& diagnosis);

/// Each effect's physical meaning, its remedy, its parameters and their plausible ranges.
std::string EffectsBlock(const Diagnosis& diagnosis);

/// RMS displacement of the tip by one value of an effect [mm]; empty for a shape.
std::string OffsetAtTheTip(const Finding& finding, std::size_t value);

/// The most strongly correlated pairs of parameters, or that there are none.
std::string CorrelationBlock(const Diagnosis& diagnosis);

/// All candidate effects, sorted by evidence, each with its smallest detectable displacement; then
/// those that were not considered, by reason.
std::string ConsideredTable(const Diagnosis& diagnosis);

/// Dependence of the residual on each signal.
std::string SignalsTable(const Diagnosis& diagnosis);

std::string RivalsTable(const Diagnosis& diagnosis);
std::string NextPosesTable(const Diagnosis& diagnosis, const model::CellModel& cell);
/// The notes, except for those that are among the reservations.
std::string RemarksList(const Diagnosis& diagnosis);
std::string OutlierTable(const Diagnosis& diagnosis);
/// What the certificate does not say about the rows and their noise.
std::string DataTable(const Diagnosis& diagnosis, const ReportSource& source);

/// A group of panels with titles, colour scale and caption.
std::string FigureHtml(const PanelGroup& group);

}  // namespace plumbline::measure
