// Commands of plumbline-plant, each added to the command line parser.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "app/plant/database/connection.h"
#include "app/plant/database/plant_config.h"

namespace plumbline::plant {

inline constexpr int kExitOk = 0;
inline constexpr int kExitFault =
    1;  ///< unreadable input or database, or a finding that needs a person
inline constexpr int kExitUsage = 2;  ///< wrong arguments, unwritable output

/// Options of every command that uses the database.
struct DatabaseOptions {
  std::string config;      ///< plant.toml; empty: the default file if it exists
  std::string connection;  ///< libpq connection string; empty: that of the configuration
};

/// Adds --config and --database.
void AddDatabaseOptions(CLI::App& command, DatabaseOptions& options);

/// The connection string that applies; nullopt after printing faults of the configuration.
std::optional<std::string> ConnectionText(const DatabaseOptions& options);
/// The configuration with the options applied. Prints its faults.
std::optional<PlantConfig> PlantConfigOf(const DatabaseOptions& options);

/// Connects, and checks the schema unless `any_schema`. Prints the reason on failure.
std::optional<Connection> OpenDatabase(const DatabaseOptions& options, bool any_schema = false);

void AddCellCommand(CLI::App& app, int& exit_code);
void AddInitCommand(CLI::App& app, int& exit_code);
void AddExportCommand(CLI::App& app, int& exit_code);
void AddScheduleCommand(CLI::App& app, int& exit_code);
void AddWorkerCommand(CLI::App& app, int& exit_code);
void AddCompareCommand(CLI::App& app, int& exit_code);
void AddPriorCommand(CLI::App& app, int& exit_code);
void AddStatusCommand(CLI::App& app, int& exit_code);
void AddReportCommand(CLI::App& app, int& exit_code);
void AddPageCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::plant
