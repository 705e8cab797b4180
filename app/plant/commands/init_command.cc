#include <fmt/format.h>

#include <iostream>

#include "app/plant/commands/plant_commands.h"
#include "app/plant/database/schema.h"

namespace plumbline::plant {
namespace {

struct InitOptions {
  DatabaseOptions database;
  std::optional<int> retention_months;
};

int Init(const InitOptions& options) {
  auto connection = OpenDatabase(options.database, true);
  if (!connection) return kExitFault;
  const auto before = Migrate(*connection);
  if (!before) {
    std::cerr << fmt::format("the schema was not changed: {}\n", before.error());
    return kExitFault;
  }
  if (*before == 0) {
    std::cout << fmt::format("tables created, schema {}\n", CurrentSchema());
  } else if (*before < CurrentSchema()) {
    std::cout << fmt::format("schema brought from {} to {}\n", *before, CurrentSchema());
  } else {
    std::cout << fmt::format("schema {} is current\n", CurrentSchema());
  }
  if (options.retention_months) {
    const auto set =
        connection->Run("UPDATE setting SET retention_months = $1", {*options.retention_months});
    if (!set) {
      std::cerr << fmt::format("the retention was not set: {}. Run it as the owner\n", set.error());
      return kExitFault;
    }
  }
  const auto granted = GrantRights(*connection);
  if (!granted) {
    std::cerr << fmt::format(
        "roles were not set up: {}. Run this command once as a database user with CREATEROLE\n",
        granted.error());
    return kExitFault;
  }
  std::cout << "roles plumbline_collector, plumbline_reader and plumbline_worker have their "
               "rights; give them to login roles, for example\n"
               "  CREATE ROLE collect LOGIN PASSWORD '...' IN ROLE plumbline_collector;\n";
  return kExitOk;
}

}  // namespace

void AddInitCommand(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<InitOptions>();
  CLI::App* const command =
      app.add_subcommand("init", "Create the tables and roles, or bring older tables forward");
  AddDatabaseOptions(*command, options->database);
  command
      ->add_option("--retention-months", options->retention_months,
                   "Older messages, sums and jobs are deleted, by months; 0 keeps all; new: 24")
      ->check(CLI::Range(0, 1200));
  command->footer(
      "Run it as the owner of the database, before the first collector and after each update.\n"
      "Running it again changes nothing. Stored rows are kept.\n\n"
      "Example:\n"
      "  sudo -u postgres createdb plumbline\n"
      "  sudo -u postgres plumbline plant init --database dbname=plumbline");
  command->callback([options, &exit_code] { exit_code = Init(*options); });
}

}  // namespace plumbline::plant
