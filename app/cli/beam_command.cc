#include "app/cli/beam_command.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>

#include "app/cli/beam_print.h"
#include "app/cli/exit_codes.h"
#include "app/config/cell_reader.h"
#include "app/config/tool_reader.h"
#include "firmware-like/beam/materials.h"

namespace plumbline {
namespace {

constexpr int kMaxElements = 1000;
constexpr double kMaxForces = 10000;
constexpr double kStandardGravity_m_s2 = 9.80665;

/// An option that stands for a key of cell.toml's [tool], which checks it.
struct ToolFlag {
  const char* flag;
  const char* key;
  const char* help;
};
constexpr ToolFlag kToolFlags[] = {
    {"--length-mm", "length_mm", "Length of the beam"},
    {"--side-mm", "side_mm", "square_tube: outer side"},
    {"--wall-mm", "wall_mm", "square_tube, tube: wall"},
    {"--b-mm", "b_mm", "rectangle: along x"},
    {"--h-mm", "h_mm", "rectangle: along y"},
    {"--outer-diameter-mm", "outer_diameter_mm", "tube"},
    {"--diameter-mm", "diameter_mm", "rod"},
    {"--height-mm", "height_mm", "i_beam: along y"},
    {"--width-mm", "width_mm", "i_beam: flanges, along x"},
    {"--web-mm", "web_mm", "i_beam: thickness of the web"},
    {"--flange-mm", "flange_mm", "i_beam: thickness of a flange"},
    {"--area-mm2", "area_mm2", "Instead of --section: area"},
    {"--ix-mm4", "ix_mm4", "Second moment about x, for bending along y"},
    {"--iy-mm4", "iy_mm4", "Second moment about y, for bending along x"},
    {"--youngs-modulus-gpa", "youngs_modulus_GPa", "Instead of --material, or to refine it"},
    {"--poisson-ratio", "poisson_ratio", "Likewise; needed by --theory timoshenko"},
    {"--density-kg-m3", "density_kg_m3", "Likewise; needed by weight and acceleration"},
};

struct Options {
  std::map<std::string, double> numbers;  ///< by key, of the tool's flags that were given
  std::string section, material, theory, cell;
  int elements = 10;
  std::string forces, direction = "y";
  std::optional<double> at_mm;
  double moment_Nm = 0, acceleration_m_s2 = 0, angular_acceleration_rad_s2 = 0;
  bool own_weight = false, stress = false, csv = false, json = false, paper_table2 = false;
  std::vector<std::string> points;

