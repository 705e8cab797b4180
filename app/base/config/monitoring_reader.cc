#include "app/base/config/daemon_settings.h"

namespace plumbline::config {

MonitoringConfig MonitoringFromToml(const TomlTable& table) {
  MonitoringConfig monitoring;
  ReadKeys(table, monitoring);
  if (monitoring.session.find_first_of(",\"\n\r") != std::string::npos) {
    table.AddFault("session", "must not contain a comma, a quote or a line break");
  }
  if (monitoring.reference_probes > 0 && monitoring.reference_probes < 5) {
    table.AddFault("reference_probes",
                   "is too few for a reference; write 5..100, or 0 to use the model itself");
  }
  return monitoring;
}

}  // namespace plumbline::config
