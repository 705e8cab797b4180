// Arguments of plumbline diagnose.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/report/report.h"

namespace plumbline::cli {

struct DiagnoseArguments {
  std::string cell, measured;
  std::string json;                                 ///< "-": standard output; empty: none
  std::string model;                                ///< empty: none
  std::string report;                               ///< empty: none
  std::string pdf;                                  ///< the report as PDF; empty: none
  measure::CertificateDetails certificate_details;  ///< for the report
  std::string next_poses;  ///< proposed poses; empty: next_poses.csv beside the JSON file
  std::optional<double> time_zero_s;  ///< see DiagnosisOptions
  bool order_unknown = false;         ///< see DiagnosisOptions
  std::vector<std::string> siblings;  ///< folders of other arms of the same model
  int threads = 2;
  bool quiet = false;
};

}  // namespace plumbline::cli
