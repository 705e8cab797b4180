#include <catch2/catch.hpp>

#include "app/base/config/monitoring_config.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::monitoring_reader_test {

using namespace plumbline::config;

namespace {

MonitoringConfig Read(const std::string& lines, FaultList& faults) {
  TomlDocument document("[monitoring]\n" + lines, "plumbline.toml", faults);
  MonitoringConfig monitoring = MonitoringFromToml(*document.Root().RequiredTable("monitoring"));
  document.ReportUnknownKeys();
  return monitoring;
}

}  // namespace

TEST_CASE("[monitoring] is read, in SI") {
  FaultList faults;
  const MonitoringConfig monitoring = Read(
      "enabled = true\nsession = \"a\"\nprobe_sigma_mm = 0.1\nreference_probes = 30\n"
      "reference_sd_mm = 0.02\nshift_mm = 0.5\nprobes_per_day = 1440.0\n"
      "false_alarms_per_year = 0.5\ndiagnose = false\nprobes_before_diagnosis = 3\n"
      "diagnosis_timeout_s = 60.0\napply = \"automatic\"\nmax_change_mm = 2.0\njournal_mb = 50\n",
      faults);
  CHECK(faults.All().empty());
  CHECK(monitoring.enabled);
  CHECK(monitoring.session == "a");
  CHECK(monitoring.probe_sigma_m == Approx(1e-4));
  CHECK(monitoring.reference_probes == 30);
  CHECK(monitoring.reference_sd_m == Approx(2e-5));
  CHECK(monitoring.shift_m == Approx(5e-4));
  CHECK(monitoring.probes_per_day == 1440);
  CHECK(monitoring.false_alarms_per_year == 0.5);
  CHECK_FALSE(monitoring.diagnose);
  CHECK(monitoring.probes_before_diagnosis == 3);
  CHECK(monitoring.diagnosis_timeout_s == 60);
  CHECK(monitoring.apply == MonitoringConfig::Apply::kAutomatic);
  CHECK(monitoring.max_change_m == Approx(2e-3));
  CHECK(monitoring.journal_bytes == 50'000'000);
}

TEST_CASE("each faulty field of [monitoring] gives its message") {
  const std::pair<const char*, const char*> cases[] = {
      {"enabled = 1", "monitoring.enabled"},
      {"session = \"a,b\"", "must not contain a comma"},
      {"probe_sigma_mm = 0.0", "outside 0.001..10"},
      {"reference_probes = 3", "too few"},
      {"reference_probes = 101", "outside 0..100"},
      {"reference_sd_mm = -1.0", "outside 0..10"},
      {"shift_mm = 1000.0", "outside 0.001..100"},
      {"probes_per_day = 0.0", "outside 0.01..86400"},
      {"false_alarms_per_year = 0.0", "outside 0.001..100"},
      {"diagnose = \"yes\"", "monitoring.diagnose"},
      {"probes_before_diagnosis = -1", "outside 0..10000"},
      {"diagnosis_timeout_s = 0.0", "outside 1..86400"},
      {"apply = \"always\"", "is not one of"},
      {"max_change_mm = 0.0", "outside 0.001..100"},
      {"journal_mb = 0", "outside 1..1000000"},
      {"enable = true", "did you mean \"enabled\""},
  };
  for (const auto& [line, told] : cases) {
    CAPTURE(line);
    FaultList faults;
    Read(std::string(line) + "\n", faults);
    CHECK(faults.HasFaults());
    CHECK_THAT(FaultsText(faults), Catch::Contains(told) && Catch::Contains("plumbline.toml:2"));
  }
}

}  // namespace plumbline::monitoring_reader_test
