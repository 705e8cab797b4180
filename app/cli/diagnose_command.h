// plumbline diagnose: what the declared cell lacks, by points that were measured.
#pragma once

#include <functional>
#include <ostream>
#include <string>

#include "app/diagnosis/diagnosis.h"

namespace CLI {
class App;
}

namespace plumbline {

void AddDiagnoseCommand(CLI::App& app, int& exit_code);

struct DiagnoseArguments {
  std::string cell, measured;
  std::string json;        ///< "-": standard output; empty: none
  std::string model;       ///< empty: none
  std::string report;      ///< empty: none
  std::string next_poses;  ///< empty: next_poses.csv beside the JSON file, where poses are proposed
  std::optional<double> time_zero_s;  ///< see DiagnosisOptions
  bool order_unknown = false;         ///< likewise
  int threads = 2;
  bool quiet = false;
};

using DiagnosisEngine =
    std::function<Result<Diagnosis>(const CellModel&, MeasuredTable, const DiagnosisOptions&)>;

/// Reads, asks the engine, writes every file as a whole, tells the summary. SIGINT and SIGTERM end
/// it early; then no file has changed.
/// @param out  summary, or the JSON of `-` (then the summary goes to `err`)
/// @param err  faults and progress
/// @return     exit code
int RunDiagnose(const DiagnoseArguments& arguments, const DiagnosisEngine& engine,
                std::ostream& out, std::ostream& err);

}  // namespace plumbline
