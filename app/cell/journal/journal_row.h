// Row of the measurement journal.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "firmware-like/model/measured_point.h"

namespace plumbline::cell {

/// A measured point with its prediction and its status. t_s of a probe is UTC since the journal's
/// epoch, without jumps while the daemon runs; t_s of an imported row is that of its file.
struct JournalRow : model::MeasuredPoint {
  enum class Source { kPlc, kCamera, kGauge, kImport };
  /// A probe that contradicts the model by more than any plausible effect is quarantined until a
  /// person decides. The numbers are part of the file format.
  enum class Quarantine { kNone = 0, kWaiting = 1, kAccepted = 2, kRejected = 3 };
  std::int64_t id = 0;  ///< assigned by the journal, ascending; 0 before it is written
  Source source = Source::kPlc;
  std::optional<std::int64_t> unix_ms;  ///< wall clock when it was taken; absent for imported rows
  std::string session;
  std::optional<std::uint16_t> command;      ///< sequence of the PLC's command
  std::optional<Vec3> predicted_W;           ///< tip predicted by the model in force [m]
  std::optional<double> predicted_radius_m;  ///< 95 % radius stated for it [m]; absent if none
  std::optional<int> model_version;          ///< of the prediction; absent if there is none
  bool wild = false;                         ///< far from the drift monitor's reference
  bool alarm = false;                        ///< raised the drift alarm
  Quarantine quarantine = Quarantine::kNone;

  /// Whether it counts as a measurement: for the drift monitor, the diagnosis, the export.
  bool counts() const {
    return quarantine == Quarantine::kNone || quarantine == Quarantine::kAccepted;
  }
};

const char* NameOf(JournalRow::Source source);
/// Inverse of NameOf(); kImport for an unknown name.
JournalRow::Source SourceNamed(std::string_view name);

}  // namespace plumbline::cell
