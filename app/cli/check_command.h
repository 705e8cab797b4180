// plumbline check: reports every fault of a cell or configuration file, and a summary of the cell.
#pragma once

#include <string>
#include <vector>

#include "app/base/config/fault.h"
#include "firmware-like/model/cell_model.h"

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddCheckCommand(CLI::App& app, int& exit_code);

/// One line of the summary.
struct SummaryLine {
  std::string topic, text;
};

/// Summary of a cell in the units of its file: arm, tool, masses, compliance, payload, measurement,
/// effects. States explicitly what is not declared.
std::vector<SummaryLine> CellSummary(const model::CellModel& cell);

}  // namespace plumbline::cli
