// Configuration of a [[gauge]]: a dial gauge whose button makes a probe.
#pragma once

#include <optional>
#include <string>

#include "drivers/gauge/gauge.h"

namespace plumbline::config {

struct GaugeConfig {
  std::string artefact;  ///< name of the [[artefact]] of kind "gauge"
  gauge::GaugeOptions connection;
  std::optional<double> sigma_m;  ///< standard deviation of a reading; if nullopt, the cell's

  bool operator==(const GaugeConfig&) const = default;
};

}  // namespace plumbline::config
