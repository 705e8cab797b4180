// plumbline diagnose: identifies the effects that a declared cell lacks, from measured points.
#pragma once

#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/measure/diagnosis/result/diagnosis.h"
#include "app/measure/report/report.h"
#include "app/measure/siblings/installed_prior.h"

namespace plumbline::cli {

struct DiagnoseArguments {
  std::string cell, measured;
  std::string json;                                 ///< "-": standard output; empty: none
  std::string model;                                ///< empty: none
  std::string report;                               ///< empty: none
  std::string pdf;                                  ///< the report as PDF; empty: none
  measure::CertificateDetails certificate_details;  ///< for the report
  std::string next_poses;  ///< proposed poses; empty: next_poses.csv beside the JSON file
  std::optional<double> time_zero_s;          ///< see DiagnosisOptions
  bool order_unknown = false;                 ///< see DiagnosisOptions
  std::vector<std::string> siblings;          ///< folders of other arms of the same model
  std::string prior = measure::kPriorFolder;  ///< folder or file; empty: no prior
  std::string prior_keys = measure::kPriorKeyFolder;
  std::string arm_out;   ///< for `plumbline prior`; empty: none
  std::string arm_name;  ///< in that file; empty: the robot's name
  int threads = 2;
  bool details = false;  ///< the summary shows everything
  bool quiet = false;
};

using DiagnosisEngine = std::function<Result<measure::Diagnosis>(
    const model::CellModel&, measure::MeasuredTable, const measure::DiagnosisOptions&)>;

/// Reads the input, runs the engine, writes every file atomically and prints the summary. SIGINT
/// and SIGTERM cancel it; no file is changed then.
/// @param out  receives the summary, or the JSON if --json is `-` (the summary then goes to `err`)
/// @param err  receives faults and progress
/// @return     the exit code
int RunDiagnose(const DiagnoseArguments& arguments, const DiagnosisEngine& engine,
                std::ostream& out, std::ostream& err);

}  // namespace plumbline::cli
