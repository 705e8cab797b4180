// One row of the measurement journal.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <string>

#include "firmware-like/model/cell_model.h"

namespace plumbline {

/// A measured point with everything that is known of the moment, in SI. What was not recorded is
/// absent (joint vectors: empty), never zero.
struct JournalRow {
  enum class Source { kPlc, kCamera, kImport };
  /// Whether a row is a measurement. A probe that contradicts the model by more than any plausible
  /// effect waits for a person's decision; the numbers stand in the file.
  enum class Quarantine { kNone = 0, kWaiting = 1, kAccepted = 2, kRejected = 3 };
  std::int64_t id = 0;  ///< the journal's number, ascending; 0 before it is written
  Source source = Source::kPlc;
  std::optional<std::int64_t> unix_ms;  ///< wall clock when it was taken; absent for imported rows
  /// Of a probe: UTC since the journal's epoch, even within a run of the daemon. Of an imported
  /// row: as its file has it.
  std::optional<double> t_s;
  std::string session;
  std::optional<std::uint16_t> command;  ///< sequence of the PLC's command
  JointVector q;                         ///< [rad] or [m], as the controller counts them
  JointVector qd, qdd, tau;
  std::optional<double> q_step_rad;  ///< of the registers that q was read from; 0: fine
  std::optional<double> payload_kg;
  std::optional<double> temp_C;
  std::optional<Vec3> predicted_W;   ///< tip by the model in force [m]
  std::optional<Vec3> measured_W;    ///< [m]
  std::optional<Mat3> covariance_W;  ///< of measured_W [m^2]; of a probe by camera
  std::string camera;                ///< that saw it: "side", "side+rear"; empty: it has no name
  std::optional<double> range_m;
  std::optional<Eigen::Quaterniond> orientation_W;
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

}  // namespace plumbline
