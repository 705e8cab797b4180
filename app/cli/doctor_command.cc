// plumbline doctor: diagnosis of the installation.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "app/cli/doctor/examine.h"
#include "app/cli/failure.h"

namespace plumbline::cli {
namespace {

struct DoctorOptions {
  std::string config = "/etc/plumbline/plumbline.toml", user = "plumbline";
  bool json = false;
};

std::string ResultsJson(const CheckResults& found) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const CheckResult& result : found) {
    list.push_back({{"health", HealthText(result.health)},
                    {"what", result.subject},
                    {"detail", result.finding},
                    {"told", result.finding},  // its previous name
                    {"do", result.remedy}});
  }
  return text::JsonText(list, 1) + "\n";
}

/// The health in its colour, padded to a column.
std::string HealthColumn(Health health, bool colours) {
  const std::string word = HealthText(health);
  const std::string padding(word.size() < 8 ? 8 - word.size() : 0, ' ');
  if (health == Health::kFault)
    return terminal::Painted(word, terminal::Tone::kFault, colours) + padding;
  if (health == Health::kWarning)
    return terminal::Painted(word, terminal::Tone::kWarning, colours) + padding;
  return word + padding;
}

std::string ResultsText(const CheckResults& found, bool colours) {
  std::string text;
  for (const CheckResult& result : found) {
    text += fmt::format("{} {:<16}  {}\n", HealthColumn(result.health, colours), result.subject,
                        result.finding);
    if (!result.remedy.empty()) text += fmt::format("{:<25}  do: {}\n", "", result.remedy);
  }
  return text;
}

int RunDoctor(const DoctorOptions& options) {
  const CheckResults found = Examine(options.config, options.user);
  const auto count = [&](Health health) {
    return std::count_if(found.begin(), found.end(),
                         [&](const CheckResult& result) { return result.health == health; });
  };
  const auto faults = count(Health::kFault), warnings = count(Health::kWarning);
  if (options.json) {
    std::cout << ResultsJson(found);
  } else {
    std::cout << terminal::ForReading << ResultsText(found, terminal::ShowsColours(std::cout))
              << fmt::format("{} fault{}, {} warning{}\n", faults, faults == 1 ? "" : "s", warnings,
                             warnings == 1 ? "" : "s");
  }
  return faults > 0 ? kExitFault : kExitOk;
}

}  // namespace

void AddDoctorCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* doctor = app.add_subcommand("doctor", "Find problems of this installation");
  doctor
      ->add_option("config,--config", options->config,
                   "Configuration of the daemon, with or without --config")
      ->capture_default_str();
  doctor->add_option("--user", options->user, "User account of the service")->capture_default_str();
  doctor->add_flag("--json", options->json, "Print JSON");
  doctor->footer(
      "Checks configuration, clock, disk, permissions, robot, camera, zoom sensor, display and "
      "broker,\n"
      "and prints what to do. It changes nothing. The state of the robot is taken from the "
      "running\n"
      "daemon; if none is running, the robot is read once. Run it as root or as the service's "
      "user.\n\n"
      "Examples:\n  sudo plumbline doctor\n  plumbline doctor my-cell/plumbline.toml --json\n\n"
      "Exit codes: 0 no fault (there may be warnings), 1 at least one fault, 2 wrong arguments.");
  doctor->callback([options, &exit_code] { exit_code = RunDoctor(*options); });
}

}  // namespace plumbline::cli
