#include "app/measure/table/replay_file.h"

namespace plumbline::measure {

std::optional<MeasuredTable> ReadReplayFile(const config::DaemonConfig& config,
                                            config::FaultList& faults) {
  const std::string& file = config.robot.replay_file;
  std::optional<MeasuredTable> table =
      ReadTable(file, config.machine.cell.robot.joints, faults, TableUse::kPoses);
  if (table && table->rows.empty()) {
    faults.Add({config::Fault::Severity::kFault, file, 0, "", "has no row that can be replayed"});
    return std::nullopt;
  }
  return table;
}

}  // namespace plumbline::measure
