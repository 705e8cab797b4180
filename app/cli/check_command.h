// plumbline check: every fault of a cell or a configuration, and what the cell amounts to.
#pragma once

#include <string>
#include <vector>

#include "app/config/fault.h"
#include "firmware-like/model/cell_model.h"

namespace CLI {
class App;
}

namespace plumbline {

void AddCheckCommand(CLI::App& app, int& exit_code);

/// A line of the summary: what of the cell, and what is known of it.
struct SummaryLine {
  std::string topic, text;
};

/// What a cell amounts to, in the units of its file: arm, tool, masses, compliance, payload,
/// measurement, effects. What is not declared is said as such.
std::vector<SummaryLine> CellSummary(const CellModel& cell);

}  // namespace plumbline
