#include "app/cli/beam_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "app/base/config/cell_reader.h"
#include "app/cli/number_option.h"
#include "app/cli/tool_option.h"
#include "firmware-like/model/materials.h"

namespace plumbline::cli {
namespace {

constexpr int kMaxElements = 1000;
constexpr double kMaxForces = 10000;
constexpr double kMaxLoad = 1e9;          // N, N m, mm; far beyond any real tool
constexpr double kMaxAcceleration = 1e6;  // m/s2, rad/s2

/// An option that corresponds to a key of [tool] in cell.toml, whose reader checks it.
struct ToolFlag {
  const char* flag;
  const char* key;
  const char* help;
};
constexpr ToolFlag kToolFlags[] = {
    {"--length-mm", "length_mm", "Length of the beam"},
    {"--side-mm", "side_mm", "square_tube: outer side"},
    {"--wall-mm", "wall_mm", "square_tube, tube: wall thickness"},
    {"--b-mm", "b_mm", "rectangle: width along x"},
    {"--h-mm", "h_mm", "rectangle: height along y"},
    {"--outer-diameter-mm", "outer_diameter_mm", "tube: outer diameter"},
    {"--diameter-mm", "diameter_mm", "rod: diameter"},
    {"--height-mm", "height_mm", "i_beam: height along y"},
    {"--width-mm", "width_mm", "i_beam: width of the flanges along x"},
    {"--web-mm", "web_mm", "i_beam: thickness of the web"},
    {"--flange-mm", "flange_mm", "i_beam: thickness of a flange"},
    {"--area-mm2", "area_mm2", "Cross-section area, instead of --section"},
    {"--ix-mm4", "ix_mm4", "Second moment of area about x, for bending along y"},
    {"--iy-mm4", "iy_mm4", "Second moment of area about y, for bending along x"},
    {"--youngs-modulus-gpa", "youngs_modulus_GPa",
     "Young's modulus, instead of or overriding --material"},
    {"--poisson-ratio", "poisson_ratio",
     "Poisson's ratio, likewise; required by --theory timoshenko"},
    {"--density-kg-m3", "density_kg_m3", "Density, likewise; required for weight and acceleration"},
    {"--yield-mpa", "yield_MPa", "Yield strength; a larger stress is reported"},
};

/// Checks that the text is a finite number. The reader of [tool] checks the range that the help
/// shows.
CLI::Validator ToolNumber(const char* key) {
  const config::NumberRange range = config::RangeOfToolKey(key);
  return {[range](const std::string& text) {
            if (FiniteNumberFromText(text)) return std::string();
            return fmt::format("{} is not a number from {:g} to {:g}", text, range.min, range.max);
          },
          fmt::format("[{:g}..{:g}]", range.min, range.max)};
}

std::string FlagOf(const std::string& key) {
  if (key == "section" || key == "material") return "--" + key;
  for (const ToolFlag& flag : kToolFlags) {
    if (key == flag.key) return flag.flag;
  }
  return key;
}

/// A fault in [tool], worded for the command line.
std::string FlagFault(const config::Fault& fault) {
  if (fault.what.starts_with("unknown key")) return "does not apply to this --section; remove it";
  const bool of_material = fault.key == "youngs_modulus_GPa" || fault.key == "poisson_ratio" ||
                           fault.key == "density_kg_m3";
  return fault.what + (of_material ? "; or give a --material" : "");
}

/// The flags as the text of a [tool] table, so that the reader of cell.toml checks them.
std::string TomlOf(const BeamOptions& options) {
  const bool timoshenko = options.theory == "timoshenko";
  std::string text = fmt::format("model = \"{}\"\n", timoshenko ? "timoshenko" : "euler_bernoulli");
  if (!options.section.empty()) text += fmt::format("section = \"{}\"\n", options.section);
  if (!options.material.empty()) text += fmt::format("material = \"{}\"\n", options.material);
  for (const auto& [key, value] : options.numbers) text += fmt::format("{} = {}\n", key, value);
  // Values that these loads and this theory do not use are optional.
  const bool by_name = !options.material.empty();
  if (!by_name && !options.numbers.contains("poisson_ratio") && !timoshenko) {
    text += "poisson_ratio = 0.3\n";
  }
  if (!by_name && !options.numbers.contains("density_kg_m3") && !options.LoadsTheMass()) {
    text += "density_kg_m3 = 0\n";
  }
  return text;
}

BeamTool ToolFromFlags(const BeamOptions& options) {
  config::FaultList faults;
  config::TomlDocument document(TomlOf(options), "", faults);
  model::Tool tool = config::ToolFromToml(document.Root());
  document.ReportUnknownKeys();
  if (!faults.HasFaults()) return {tool, ""};
  std::string text;
  for (const config::Fault& fault : faults.All()) {
    text += fmt::format("{}{}: {}", text.empty() ? "" : "\nplumbline beam: ", FlagOf(fault.key),
                        FlagFault(fault));
  }
  throw BeamUsageError(text);
}

BeamTool ToolFromCell(const BeamOptions& options) {
  if (!options.numbers.empty() || !options.section.empty() || !options.material.empty() ||
      !options.theory.empty()) {
    throw BeamUsageError(
        "--cell: describes the whole tool; remove the dimensions, --section, "
        "--material and --theory");
  }
  config::FaultList faults;
  const std::optional<model::CellModel> cell = config::ReadCell(options.cell, faults);
  if (!cell) throw BeamCellError("--cell: has faults\n" + config::FaultsText(faults));
  const Result<int> index = ToolChoice(*cell, options.tool);
  if (!index) throw BeamUsageError(index.error());
  const model::Tool& tool = cell->ToolAt(*index);
  if (tool.rigid) {
    throw BeamCellError(
        fmt::format("--cell: {} has a rigid tool; give it model = \"euler_bernoulli\" "
                    "or \"timoshenko\" and a section",
                    options.cell));
  }
  return {tool, UsedToolText(*cell, *index, options.tool)};
}

/// The numbers between the separators; nullopt if one is not a number or unreasonably large.
std::optional<std::vector<double>> NumbersFromText(const std::string& text, char separator) {
  std::vector<double> numbers;
  std::size_t start = 0;
  while (true) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    const auto number = FiniteNumberFromText(std::string_view(text).substr(start, end - start));
    if (!number || std::abs(*number) > kMaxLoad) return std::nullopt;
    numbers.push_back(*number);
    if (end == text.size()) return numbers;
    start = end + 1;
  }
}

void AddToolOptions(CLI::App& command, BeamOptions& options) {
  command.option_defaults()->group("Tool");
  std::vector<std::string> materials;
  for (const model::NamedMaterial& named : model::NamedMaterials())
    materials.emplace_back(named.name);
  command.add_option("--section", options.section, "Cross-section")
      ->check(CLI::IsMember({"rectangle", "square_tube", "tube", "rod", "i_beam"}));
  command.add_option("--material", options.material, "Material by name")
      ->check(CLI::IsMember(materials));
  for (const ToolFlag& flag : kToolFlags) {
    command
        .add_option_function<double>(
            flag.flag, [&options, key = flag.key](double value) { options.numbers[key] = value; },
            flag.help)
        ->check(ToolNumber(flag.key));
  }
  command.add_option("--theory", options.theory, "Beam theory; default: euler_bernoulli")
      ->check(CLI::IsMember({"euler_bernoulli", "timoshenko"}));
  command.add_option("--cell", options.cell,
                     "CELL.toml whose [tool] to use, instead of the options above");
  AddToolOption(command, options.tool);
  command.add_option("--elements", options.elements, "Finite elements per segment")
      ->check(WholeNumberWithin(1, kMaxElements))
      ->capture_default_str();
}

void AddLoadOptions(CLI::App& command, BeamOptions& options) {
  command.option_defaults()->group("Load");
  command.add_option("--force-n", options.forces, "Forces: 100,200,300 or FIRST:STEP:LAST");
  command
      .add_option("--direction", options.direction,
                  "Axis along which forces and weight act and the beam bends")
      ->check(CLI::IsMember({"x", "y"}))
      ->capture_default_str();
  command
      .add_option("--at-mm", options.at_mm,
                  "Position where force and moment act, also beyond the tip (on a rigid\n"
                  "extension); its displacement is printed, too. Default: the tip")
      ->check(NumberWithin(-kMaxLoad, kMaxLoad));
  command
      .add_option("--moment-nm", options.moment_Nm, "Moment that bends the beam towards +direction")
      ->check(NumberWithin(-kMaxLoad, kMaxLoad));
  command.add_flag("--own-weight", options.own_weight,
                   "Include the beam's own weight, along +direction");
  command
      .add_option("--acceleration-m-s2", options.acceleration_m_s2,
                  "Acceleration of the flange along +direction; the inertia force acts against it")
      ->check(NumberWithin(-kMaxAcceleration, kMaxAcceleration));
  command
      .add_option("--angular-acceleration-rad-s2", options.angular_acceleration_rad_s2,
                  "Angular acceleration of the flange that moves the tip towards +direction")
      ->check(NumberWithin(-kMaxAcceleration, kMaxAcceleration));
}

void AddOutputOptions(CLI::App& command, BeamOptions& options) {
  command.option_defaults()->group("Output");
  command.add_option("--point-mm", options.points,
                     "Z,Y of an assembly point: print its loaded position and its compensation by\n"
                     "the section's slope and by eq. 3 of the paper; may be repeated");
  command.add_flag("--stress", options.stress, "Print moment, shear and stress of each element");
  CLI::Option* csv = command.add_flag("--csv", options.csv, "Print CSV");
  command.add_flag("--json", options.json, "Print JSON")->excludes(csv);
  CLI::Option* paper =
      command.add_flag("--paper-table2", options.paper_table2,
                       "Print Table 2 of the paper with the published columns; excludes all other "
                       "options");
  for (CLI::Option* other : command.get_options()) {
    if (other != paper && other != command.get_help_ptr()) paper->excludes(other);
  }
}

}  // namespace

