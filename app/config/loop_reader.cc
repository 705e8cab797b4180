#include "app/config/daemon_settings.h"

namespace plumbline {

LoopConfig LoopFromToml(const TomlTable& table) {
  LoopConfig loop;
  ReadKeys(table, loop);
  if (loop.session.find_first_of(",\"\n\r") != std::string::npos) {
    table.AddFault("session", "must not hold a comma, a quote or a line end");
  }
  if (loop.reference_probes > 0 && loop.reference_probes < 5) {
    table.AddFault("reference_probes", "is too few for a reference: 5..100, or 0 for the model");
  }
  return loop;
}

}  // namespace plumbline
