// plumbline program: corrects the points of robot programs and writes the programs back.
#include "app/cli/program_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>

#include "app/base/service/utc_clock.h"
#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/cli/cell_option.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/number_option.h"
#include "app/cli/output_file.h"
#include "app/cli/program_files.h"
#include "app/cli/program_options.h"
#include "app/cli/progress.h"
#include "app/programs/correction/comparison.h"
#include "app/programs/correction/program_report.h"
#include "app/programs/correction/rewriting.h"
#include "app/version.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

struct ProgramOptions {
  std::string cell, output, report, taught_loaded;
  std::vector<std::string> programs, check;
  StatedTexts stated;
  std::optional<double> temperature_C, deflection_sd, insert_mm;
  double offset_bound_mm = 0.02;
  std::span<const programs::Brand* const> brands;  ///< that are read
  bool loads_without_tool = false, joints = false, external_axes_still = false, again = false,
       force = false, complete = false, json = false, all = false, dry_run = false;
};

std::vector<std::string> FilesBelow(const std::string& path) {
  std::error_code failed;
  if (!fs::is_directory(path, failed)) return {path};
  std::vector<std::string> list;
  for (const auto& entry : fs::directory_iterator(path, failed)) {
    const std::string name = entry.path().filename().string();
    if (entry.is_regular_file() && !name.ends_with(".plumbline.json")) {
      list.push_back(entry.path().string());
    }
  }
  std::ranges::sort(list);
  return list;
}

using Inputs = std::vector<ProgramInput>;

std::string FileNameOf(const ProgramInput& input) {
  return fs::path(input.given).filename().string();
}

/// Of two folders, keeps the files that both have, so that those of one name have one index.
/// @return  names of the programs that only one folder has; other files there do not count
std::vector<programs::OtherDifference> KeepCommon(const programs::Brand& brand, Inputs& old_inputs,
                                                  Inputs& new_inputs) {
  std::vector<programs::OtherDifference> lone;
  const auto names_of = [](const Inputs& inputs) {
    std::set<std::string> names;
    for (const ProgramInput& input : inputs) names.insert(FileNameOf(input));
    return names;
  };
  const auto old_names = names_of(old_inputs), new_names = names_of(new_inputs);
  const auto keep = [&](Inputs& inputs, const std::set<std::string>& others) {
    std::erase_if(inputs, [&](const ProgramInput& input) {
      if (others.contains(FileNameOf(input))) return false;
      if (brand.Recognises(input.file)) {
        lone.push_back({input.file.name, 0, "only one version has this file"});
      }
      return true;
    });
  };
  keep(old_inputs, new_names);
  keep(new_inputs, old_names);
  return lone;
}

