// Input files of plumbline diagnose: cell, rows and siblings.
#pragma once

#include <cstddef>
#include <ostream>
#include <string>
#include <vector>

#include "app/cli/diagnose_arguments.h"
#include "app/measure/siblings/sibling_prior.h"
#include "app/measure/table/csv.h"
#include "firmware-like/model/cell_model.h"
#include "firmware-like/result.h"

namespace plumbline::cli {

/// Content of the input files of plumbline diagnose.
struct DiagnoseInput {
  std::string cell_text;
  std::string data_sha256;
  model::CellModel cell;
  measure::MeasuredTable measured;  ///< moved into the diagnosis
  std::size_t rows = 0;
  std::vector<int> unreadable_lines;
  std::vector<measure::Arm> siblings;
};

/// Reads all input files. Faults of the cell and of the rows are printed to `err`; the error is
/// then empty.
Result<DiagnoseInput> ReadDiagnoseInput(const DiagnoseArguments& arguments, std::ostream& err);

}  // namespace plumbline::cli
