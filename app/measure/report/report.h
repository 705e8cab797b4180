// Diagnosis report as one self-contained HTML file.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/report/gnuplot.h"

namespace plumbline::measure {

/// Details of the measurement that neither cell nor rows contain. An empty text is reported as not
/// stated; the approver's is a line to be filled in by hand.
struct CertificateDetails {
  std::optional<double> tolerance_m{};  ///< largest permitted error of a pose; absent if not stated
  std::string number{};                 ///< of the certificate
  std::string robot_serial{}, site{};
  std::string measured_on{};  ///< date of the measurement, for rows whose time has no known origin
  std::string instrument{}, instrument_serial{};
  std::string calibration{};  ///< reference to the instrument's calibration
  std::string approved_by{};
};

/// Origin of the data and of the report.
struct ReportSource {
  std::string cell_file, data_file;  ///< names without folders
  int rows = 0;
  std::vector<int> unreadable_lines;
  std::string version;  ///< program version
  std::string utc{};    ///< time at which the report was written, ISO 8601
  std::string cell_sha256{}, data_sha256{};
  /// Fingerprints of the declared and of the corrected model (config/model_fingerprint.h); empty:
  /// unknown, or no corrected cell was written.
  std::string declared_fingerprint{}, corrected_fingerprint{};
  CertificateDetails certificate_details{};
};

/// Formats the report: a certificate on the first page, then an appendix; without scripts or
/// external references. If gnuplot fails, a note with a remedy replaces the figures.
std::string ReportHtml(const Diagnosis& diagnosis, const model::CellModel& cell,
                       const ReportSource& source, const GnuplotOptions& gnuplot = {});

}  // namespace plumbline::measure
