// One row of the measurement journal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/model/measured_point.h"

namespace plumbline {

/// A measured point as the journal keeps it: with its prediction, and what became of it. Its t_s
/// is, of a probe, UTC since the journal's epoch, even within a run of the daemon; of an imported
/// row as its file has it.
struct JournalRow : MeasuredPoint {
  enum class Source { kPlc, kCamera, kImport };
  /// Whether a row is a measurement. A probe that contradicts the model by more than any plausible
  /// effect waits for a person's decision; the numbers stand in the file.
  enum class Quarantine { kNone = 0, kWaiting = 1, kAccepted = 2, kRejected = 3 };
  std::int64_t id = 0;  ///< the journal's number, ascending; 0 before it is written
  Source source = Source::kPlc;
  std::optional<std::int64_t> unix_ms;  ///< wall clock when it was taken; absent for imported rows
  std::string session;
  std::optional<std::uint16_t> command;  ///< sequence of the PLC's command
  std::optional<Vec3> predicted_W;       ///< tip by the model in force [m]
  std::string camera;                ///< that saw it: "side", "side+rear"; empty: it has no name
  std::optional<int> model_version;  ///< that predicted; absent: nothing was predicted
  bool wild = false;                 ///< far from the monitor's reference
  bool alarm = false;                ///< it raised the monitor's alarm
  Quarantine quarantine = Quarantine::kNone;

  /// Whether it counts: for the reference, the drift monitor, the diagnosis, the export.
  bool counts() const {
    return quarantine == Quarantine::kNone || quarantine == Quarantine::kAccepted;
  }
};

const char* NameOf(JournalRow::Source source);
/// The reverse; kImport where it is no such name.
JournalRow::Source SourceNamed(std::string_view name);

}  // namespace plumbline
