#include "app/config/loop_config.h"
#include "app/config/toml_reader.h"

namespace plumbline {
namespace {

constexpr std::int64_t kBytesPerMb = 1'000'000;
constexpr NumberRange kProbeSigma{0.001, 10, kMetrePerMm};
constexpr NumberRange kShift{0.001, 100, kMetrePerMm};
constexpr NumberRange kReferenceSd{0, 10, kMetrePerMm};
constexpr NumberRange kProbesPerDay{0.01, 86400};
constexpr NumberRange kFalseAlarms{0.001, 100};
constexpr NumberRange kDiagnosisTimeout{1, 86400};
constexpr NumberRange kMaxChange{0.001, 100, kMetrePerMm};

}  // namespace

LoopConfig LoopFromToml(const TomlTable& table) {
  using Apply = LoopConfig::Apply;
  LoopConfig loop;
  const auto number = [&table](const char* key, NumberRange range, double& into) {
    into = table.Number(key, range).value_or(into);
  };
  loop.enabled = table.Bool("enabled").value_or(loop.enabled);
  loop.session = table.String("session").value_or(loop.session);
  if (loop.session.find_first_of(",\"\n\r") != std::string::npos) {
    table.AddFault("session", "must not hold a comma, a quote or a line end");
  }
  number("probe_sigma_mm", kProbeSigma, loop.probe_sigma_m);
  loop.reference_probes = table.Integer("reference_probes", 0, 100).value_or(loop.reference_probes);
  if (loop.reference_probes > 0 && loop.reference_probes < 5) {
    table.AddFault("reference_probes", "is too few for a reference: 5..100, or 0 for the model");
  }
  number("reference_sd_mm", kReferenceSd, loop.reference_sd_m);
  number("shift_mm", kShift, loop.shift_m);
  number("probes_per_day", kProbesPerDay, loop.probes_per_day);
  number("false_alarms_per_year", kFalseAlarms, loop.false_alarms_per_year);
  loop.diagnose = table.Bool("diagnose").value_or(loop.diagnose);
  loop.probes_before_diagnosis =
      table.Integer("probes_before_diagnosis", 0, 10000).value_or(loop.probes_before_diagnosis);
  number("diagnosis_timeout_s", kDiagnosisTimeout, loop.diagnosis_timeout_s);
  loop.apply = table.OneOf<Apply>("apply", {{"ask", Apply::kAsk}, {"automatic", Apply::kAutomatic}})
                   .value_or(loop.apply);
  number("max_change_mm", kMaxChange, loop.max_change_m);
  if (const auto megabytes = table.Integer("journal_mb", 1, 1'000'000)) {
    loop.journal_bytes = kBytesPerMb * *megabytes;
  }
  return loop;
}

}  // namespace plumbline
