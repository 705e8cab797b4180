#include "app/config/daemon_settings.h"

namespace plumbline::config {

MonitoringConfig MonitoringFromToml(const TomlTable& table) {
  MonitoringConfig loop;
  ReadKeys(table, loop);
  if (loop.session.find_first_of(",\"\n\r") != std::string::npos) {
    table.AddFault("session", "must not contain a comma, a quote or a line break");
  }
  if (loop.reference_probes > 0 && loop.reference_probes < 5) {
    table.AddFault("reference_probes",
                   "is too few for a reference; write 5..100, or 0 to use the model itself");
  }
  return loop;
}

}  // namespace plumbline::config
