#include "app/cli/lens_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

#include "app/cli/exit_codes.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/same_file.h"
#include "app/config/daemon_config.h"
#include "app/config/text_file.h"
#include "app/lens/calibration.h"
#include "app/lens/lens_json.h"
#include "app/lens_store/lens_store.h"
#include "app/lens_store/stored_views.h"
#include "app/printed_digits.h"

namespace plumbline {
namespace {

struct LensListOptions {
  std::string state = kUsualStateDirectory, out;
  std::int64_t id = 0;
  double acceptable_px = CalibrationOptions{}.acceptable_px, distance_mm = 0;

  std::string StoreFile() const { return state + "/lenses.sqlite"; }
};

Result<std::vector<LensEntry>> KeptLenses(const LensListOptions& options) {
  std::error_code unknown;
  if (!std::filesystem::exists(options.StoreFile(), unknown)) {
    return Error{
        fmt::format("{}: no lens store there yet; a daemon with [camera] makes it, or give another "
                    "--state",
                    options.StoreFile())};
  }
  Result<LensStore> store = LensStore::OpenForReading(options.StoreFile());
  if (!store) return store.failure();
  return store.value().All();
}

std::string Line(const LensEntry& entry) {
  const auto number = [](const std::optional<double>& value, const char* unit) {
    return value ? fmt::format("{:.2f}{}", *value, unit) : std::string("-");
  };
  const double fx_sd = std::sqrt(entry.covariance(0, 0));
  const int decimals = DecimalsFor({fx_sd}, 2);
  const auto views = ViewsOfBytes(entry.corners);
  return fmt::format(
      "{:>5}  {:<20}  {:>7} {:>7}  {:>9.{}f} {:>8.{}f} {:>10} {:>6} {:>8}  {}; {}, {}\n", entry.id,
      entry.utc, entry.key.zoom_counts,
      entry.key.focus_counts ? std::to_string(*entry.key.focus_counts) : "-", entry.lens.fx,
      decimals, fx_sd, decimals,
      entry.uncertainty_px ? fmt::format("{:.2g}", *entry.uncertainty_px) : "-",
      views ? std::to_string(views->views.size()) : "-", number(entry.temp_C, " C"),
      entry.key.camera_serial, entry.key.mode, entry.board);
}

int List(const LensListOptions& options) {
  const auto lenses = KeptLenses(options);
  if (!lenses) return Fail(lenses.error(), kExitFault);
  std::cout << fmt::format("{:>5}  {:<20}  {:>7} {:>7}  {:>9} {:>8} {:>10} {:>6} {:>8}  {}\n",
                           "lens", "time", "zoom", "focus", "fx px", "+-", "uncertain", "views",
                           "temp.", "camera; mode, board");
  for (const LensEntry& entry : *lenses) std::cout << Line(entry);
  return kExitOk;
}

std::string Words(const LensEntry& kept, const LensCalibration& again) {
  const auto focal = [](const Lens& lens, double sd) {
    const int decimals = DecimalsFor({sd}, 2);
    return fmt::format("f {:.{}f} px +- {:.{}f}", lens.fx, decimals, sd, decimals);
  };
  std::string text = fmt::format("lens {} as it is kept: {}\n", kept.id,
                                 focal(kept.lens, std::sqrt(kept.covariance(0, 0))));
  if (again.lens.fx > 0) {
    text += fmt::format(
        "solved again: {}, uncertain by {:.2g} px; it differs by {:.2g} px at "
        "most over the image\n",
        focal(again.lens, std::sqrt(again.covariance(0, 0))), again.uncertainty.max_px,
        LargestDifference(again.lens, kept.lens, kept.size));
  }
  text += again.accepted ? "accepted\n" : "refused:\n";
  for (const std::string& reason : again.reasons) text += "  " + reason + "\n";
  return text;
}

int Solve(const LensListOptions& options) {
  const auto lenses = KeptLenses(options);
  if (!lenses) return Fail(lenses.error(), kExitFault);
  const auto kept = std::find_if(lenses->begin(), lenses->end(),
                                 [&](const LensEntry& entry) { return entry.id == options.id; });
  if (kept == lenses->end()) {
    return Fail(fmt::format("{}: no lens {}; plumbline lens list shows which there are",
                            options.StoreFile(), options.id),
                kExitFault);
  }
  if (kept->corners.empty()) {
    return Fail(fmt::format("lens {} was kept without its views: show the board again", kept->id),
                kExitFault);
  }
  const auto stored = ViewsOfBytes(kept->corners);
  if (!stored) {
    return Fail(fmt::format("the views of lens {}: {}", kept->id, stored.error()), kExitFault);
  }
  if (!options.out.empty() && SameFile(options.out, options.StoreFile())) {
    return Fail("plumbline lens solve: --json is the store itself; choose another file",
                kExitUsage);
  }
  CalibrationOptions judged;
  judged.acceptable_px = options.acceptable_px;
  if (options.distance_mm > 0) judged.distance_m = 1e-3 * options.distance_mm;
  const LensCalibration again = CalibrateLens(stored->board, stored->views, kept->size, judged);
  if (!options.out.empty()) {
    if (const auto written = WriteTextFile(options.out, LensJson(again)); !written) {
      return Fail(fmt::format("{}: cannot be written: {}; choose another --json", options.out,
                              written.error()),
                  kExitUsage);
    }
  }
  std::cout << Words(*kept, again);
  return kExitOk;
}

}  // namespace

void AddLensCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<LensListOptions>();
  CLI::App* lens =
      app.add_subcommand("lens", "Lenses that the daemon calibrated: list, solve again");
  lens->require_subcommand(1);
  lens->footer(
      "The store is the file lenses.sqlite in the daemon's state_directory; it is not changed.");
  const auto add = [&](const char* name, const char* what, int (*run)(const LensListOptions&),
                       const char* footer) {
    CLI::App* command = lens->add_subcommand(name, what);
    command->add_option("--state", options->state, "The daemon's state_directory")
        ->capture_default_str();
    command->footer(footer);
    command->callback([options, run, &exit_code] { exit_code = run(*options); });
    return command;
  };
  add("list", "Prints all lenses, oldest first", List,
      "Example:\n  plumbline lens list --state ./state\n\n"
      "Exit codes: 0 listed, 1 no store there or one that cannot be read, 2 wrong arguments.");
  CLI::App* solve =
      add("solve", "Solves a lens again from the views that it was calibrated with", Solve,
          "Example:\n  plumbline lens solve 12 --json lens.json\n\n"
          "Exit codes: 0 solved (accepted or refused), 1 no such lens or no views, 2 wrong "
          "arguments or\nunwritable output.");
  solve->add_option("lens", options->id, "Its number")->required();
  solve->add_option("--json", options->out, "LENS.json to write, as calibrate-lens does");
  solve
      ->add_option("--acceptable-px", options->acceptable_px,
                   "Largest uncertainty of the projection that is accepted")
      ->capture_default_str()
      ->check(NumberWithin(0.001, 100));
  solve->add_option("--distance-mm", options->distance_mm, "Judge it there; default: at infinity")
      ->check(NumberWithin(1, 1e6));
}

}  // namespace plumbline
