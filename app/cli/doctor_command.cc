#include "app/cli/doctor_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/exit_codes.h"
#include "app/doctor/examine.h"

namespace plumbline {
namespace {

struct DoctorOptions {
  std::string config = "/etc/plumbline/plumbline.toml", user = "plumbline";
  bool json = false;
};

std::string CheckUpJson(const CheckUp& found) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const CheckedThing& thing : found) {
    list.push_back({{"health", HealthText(thing.health)},
                    {"what", thing.what},
                    {"told", thing.told},
                    {"do", thing.remedy}});
  }
  return list.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

std::string CheckUpWords(const CheckUp& found) {
  std::string text;
  for (const CheckedThing& thing : found) {
    text += fmt::format("{:<8} {:<16} {}\n", HealthText(thing.health), thing.what, thing.told);
    if (!thing.remedy.empty()) text += fmt::format("{:<25} do: {}\n", "", thing.remedy);
  }
  return text;
}

int RunDoctor(const DoctorOptions& options) {
  const CheckUp found = Examine(options.config, options.user);
  const auto count = [&](Health health) {
    return std::count_if(found.begin(), found.end(),
                         [&](const CheckedThing& thing) { return thing.health == health; });
  };
  const auto faults = count(Health::kFault), warnings = count(Health::kWarning);
  if (options.json) {
    std::cout << CheckUpJson(found);
  } else {
    std::cout << CheckUpWords(found)
              << fmt::format("{} fault{}, {} warning{}\n", faults, faults == 1 ? "" : "s", warnings,
                             warnings == 1 ? "" : "s");
  }
  return faults > 0 ? kExitFault : kExitOk;
}

}  // namespace

void AddDoctorCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<DoctorOptions>();
  CLI::App* doctor = app.add_subcommand("doctor", "Finds out what is wrong with this installation");
  doctor
      ->add_option("config,--config", options->config,
                   "The daemon's configuration, with or without --config")
      ->capture_default_str();
  doctor->add_option("--user", options->user, "The user that the service runs as")
      ->capture_default_str();
  doctor->add_flag("--json", options->json, "For programs");
  doctor->footer(
      "Looks at configuration, clock, disk, rights, robot, camera, zoom sensor and display, and "
      "says\n"
      "what to do. It changes nothing. A running daemon is asked for the robot; where none runs, "
      "the\n"
      "robot is read once. Run it as root or as the service's user.\n\n"
      "Examples:\n  sudo plumbline doctor\n  plumbline doctor my-cell/plumbline.toml --json\n\n"
      "Exit codes: 0 nothing wrong (warnings may remain), 1 a fault, 2 wrong arguments.");
  doctor->callback([options, &exit_code] { exit_code = RunDoctor(*options); });
}

}  // namespace plumbline