void AddBeamOptions(CLI::App& command, BeamOptions& options) {
  AddToolOptions(command, options);
  AddLoadOptions(command, options);
  AddOutputOptions(command, options);
}

BeamTool BeamToolOf(const BeamOptions& options) {
  if (options.tool && options.cell.empty()) {
    throw BeamUsageError("--tool: chooses a tool of a cell; give it with --cell");
  }
  return options.cell.empty() ? ToolFromFlags(options) : ToolFromCell(options);
}

std::vector<BeamPoint> BeamPointsOf(const BeamOptions& options, double length_m) {
  std::vector<BeamPoint> points;
  for (const std::string& text : options.points) {
    const auto numbers = NumbersFromText(text, ',');
    if (!numbers || numbers->size() != 2) {
      throw BeamUsageError(fmt::format("--point-mm: \"{}\" is not Z,Y in mm such as 900,40", text));
    }
    const BeamPoint point{1e-3 * numbers->at(0), 1e-3 * numbers->at(1)};
    if (point.z_m < 0 || point.z_m > length_m) {
      throw BeamUsageError(fmt::format("--point-mm: Z of {} is outside the beam, 0..{:.6g} mm",
                                       text, 1e3 * length_m));
    }
    points.push_back(point);
  }
  return points;
}

Result<std::vector<double>> ForceSeriesFromText(const std::string& text) {
  constexpr const char* kForm =
      "write a list 100,200,300 or a series FIRST:STEP:LAST, 100:100:1000";
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
    return Error{fmt::format("a step of {} does not lead from {} to {}", step, first, last)};
  }
  if (steps >= kMaxForces) {
    return Error{fmt::format("\"{}\" has {:.0f} forces; at most {:.0f} are allowed", text,
                             steps + 1, kMaxForces)};
  }
  std::vector<double> forces;
  for (int i = 0; i <= static_cast<int>(steps); ++i) forces.push_back(first + i * step);
  return forces;
}

}  // namespace plumbline::cli