/// Compares two versions of a program.
int Check(const ProgramOptions& options) {
  auto old_inputs = ReadProgramInputs(FilesBelow(options.check[0])),
       new_inputs = ReadProgramInputs(FilesBelow(options.check[1]));
  if (!old_inputs || !new_inputs) return kExitUsage;
  const Result<const programs::Brand*> brand =
      programs::BrandOf(FilesOf(*old_inputs), options.brands);
  if (!brand) return Fail(brand.error(), kExitUsage);
  std::vector<programs::OtherDifference> lone;
  std::error_code failed;
  if (fs::is_directory(options.check[0], failed) && fs::is_directory(options.check[1], failed)) {
    lone = KeepCommon(**brand, *old_inputs, *new_inputs);
  }
  const programs::Program before = (*brand)->Read(FilesOf(*old_inputs)).program,
                          after = (*brand)->Read(FilesOf(*new_inputs)).program;
  programs::ProgramComparison comparison = programs::Compare(**brand, before, after);
  comparison.others.insert(comparison.others.end(), lone.begin(), lone.end());
  if (options.json) {
    nlohmann::json points = nlohmann::json::array(), others = nlohmann::json::array();
    for (const auto& point : comparison.points) {
      points.push_back({{"name", text::Visible(point.name)},
                        {"file", text::Visible(after.files[point.place.file].name)},
                        {"line", point.place.line},
                        {"distance_mm", kMmPerMetre * point.distance_m},
                        {"angle_deg", kDegPerRad * point.angle_rad},
                        {"joint", point.joint}});
    }
    for (const auto& other : comparison.others) {
      others.push_back(
          {{"file", text::Visible(other.file)}, {"line", other.line}, {"what", other.what}});
    }
    std::cout << text::JsonText(nlohmann::json{{"schema", 1},
                                               {"compared", comparison.compared},
                                               {"inserted", comparison.inserted},
                                               {"points", points},
                                               {"others", others}},
                                2)
              << '\n';
  } else {
    double largest_m = 0, largest_joint = 0;
    for (const auto& point : comparison.points) {
      largest_m = std::max(largest_m, point.distance_m);
      largest_joint = std::max(largest_joint, point.joint);
      std::cout << fmt::format(
          "{}: {}: {}\n", programs::PlaceText(after, point.place), text::Visible(point.name),
          point.kind == programs::PointKind::kJoints
              ? fmt::format("a joint by {:.6g}, in the file's unit", point.joint)
              : fmt::format("{:.4f} mm, {:.5f} deg", kMmPerMetre * point.distance_m,
                            kDegPerRad * point.angle_rad));
    }
    for (const auto& other : comparison.others) {
      std::cout << fmt::format("{}:{}: {}\n", other.file, other.line, other.what);
    }
    std::cout << fmt::format(
        "{} of {} points differ, by at most {:.4f} mm{}{}; {}\n", comparison.points.size(),
        comparison.compared, kMmPerMetre * largest_m,
        largest_joint > 0 ? fmt::format(", joints by {:.6g} in the file's unit", largest_joint)
                          : std::string(),
        comparison.inserted > 0 ? fmt::format("; {} points inserted", comparison.inserted)
                                : std::string(),
        comparison.others.empty() ? "nothing else differs" : "other bytes differ, too");
  }
  return comparison.others.empty() ? kExitOk : kExitFault;
}

std::optional<programs::CorrectionSettings> SettingsOf(const ProgramOptions& options,
                                                       const CellInForce& cell) {
  programs::CorrectionSettings settings;
  settings.limits = cell.limits;
  if (options.deflection_sd) settings.limits.deviation = {*options.deflection_sd, true};
  settings.stated.loads_without_tool = options.loads_without_tool;
  settings.entry.complete = options.complete;
  settings.joints = options.joints;
  settings.external_axes_still = options.external_axes_still;
  settings.offset_bound_m = kMetrePerMm * options.offset_bound_mm;
  settings.temp_C = options.temperature_C;
  settings.utc_s = service::SystemUtcSeconds();
  if (!options.taught_loaded.empty()) {
    settings.taught_under = PayloadFromText(options.taught_loaded);
    if (!settings.taught_under) {
      std::cerr << "plumbline program: --taught-loaded: give KG or KG,X,Y,Z in mm\n";
      return std::nullopt;
    }
  }
  return settings;
}

