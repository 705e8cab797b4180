// Monitoring configuration, [monitoring] of plumbline.toml: probes, drift monitor, diagnosis,
// model.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace plumbline::config {

class TomlTable;

struct MonitoringConfig {
  enum class Apply { kAsk, kAutomatic };
  bool enabled = false;
  std::string session;          ///< label of every probe; the boot number is added
  double probe_sigma_m = 5e-5;  ///< standard deviation of one probe, per axis
  int reference_probes = 20;    ///< 0: the model itself is the reference
  /// Standard deviation of the model's mean residual, used if `reference_probes` is 0.
  double reference_sd_m = 0;
  double shift_m = 3e-4;  ///< size of the change to be detected quickly
  double probes_per_day = 24;
  double false_alarms_per_year = 1;
  bool diagnose = true;              ///< run the diagnosis after a drift alarm
  int probes_before_diagnosis = 10;  ///< since the change began
  double diagnosis_timeout_s = 3600;
  Apply apply = Apply::kAsk;
  /// Largest change of a measured tip or of a configured point's command for which a model is
  /// applied automatically.
  double max_change_m = 1e-3;
  std::int64_t journal_bytes = 1'000'000'000;  ///< probes are refused when the journal is full
};

MonitoringConfig MonitoringFromToml(const TomlTable& table);

}  // namespace plumbline::config
