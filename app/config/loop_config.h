// [loop] of plumbline.toml: probes, drift monitor, diagnosis, model.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace plumbline {

class TomlTable;

struct LoopConfig {
  enum class Apply { kAsk, kAutomatic };
  bool enabled = false;
  std::string session;          ///< written to every probe, with a mark of the boot
  double probe_sigma_m = 5e-5;  ///< scatter of one probe, one axis
  int reference_probes = 20;    ///< 0: the model itself is the reference
  double reference_sd_m = 0;    ///< of 0: how far the model's mean residual may be from zero
  double shift_m = 3e-4;        ///< change that shall be found quickly
  double probes_per_day = 24;
  double false_alarms_per_year = 1;
  bool diagnose = true;              ///< run the diagnosis after an alarm
  int probes_before_diagnosis = 10;  ///< since the change began
  double diagnosis_timeout_s = 3600;
  Apply apply = Apply::kAsk;
  /// Of a measured tip and of a configured point's command, for an automatic application.
  double max_change_m = 1e-3;
  std::int64_t journal_bytes = 1'000'000'000;  ///< then probes are refused
};

LoopConfig LoopFromToml(const TomlTable& table);

}  // namespace plumbline