  bool LoadsTheMass() const {
    return own_weight || acceleration_m_s2 != 0 || angular_acceleration_rad_s2 != 0;
  }
};

/// A fault of the arguments: `--at-mm: 900 lies outside the beam ...`.
struct UsageError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::string FlagOf(const std::string& key) {
  if (key == "section" || key == "material") return "--" + key;
  for (const ToolFlag& flag : kToolFlags) {
    if (key == flag.key) return flag.flag;
  }
  return key;
}

/// A fault of the [tool] in the words of the command line.
std::string FlagFault(const Fault& fault) {
  if (fault.what.starts_with("unknown key"))
    return "does not belong to this --section; leave it out";
  const bool of_material = fault.key == "youngs_modulus_GPa" || fault.key == "poisson_ratio" ||
                           fault.key == "density_kg_m3";
  return fault.what + (of_material ? "; or name a --material" : "");
}

/// The flags as the [tool] of a cell, so that both are checked by the same reader.
std::string TomlOf(const Options& options) {
  const bool timoshenko = options.theory == "timoshenko";
  std::string text = fmt::format("model = \"{}\"\n", timoshenko ? "timoshenko" : "euler_bernoulli");
  if (!options.section.empty()) text += fmt::format("section = \"{}\"\n", options.section);
  if (!options.material.empty()) text += fmt::format("material = \"{}\"\n", options.material);
  for (const auto& [key, value] : options.numbers) text += fmt::format("{} = {}\n", key, value);
  // What these loads and this theory do not need may stay unsaid.
  const bool by_name = !options.material.empty();
  if (!by_name && !options.numbers.contains("poisson_ratio") && !timoshenko) {
    text += "poisson_ratio = 0.3\n";
  }
  if (!by_name && !options.numbers.contains("density_kg_m3") && !options.LoadsTheMass()) {
    text += "density_kg_m3 = 0\n";
  }
  return text;
}

Tool ToolFromFlags(const Options& options) {
  FaultList faults;
  TomlDocument document(TomlOf(options), "", faults);
  Tool tool = ToolFromToml(document.Root());
  document.ReportUnknownKeys();
  if (!faults.HasFaults()) return tool;
  std::string told;
  for (const Fault& fault : faults.All()) {
    told += fmt::format("{}{}: {}", told.empty() ? "" : "\nplumbline beam: ", FlagOf(fault.key),
                        FlagFault(fault));
  }
  throw UsageError(told);
}

Tool ToolFromCell(const Options& options) {
  if (!options.numbers.empty() || !options.section.empty() || !options.material.empty() ||
      !options.theory.empty()) {
    throw UsageError(
        "--cell: describes the whole tool; leave its dimensions, --section, "
        "--material and --theory out");
  }
  FaultList faults;
  const std::optional<CellModel> cell = ReadCell(options.cell, faults);
  if (!cell) throw UsageError("--cell: has faults\n" + FaultsText(faults));
  if (cell->tool.rigid) {
    throw UsageError(
        fmt::format("--cell: {} has a rigid tool; give it model = \"euler_bernoulli\" "
                    "or \"timoshenko\" and a section",
                    options.cell));
  }
  return cell->tool;
}

std::optional<double> NumberFromText(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// The numbers between separators; nothing where one of them is no number.
std::optional<std::vector<double>> NumbersFromText(const std::string& text, char separator) {
  std::vector<double> numbers;
  std::size_t start = 0;
  while (true) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    const auto number = NumberFromText(std::string_view(text).substr(start, end - start));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
    if (end == text.size()) return numbers;
    start = end + 1;
  }
}

std::vector<BeamPoint> PointsFrom(const Options& options, double length_m) {
  std::vector<BeamPoint> points;
  for (const std::string& text : options.points) {
    const auto numbers = NumbersFromText(text, ',');
    if (!numbers || numbers->size() != 2) {
      throw UsageError(
          fmt::format("--point-mm: \"{}\" is not Z,Y in mm; for example 900,40", text));
    }
    const BeamPoint point{1e-3 * numbers->at(0), 1e-3 * numbers->at(1)};
    if (point.z_m < 0 || point.z_m > length_m) {
      throw UsageError(fmt::format("--point-mm: Z of {} lies outside the beam, 0..{:.6g} mm", text,
                                   1e3 * length_m));
    }
    points.push_back(point);
  }
  return points;
}

/// What acts besides the force of the series.
BeamLoads SteadyLoads(const Options& options, const Vec3& along, double at_m) {
  BeamLoads loads;
  const Vec3 turns = Vec3::UnitZ().cross(along);  // a rotation about it moves +z towards `along`
  if (options.own_weight) loads.g_F = kStandardGravity_m_s2 * along;
  loads.acceleration_F = options.acceleration_m_s2 * along;
  loads.angular_acceleration_F = options.angular_acceleration_rad_s2 * turns;
  if (options.moment_Nm != 0) {
    loads.points.push_back(
        {.z_m = at_m, .force_F = Vec3::Zero(), .moment_F = options.moment_Nm * turns});
  }
  return loads;
}

std::string InWords(const Options& options, double at_m) {
  std::string words = fmt::format("force at {:.6g} mm", 1e3 * at_m);
  if (options.moment_Nm != 0) {
    words += fmt::format(", moment of {:.6g} N m there", options.moment_Nm);
  }
  if (options.own_weight) words += ", own weight";
  if (options.acceleration_m_s2 != 0) {
    words += fmt::format(", acceleration of {:.6g} m/s2", options.acceleration_m_s2);
  }
  if (options.angular_acceleration_rad_s2 != 0) {
    words += fmt::format(", of {:.6g} rad/s2", options.angular_acceleration_rad_s2);
  }
  return words;
}

BeamSeries Solve(const Options& options) {
  BeamSeries series;
  series.tool = options.cell.empty() ? ToolFromFlags(options) : ToolFromCell(options);
  series.axis = options.direction == "x" ? BendingAxis::kX : BendingAxis::kY;
  series.stress = options.stress;
  const Beam beam(series.tool, options.elements);
  const double at_m = options.at_mm ? 1e-3 * *options.at_mm : beam.Length();
  if (!(at_m > 0 && at_m <= beam.Length())) {
    throw UsageError(fmt::format("--at-mm: {:.6g} lies outside the beam, above 0 up to {:.6g} mm",
                                 1e3 * at_m, 1e3 * beam.Length()));
  }
  std::vector<double> forces{0};
  if (!options.forces.empty()) {
    const auto read = ForceSeriesFromText(options.forces);
    if (!read) throw UsageError("--force-n: " + read.error());
    forces = *read;
  } else if (options.moment_Nm == 0 && !options.LoadsTheMass()) {
    throw UsageError(
        "nothing loads the beam; give --force-n, --moment-nm, --own-weight or "
        "--acceleration-m-s2");
  }
  series.points = PointsFrom(options, beam.Length());
  series.loads = InWords(options, at_m);
  const Vec3 along = Vec3::Unit(static_cast<int>(series.axis));
  for (const double force_N : forces) {
    BeamLoads loads = SteadyLoads(options, along, at_m);
    loads.points.push_back({.z_m = at_m, .force_F = force_N * along});
    series.cases.push_back({force_N, beam.Solve(loads)});
  }
  return series;
}

int Run(const Options& options) {
  if (options.paper_table2) {
    PrintPaperTable2(std::cout);
    return kExitOk;
  }
  try {
    const BeamSeries series = Solve(options);
    if (options.csv) {
      PrintBeamCsv(series, std::cout);
    } else if (options.json) {
      PrintBeamJson(series, std::cout);
    } else {
      PrintBeamTable(series, std::cout);
    }
  } catch (const UsageError& error) {
    std::cerr << "plumbline beam: " << error.what() << '\n';
    return kExitUsage;
  }
  return kExitOk;
}

void AddToolOptions(CLI::App& command, Options& options) {
  command.option_defaults()->group("Tool");
  std::vector<std::string> materials;
  for (const NamedMaterial& named : NamedMaterials()) materials.emplace_back(named.name);
  command.add_option("--section", options.section, "Cross-section")
      ->check(CLI::IsMember({"rectangle", "square_tube", "tube", "rod", "i_beam"}));
  command.add_option("--material", options.material, "Material by name")
      ->check(CLI::IsMember(materials));
  for (const ToolFlag& flag : kToolFlags) {
    command.add_option_function<double>(
        flag.flag, [&options, key = flag.key](double value) { options.numbers[key] = value; },
        flag.help);
  }
  command.add_option("--theory", options.theory, "Beam theory; default: euler_bernoulli")
      ->check(CLI::IsMember({"euler_bernoulli", "timoshenko"}));
  command.add_option("--cell", options.cell, "Instead of all that: the [tool] of a CELL.toml");
  command.add_option("--elements", options.elements, "Finite elements, in each segment")
      ->check(CLI::Range(1, kMaxElements))
      ->capture_default_str();
}

void AddLoadOptions(CLI::App& command, Options& options) {
  command.option_defaults()->group("Load");
  command.add_option("--force-n", options.forces, "Forces: 100,200,300 or FIRST:STEP:LAST");
  command.add_option("--direction", options.direction, "Forces, weight and bending along x or y")
      ->check(CLI::IsMember({"x", "y"}))
      ->capture_default_str();
  command.add_option("--at-mm", options.at_mm, "Where force and moment act; default: the tip");
  command.add_option("--moment-nm", options.moment_Nm, "Moment that bends along +direction");
  command.add_flag("--own-weight", options.own_weight, "Gravity, along +direction");
  command.add_option("--acceleration-m-s2", options.acceleration_m_s2,
                     "Of the flange, along +direction; its inertia load acts the other way");
  command.add_option("--angular-acceleration-rad-s2", options.angular_acceleration_rad_s2,
                     "Of the flange, moving the tip along +direction");
}

void AddOutputOptions(CLI::App& command, Options& options) {
  command.option_defaults()->group("Output");
  command.add_option("--point-mm", options.points,
                     "Z,Y of an assembly point: where it lands, and its compensation by its\n"
                     "section and by the paper's eq. 3; may be repeated");
  command.add_flag("--stress", options.stress, "Moment, shear and stress of each element");
  CLI::Option* csv = command.add_flag("--csv", options.csv, "Write CSV");
  command.add_flag("--json", options.json, "Write JSON")->excludes(csv);
  command.add_flag("--paper-table2", options.paper_table2,
                   "The paper's Table 2 beside its published columns");
}

}  // namespace

Result<std::vector<double>> ForceSeriesFromText(const std::string& text) {
  constexpr const char* kForm = "give numbers as 100,200,300 or FIRST:STEP:LAST as 100:100:1000";
  if (text.find(':') == std::string::npos) {
    const auto list = NumbersFromText(text, ',');
    if (!list) return Error{fmt::format("\"{}\" is not a list of numbers; {}", text, kForm)};
    return *list;
  }
  const auto series = NumbersFromText(text, ':');
  if (!series || series->size() != 3) {
    return Error{fmt::format("\"{}\" is not a series of numbers; {}", text, kForm)};
  }
  const double first = series->at(0), step = series->at(1), last = series->at(2);
  const double steps = std::floor((last - first) / step + 1e-9);
  if (step == 0 || !(steps >= 0)) {
    return Error{fmt::format("a step of {} never leads from {} to {}", step, first, last)};
  }
  if (steps >= kMaxForces) {
    return Error{fmt::format("\"{}\" has {:.0f} forces; at most {:.0f} are taken", text, steps + 1,
                             kMaxForces)};
  }
  std::vector<double> forces;
  for (int i = 0; i <= static_cast<int>(steps); ++i) forces.push_back(first + i * step);
  return forces;
}

void AddBeamCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("beam", "Deflection and stress of a tool as a beam");
  AddToolOptions(*command, *options);
  AddLoadOptions(*command, *options);
  AddOutputOptions(*command, *options);
  command->footer(
      "A cantilever along z of the flange, clamped at z = 0; node 1 is the clamp.\n\n"
      "Examples:\n"
      "  plumbline beam --length-mm 900 --section square_tube --side-mm 60 --wall-mm 4 \\\n"
      "      --material steel --force-n 100:100:500 --own-weight --stress\n"
      "  plumbline beam --length-mm 1800 --section rectangle --b-mm 50 --h-mm 50 \\\n"
      "      --youngs-modulus-gpa 200 --elements 3 --force-n 100 --point-mm 900,40\n"
      "  plumbline beam --cell config/cells/kr210.toml --force-n 800 --direction x --csv\n"
      "  plumbline beam --paper-table2\n\n"
      "Exit codes: 0 done, 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline
