// Output files of plumbline diagnose: corrected model, report, proposed poses and JSON.
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "app/cli/diagnose_arguments.h"
#include "app/cli/diagnose_input.h"
#include "app/measure/diagnosis/diagnosis.h"

namespace plumbline::cli {

/// A file to be written at the end, and its content.
struct DiagnoseOutput {
  std::string option, path, text;
};

/// Checks that no output overwrites an input or another output, that all can be written and that
/// a PDF can be made; prints every violation to `err`.
bool CheckDiagnoseOutputs(const DiagnoseArguments& arguments, std::ostream& err);

/// The requested files, the JSON last, so that the files it refers to exist once it appears. One
/// that cannot be made is missing, and `err` receives the reason.
std::vector<DiagnoseOutput> DiagnoseOutputs(const DiagnoseArguments& arguments,
                                            const DiagnoseInput& input,
                                            const measure::Diagnosis& diagnosis, std::ostream& err);

/// Writes each file atomically, and the text of path "-" to `out`.
/// @return  whether all could be written; `err` receives the failures
bool WriteDiagnoseOutputs(const std::vector<DiagnoseOutput>& outputs, std::ostream& out,
                          std::ostream& err);

}  // namespace plumbline::cli
