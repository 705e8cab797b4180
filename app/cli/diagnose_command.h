// plumbline diagnose: identifies the effects that a declared cell lacks, from measured points.
#pragma once

#include <functional>
#include <ostream>

#include "app/cli/diagnose_arguments.h"
#include "app/measure/diagnosis/diagnosis.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddDiagnoseCommand(CLI::App& app, int& exit_code);

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
