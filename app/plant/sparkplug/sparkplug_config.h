// Configuration of plumbline-sparkplug: [broker] and [sparkplug] of plant.toml.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/fault.h"
#include "app/plant/database/plant_config.h"

namespace plumbline::plant {

struct SparkplugConfig {
  BrokerSettings cells;  ///< where the cells publish
  BrokerSettings hosts;  ///< where the edge nodes publish; [sparkplug.broker], else the same
  std::string client_id = "plumbline-sparkplug";
  std::string primary_host;  ///< births wait until this host is online; empty: they do not
  int max_nodes = 2000;
};

/// @param file  its path; the files that it names are relative to its folder
std::optional<SparkplugConfig> SparkplugConfigFromText(std::string_view text,
                                                       const std::string& file,
                                                       config::FaultList& faults);
std::optional<SparkplugConfig> ReadSparkplugConfig(const std::string& file,
                                                   config::FaultList& faults);

}  // namespace plumbline::plant
