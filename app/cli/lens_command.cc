// plumbline lens: lists the daemon's lens store and solves a lens again from its stored views.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <memory>

#include "app/base/config/daemon_config.h"
#include "app/base/target/declared_facts.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/text.h"
#include "app/cli/board_option.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/state_subcommand.h"
#include "app/vision/lens/calibration.h"
#include "app/vision/lens/lens_json.h"
#include "app/vision/lens_files/lens_files.h"
#include "app/vision/lens_files/lens_fold.h"
#include "app/vision/lens_store/lens_store.h"
#include "app/vision/lens_store/stored_views.h"

namespace plumbline::cli {
namespace {

struct LensListOptions {
  std::string state = config::kDefaultStateDirectory, out;
  std::int64_t id = 0;
  double acceptable_px = vision::CalibrationOptions{}.acceptable_px, distance_mm = 0;
  target::DeclaredFacts declared;

  std::string StoreFile() const { return state + "/lenses.sqlite"; }
};

Result<std::vector<vision::LensEntry>> StoredLenses(const LensListOptions& options) {
  std::error_code unknown;
  if (!std::filesystem::exists(options.StoreFile(), unknown)) {
    return Error{
        fmt::format("{}: the lens store does not exist yet; a daemon with [camera] creates it. Or "
                    "give another --state",
                    options.StoreFile())};
  }
  Result<vision::LensStore> store = vision::LensStore::OpenForReading(options.StoreFile());
  if (!store) return store.failure();
  return store.value().All();
}

/// "; declared no_window"; empty if nothing is.
std::string DeclaredWords(const target::DeclaredFacts& declared) {
  return declared == target::DeclaredFacts{} ? "" : "; declared " + TextOf(declared);
}

std::string Line(const vision::LensEntry& entry) {
  const auto number = [](const std::optional<double>& value, const char* unit) {
    return value ? fmt::format("{:.2f}{}", *value, unit) : std::string("-");
  };
  const double fx_sd = std::sqrt(entry.covariance(0, 0));
  const int decimals = text::DecimalsFor({fx_sd}, 2);
  const auto views = vision::DecodeViews(entry.corners);
  return fmt::format(
      "{:>5}  {:<20} {:>6} {:>6} {:>9.{}f} {:>7.{}f} {:>5} {:>5} {:>7}\n       {}; {}, {}{}\n",
      entry.id, entry.utc, entry.key.zoom_counts,
      entry.key.focus_counts ? std::to_string(*entry.key.focus_counts) : "-", entry.lens.fx,
      decimals, fx_sd, decimals,
      entry.uncertainty_px ? fmt::format("{:.2g}", *entry.uncertainty_px) : "-",
      views ? std::to_string(views->views.size()) : "-", number(entry.temp_C, " C"),
      entry.key.camera_serial, entry.key.mode, entry.board, DeclaredWords(entry.declared));
}

int List(const LensListOptions& options) {
  const auto lenses = StoredLenses(options);
  if (!lenses) return Fail(lenses.error(), kExitFault);
  std::cout << terminal::ForReading
            << fmt::format("{:>5}  {:<20} {:>6} {:>6} {:>9} {:>7} {:>5} {:>5} {:>7}\n       {}\n",
                           "lens", "time", "zoom", "focus", "fx px", "+-", "sd px", "views",
                           "temp.", "camera; mode, board; declared");
  for (const vision::LensEntry& entry : *lenses) std::cout << Line(entry);
  return kExitOk;
}

std::string ComparisonText(const vision::LensEntry& stored, const vision::LensCalibration& solved) {
  const auto focal = [](const lens::Lens& lens, double sd) {
    const int decimals = text::DecimalsFor({sd}, 2);
    return fmt::format("f {:.{}f} px +- {:.{}f}", lens.fx, decimals, sd, decimals);
  };
  std::string text = fmt::format("lens {} as stored: {}{}\n", stored.id,
                                 focal(stored.lens, std::sqrt(stored.covariance(0, 0))),
                                 DeclaredWords(stored.declared));
  if (solved.lens.fx > 0) {
    text += fmt::format(
        "solved again: {}, standard deviation of the projection {:.2g} px; differs from the stored "
        "lens by at most {:.2g} px over the image{}\n",
        focal(solved.lens, std::sqrt(solved.covariance(0, 0))), solved.uncertainty.max_px,
        vision::LargestDifference(solved.lens, stored.lens, stored.size),
        DeclaredWords(solved.declared));
  }
  text += solved.accepted ? "accepted\n" : "refused:\n";
  for (const std::string& reason : solved.reasons) text += "  " + reason + "\n";
  return text;
}

Result<vision::LensEntry> StoredLens(const LensListOptions& options) {
  const auto lenses = StoredLenses(options);
  if (!lenses) return lenses.failure();
  for (const vision::LensEntry& entry : *lenses) {
    if (entry.id == options.id) return entry;
  }
  return Error{fmt::format("{}: no lens {}; `plumbline lens list` lists the stored lenses",
                           options.StoreFile(), options.id)};
}

int Export(const LensListOptions& options) {
  const Result<vision::LensEntry> stored = StoredLens(options);
  if (!stored) return Fail(stored.error(), kExitFault);
  const Result<std::string> content = vision::LensFileOf(*stored, options.out);
  if (!content) {
    return Fail(fmt::format("plumbline lens export: {}: {}", options.out, content.error()),
                kExitUsage);
  }
  if (!WriteOutput(options.out, *content, "file")) return kExitUsage;
  std::cout << fmt::format("lens {} written to {}\n", options.id, options.out);
  const std::string fold = vision::FoldNote(stored->lens, stored->size);
  if (!fold.empty()) std::cerr << fmt::format("lens {}: note: {}\n", options.id, fold);
  return kExitOk;
}

int Solve(const LensListOptions& options) {
  const Result<vision::LensEntry> stored = StoredLens(options);
  if (!stored) return Fail(stored.error(), kExitFault);
  if (stored->corners.empty()) {
    return Fail(
        fmt::format("lens {} was stored without its views; calibrate it again with the board",
                    stored->id),
        kExitFault);
  }
  const auto views = vision::DecodeViews(stored->corners);
  if (!views) {
    return Fail(fmt::format("the views of lens {}: {}", stored->id, views.error()), kExitFault);
  }
  if (!options.out.empty() && SameFile(options.out, options.StoreFile())) {
    return Fail("plumbline lens solve: --json would overwrite the lens store; choose another file",
                kExitUsage);
  }
  vision::CalibrationOptions criteria;
  criteria.acceptable_px = options.acceptable_px;
  criteria.declared = options.declared;
  if (options.distance_mm > 0) criteria.distance_m = 1e-3 * options.distance_mm;
  const vision::LensCalibration solved =
      vision::CalibrateLens(views->board, views->views, stored->size, criteria);
  if (!options.out.empty() && !WriteOutput(options.out, vision::LensJson(solved), "--json")) {
    return kExitUsage;
  }
  std::cout << terminal::ForReading << ComparisonText(*stored, solved);
  return kExitOk;
}

}  // namespace

void AddLensCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<LensListOptions>();
  CLI::App* lens =
      app.add_subcommand("lens", "List, export or solve again the lenses calibrated by the daemon");
  lens->require_subcommand(1);
  lens->footer(
      "Reads the file lenses.sqlite in the daemon's state_directory and does not change it.\n\n"
      "Examples:\n  plumbline lens list\n  plumbline lens export 12 lens.xml\n"
      "  plumbline lens solve 12 --json lens.json");
  const auto add = [&](const char* name, const char* what, int (*run)(const LensListOptions&),
                       const char* footer) {
    return AddStateSubcommand(*lens, name, what, options, run, footer, exit_code);
  };
  add("list", "List all lenses, oldest first", List,
      "Example:\n  plumbline lens list --state ./state\n\n"
      "Exit codes: 0 listed, 1 the store does not exist or cannot be read, 2 wrong arguments.");
  CLI::App* exported =
      add("export", "Write a lens for another program, or for plumbline track", Export,
          "The extension selects the format: .xml, .yaml or .yml for OpenCV's cv::FileStorage,\n"
          ".dat for ARToolKit (camera_para.dat, without covariance).\n\n"
          "Example:\n  plumbline lens export 12 lens.xml --state ./state\n\n"
          "Exit codes: 0 written, 1 no such lens, 2 wrong arguments or unwritable output.");
  exported->add_option("lens", options->id, "Number of the lens")->required();
  exported->add_option("file", options->out, "File to write")->required();
  CLI::App* solve =
      add("solve", "Solve a lens again from the views that it was calibrated with", Solve,
          "Example:\n  plumbline lens solve 12 --json lens.json\n\n"
          "Exit codes: 0 solved (accepted or refused), 1 no such lens or no views, 2 wrong "
          "arguments or\nunwritable output.");
  solve->add_option("lens", options->id, "Number of the lens")->required();
  solve->add_option("--json", options->out, "Write LENS.json, as calibrate-lens does");
  solve
      ->add_option("--acceptable-px", options->acceptable_px,
                   "Largest accepted standard deviation of the projection")
      ->capture_default_str()
      ->check(NumberWithin(0.001, 100));
  solve
      ->add_option("--distance-mm", options->distance_mm,
                   "Evaluate the projection at this distance instead of at infinity")
      ->check(NumberWithin(1, 1e6));
  AddDeclarationOptions(*solve, options->declared);
}

}  // namespace plumbline::cli