int Run(const ProgramOptions& options) {
  if (!options.check.empty()) return Check(options);
  if (options.cell.empty() || options.programs.empty()) {
    return Fail("plumbline program: give CELL and PROGRAM; see plumbline program --help",
                kExitUsage);
  }
  std::vector<std::string> sources = options.programs;
  sources.push_back(options.cell);
  if (!options.stated.frames.empty()) sources.push_back(options.stated.frames);
  if (OverwritesFile("program", {{"--report", options.report}}, sources, std::cerr)) {
    return kExitUsage;
  }
  const std::optional<CellInForce> cell = ReadCellInForce(options.cell);
  std::optional<std::vector<ProgramInput>> inputs = ReadProgramInputs(options.programs);
  if (!cell || !inputs) return kExitUsage;
  const Result<const programs::Brand*> found = programs::BrandOf(FilesOf(*inputs), options.brands);
  if (!found) return Fail(found.error(), kExitUsage);
  const programs::Brand& brand = **found;
  programs::Reading reading = brand.Read(FilesOf(*inputs));
  const auto before = CorrectedBefore(options.cell, options.again, brand, reading, *inputs);
  if (!before) return kExitUsage;
  programs::Program& program = reading.program;
  bool something_new = program.points.empty();
  for (programs::Point& point : program.points) {
    if ((*before)[point.place.file]) {
      point.untouchable = "corrected by an earlier run";
    } else {
      something_new = true;
    }
  }
  if (!something_new) return kExitOk;
  std::optional<programs::CorrectionSettings> settings = SettingsOf(options, *cell);
  if (!settings) return kExitUsage;
  if (const Result<void> applied =
          ApplyStated(options.stated, brand, cell->cell, program, *settings);
      !applied) {
    return Fail("plumbline program: " + applied.error(), kExitUsage);
  }
  const ProgramOutput output{options.output, options.again, options.force};
  auto paths = OutputPathsOf(output, *inputs, *before);
  if (!paths) return kExitUsage;
  Interruption interruption;
  Progress progress(std::cerr, options.json);
  programs::ProgramCorrector corrector(brand, program, cell->cell, *settings);
  bool interrupted = false;
  programs::ProgramCorrection correction = corrector.Correct([&](double share) {
    progress.Show(share, fmt::format("{} points", program.points.size()));
    interrupted = interrupted || Interruption::Requested();
    return !interrupted;
  });
  if (!interrupted) {
    progress.Show(1, "checking the path between points");
    corrector.CheckSegments(
        options.insert_mm ? std::optional(kMetrePerMm * *options.insert_mm) : std::nullopt,
        correction);
  }
  progress.Clear();
  if (interrupted || !interruption.Disarm()) return Interrupted();
  const std::string date = text::TextOfUtcNow().substr(0, 10);
  const std::string build = kVersionAndBuild;
  const std::string version = build.substr(0, build.find(','));
  const programs::Mark mark{version, date, programs::ShortDigest(cell->bytes), ""};
  const Result<programs::Rewritten> rewritten = programs::Rewrite(brand, program, correction, mark);
  if (!rewritten) return Fail(rewritten.error(), kExitUsage);
  const programs::ReportInput report{brand,          program,      reading.refusals, correction,
                                     cell->cell,     options.cell, version,          date,
                                     options.joints, *before};
  if (options.json) {
    std::cout << text::JsonText(programs::ReportJson(report), 2) << '\n';
  } else {
    std::cout << terminal::ForReading << programs::ReportText(report, options.all);
  }
  const std::string page = options.report.empty() ? "" : programs::ReportPage(report);
  std::error_code unknown;
  const bool device =
      fs::exists(options.report, unknown) && !fs::is_regular_file(options.report, unknown);
  const bool apart = options.dry_run || device;
  if (apart && !page.empty() && !WriteOutput(options.report, page, "--report")) return kExitUsage;
  const bool new_digits =
      std::ranges::any_of(rewritten->changed, [](bool changed) { return changed; });
  if (!options.dry_run && !new_digits) {
    std::cerr << "no digit changes: no program is written\n";
    if (!apart && !page.empty() && !WriteOutput(options.report, page, "--report")) {
      return kExitUsage;
    }
  } else if (!options.dry_run) {
    if (!WriteProgram(output, *paths, *inputs, program, correction, *rewritten,
                      {apart ? "" : options.report, page})) {
      return kExitUsage;
    }
    for (const std::string& path : *paths) {
      if (!path.empty()) std::cerr << path << ": written\n";
    }
    RememberUnmarked(options.cell, brand, *paths, *rewritten);
  }
  const programs::ReportCounts counts = programs::CountsOf(report);
  const bool all_read = reading.refusals.empty() && counts.unread == 0;
  return counts.left > 0 || counts.motions_left > 0 || !all_read ? kExitFault : kExitOk;
}

}  // namespace

void AddProgramCommand(CLI::App& app, int& exit_code) {
  AddProgramCommandFor(programs::Brands(), app, exit_code);
}

