#include <fmt/format.h>
#include <unistd.h>

#include <iostream>

#include "app/plant/commands/plant_commands.h"
#include "app/plant/database/plant_config.h"
#include "app/plant/database/schema.h"

namespace plumbline::plant {
namespace {

/// Reads plant.toml, if it is given or exists. nullopt after printing its faults.
std::optional<PlantConfig> ReadGivenConfig(const DatabaseOptions& options) {
  if (options.config.empty() && access(kPlantConfigFile, F_OK) != 0) return PlantConfig{};
  config::FaultList faults;
  const std::string file = options.config.empty() ? kPlantConfigFile : options.config;
  PlantConfig config = ReadPlantConfig(file, faults);
  if (!faults.HasFaults()) return config;
  std::cerr << config::FaultsText(faults);
  return std::nullopt;
}

}  // namespace

std::optional<std::string> ConnectionText(const DatabaseOptions& options) {
  if (!options.connection.empty()) return options.connection;
  const auto config = ReadGivenConfig(options);
  if (!config) return std::nullopt;
  return config->database.connection;
}

std::optional<PlantConfig> PlantConfigOf(const DatabaseOptions& options) {
  auto config = ReadGivenConfig(options);
  if (config && !options.connection.empty()) config->database.connection = options.connection;
  return config;
}

void AddDatabaseOptions(CLI::App& command, DatabaseOptions& options) {
  command.add_option("--config", options.config,
                     fmt::format("Configuration with [database]; default {}", kPlantConfigFile));
  command.add_option("--database", options.connection,
                     "libpq connection string instead, \"host=db1 dbname=plumbline user=reader\"");
}

std::optional<Connection> OpenDatabase(const DatabaseOptions& options, bool any_schema) {
  const auto settings = ConnectionText(options);
  if (!settings) return std::nullopt;
  auto opened = Connection::Open(*settings, "plumbline-plant");
  if (!opened) {
    std::cerr << fmt::format(
        "the plant's database is not reachable: {}. Check [database] connection in {}, or give "
        "--database\n",
        opened.error(), options.config.empty() ? kPlantConfigFile : options.config);
    return std::nullopt;
  }
  Connection connection = std::move(opened).value();
  if (!any_schema) {
    if (const auto known = RequireSchema(connection); !known) {
      std::cerr << known.error() << '\n';
      return std::nullopt;
    }
  }
  return connection;
}

}  // namespace plumbline::plant