void AddProgramCommandFor(std::span<const programs::Brand* const> brands, CLI::App& app,
                          int& exit_code) {
  auto options = std::make_shared<ProgramOptions>();
  options->brands = brands;
  CLI::App* command = app.add_subcommand(
      "program", "Correct the points of a robot program and write the program back");
  command->add_option("cell", options->cell, "CELL.toml, or the daemon's plumbline.toml");
  command->add_option("program", options->programs,
                      "Files of one program: all modules and data files that belong to it");
  command->add_option("--output", options->output,
                      "Folder for the corrected files; default: corrected, beside each file");
  command->add_option("--report", options->report, "HTML file for a report with pictures");
  command->add_flag("--json", options->json, "Print the report as JSON");
  command->add_flag("--all", options->all, "Print every point, not only the first");
  command->add_flag("--dry-run", options->dry_run, "Write no program, only the report");
  command
      ->add_option("--tool", options->stated.tools,
                   "KEY=NUMBER: the tool KEY of the program is on the cell's [[tool]] NUMBER; "
                   "NUMBER alone for a program that sets no tool")
      ->expected(1)
      ->take_all();
  command
      ->add_option(
          "--base", options->stated.bases,
          "KEY=x,y,z,..: pose of the base KEY in the robot's base, in the controller's own "
          "numbers")
      ->expected(1)
      ->take_all();
  command
      ->add_option(
          "--load", options->stated.loads,
          "KEY=KG[,X,Y,Z]: payload beside the tool, and its centre of gravity in mm in the "
          "flange frame, where the program sets the load or tool KEY; without KEY= where "
          "it states no load")
      ->expected(1)
      ->take_all();
  command->add_flag("--loads-without-tool", options->loads_without_tool,
                    "The loads of the program do not contain the tool that the cell declares");
  command->add_option("--frames", options->stated.frames,
                      "TOML file with tools, bases and loads that the program's files lack");
  command
      ->add_option("--start", options->stated.starts,
                   "SETTING=KEY: what holds where the program is started; SETTING is tool, base, "
                   "load, extra or shift, KEY may be none; or joints=Q1,Q2,..: where the robot "
                   "stands there, in degrees or mm")
      ->expected(1)
      ->take_all();
  command
      ->add_option("--routine", options->stated.routines,
                   "NAME=harmless: the routine NAME, which is in none of the files, moves nothing "
                   "and sets no tool, base or load")
      ->expected(1)
      ->take_all();
  command->add_flag("--complete", options->complete,
                    "No other file of the controller uses a point of these files");
  command->add_flag("--joints", options->joints, "Correct joint targets, too");
  command->add_flag("--external-axes-still", options->external_axes_still,
                    "External axes do not move the robot's base");
  command
      ->add_option("--offset-bound", options->offset_bound_mm,
                   "Largest difference of the corrections of a point used with several offsets, mm "
                   "[0.02]")
      ->check(NumberWithin(0, 10));
  command->add_option("--temperature", options->temperature_C, "Temperature of the arm, degC")
      ->check(NumberWithin(-50, 150));
  command->add_option("--taught-loaded", options->taught_loaded,
                      "KG[,X,Y,Z]: the points were taught by hand with this payload; the target is "
                      "where the tool was, not the pose that the program states");
  command
      ->add_option("--deflection-sd", options->deflection_sd,
                   "Relative standard deviation of the declared deflections [0.1]")
      ->check(NumberWithin(0, 1));
  command
      ->add_option("--insert", options->insert_mm,
                   "Insert linear motions until the tool deviates from the path by less than this, "
                   "mm")
      ->check(NumberWithin(0.001, 100));
  command->add_flag("--again", options->again,
                    "Correct a corrected program again, from its original");
  command->add_flag(
      "--force", options->force,
      "Replace files in the output folder that no earlier run wrote, or that were edited "
      "since");
  command
      ->add_option("--check", options->check,
                   "OLD NEW: compare two versions of a program, files or folders; changes nothing")
      ->expected(2);
  command->footer(
      "A taught pose is where the loaded tool shall be. Each point is corrected once, and only if\n"
      "all motions that use it have the same known tool, base and load; every other point stays "
      "as\n"
      "it is and is listed with file, line and reason. Only digits of numbers change. The "
      "original\n"
      "files stay; a comment in the corrected ones and NAME.plumbline.json beside them say what "
      "was\n"
      "done, so that a second run changes nothing. See docs/robot-programs.md.\n\n"
      "Examples:\n"
      "  plumbline program cell.toml weld.src weld.dat --report weld.html\n"
      "  plumbline program cell.toml PICK.LS --tool 'UTOOL 1=1' --frames frames.toml\n"
      "  plumbline program cell.toml pick.script --load 4.5,0,0,120 --insert 0.1\n"
      "  plumbline program --check weld.src corrected/weld.src\n\n"
      "Exit codes: 0 every motion's point is corrected, or left by choice: joint targets without\n"
      "--joints, points that no motion uses, files corrected before; 1 a motion's point had to "
      "stay\n"
      "as it is, or a text could not be parsed, with its line and reason (with --check: bytes "
      "other\n"
      "than numbers differ); 2 error, and nothing was written.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
