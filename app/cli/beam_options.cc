#include "app/cli/beam_options.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>

#include "app/cli/number_option.h"
#include "app/config/cell_reader.h"
#include "app/config/tool_reader.h"
#include "firmware-like/beam/materials.h"

namespace plumbline {
namespace {

constexpr int kMaxElements = 1000;
constexpr double kMaxForces = 10000;
constexpr double kLargestLoad = 1e9;          // N, N m, mm: beyond it nothing is a tool
constexpr double kLargestAcceleration = 1e6;  // m/s2, rad/s2

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

/// A finite number; whether it lies in the range that the help shows is told by the reader of the
/// [tool].
CLI::Validator ToolNumber(const char* key) {
  const NumberRange range = RangeOfToolKey(key);
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

/// A fault of the [tool] in the words of the command line.
std::string FlagFault(const Fault& fault) {
  if (fault.what.starts_with("unknown key"))
    return "does not belong to this --section; leave it out";
  const bool of_material = fault.key == "youngs_modulus_GPa" || fault.key == "poisson_ratio" ||
                           fault.key == "density_kg_m3";
  return fault.what + (of_material ? "; or name a --material" : "");
}

/// The flags as the [tool] of a cell, so that both are checked by the same reader.
std::string TomlOf(const BeamOptions& options) {
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

Tool ToolFromFlags(const BeamOptions& options) {
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
  throw BeamUsageError(told);
}

Tool ToolFromCell(const BeamOptions& options) {
  if (!options.numbers.empty() || !options.section.empty() || !options.material.empty() ||
      !options.theory.empty()) {
    throw BeamUsageError(
        "--cell: describes the whole tool; leave its dimensions, --section, "
        "--material and --theory out");
  }
  FaultList faults;
  const std::optional<CellModel> cell = ReadCell(options.cell, faults);
  if (!cell) throw BeamCellError("--cell: has faults\n" + FaultsText(faults));
  if (cell->tool.rigid) {
    throw BeamCellError(
        fmt::format("--cell: {} has a rigid tool; give it model = \"euler_bernoulli\" "
                    "or \"timoshenko\" and a section",
                    options.cell));
  }
  return cell->tool;
}

/// The numbers between separators; nothing where one of them is no number, or absurd.
std::optional<std::vector<double>> NumbersFromText(const std::string& text, char separator) {
  std::vector<double> numbers;
  std::size_t start = 0;
  while (true) {
    const std::size_t end = std::min(text.find(separator, start), text.size());
    const auto number = FiniteNumberFromText(std::string_view(text).substr(start, end - start));
    if (!number || std::abs(*number) > kLargestLoad) return std::nullopt;
    numbers.push_back(*number);
    if (end == text.size()) return numbers;
    start = end + 1;
  }
}

void AddToolOptions(CLI::App& command, BeamOptions& options) {
  command.option_defaults()->group("Tool");
  std::vector<std::string> materials;
  for (const NamedMaterial& named : NamedMaterials()) materials.emplace_back(named.name);
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
  command.add_option("--cell", options.cell, "Instead of all that: the [tool] of a CELL.toml");
  command.add_option("--elements", options.elements, "Finite elements, in each segment")
      ->check(WholeNumberWithin(1, kMaxElements))
      ->capture_default_str();
}

void AddLoadOptions(CLI::App& command, BeamOptions& options) {
  command.option_defaults()->group("Load");
  command.add_option("--force-n", options.forces, "Forces: 100,200,300 or FIRST:STEP:LAST");
  command.add_option("--direction", options.direction, "Forces, weight and bending along x or y")
      ->check(CLI::IsMember({"x", "y"}))
      ->capture_default_str();
  command.add_option("--at-mm", options.at_mm, "Where force and moment act; default: the tip")
      ->check(NumberWithin(-kLargestLoad, kLargestLoad));
  command.add_option("--moment-nm", options.moment_Nm, "Moment that bends along +direction")
      ->check(NumberWithin(-kLargestLoad, kLargestLoad));
  command.add_flag("--own-weight", options.own_weight, "Gravity, along +direction");
  command
      .add_option("--acceleration-m-s2", options.acceleration_m_s2,
                  "Of the flange, along +direction; its inertia load acts the other way")
      ->check(NumberWithin(-kLargestAcceleration, kLargestAcceleration));
  command
      .add_option("--angular-acceleration-rad-s2", options.angular_acceleration_rad_s2,
                  "Of the flange, moving the tip along +direction")
      ->check(NumberWithin(-kLargestAcceleration, kLargestAcceleration));
}

void AddOutputOptions(CLI::App& command, BeamOptions& options) {
  command.option_defaults()->group("Output");
  command.add_option("--point-mm", options.points,
                     "Z,Y of an assembly point: where it lands, and its compensation by its\n"
                     "section and by the paper's eq. 3; may be repeated");
  command.add_flag("--stress", options.stress, "Moment, shear and stress of each element");
  CLI::Option* csv = command.add_flag("--csv", options.csv, "Write CSV");
  command.add_flag("--json", options.json, "Write JSON")->excludes(csv);
  CLI::Option* paper =
      command.add_flag("--paper-table2", options.paper_table2,
                       "The paper's Table 2 beside its published columns; takes no other option");
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

Tool BeamToolOf(const BeamOptions& options) {
  return options.cell.empty() ? ToolFromFlags(options) : ToolFromCell(options);
}

std::vector<BeamPoint> BeamPointsOf(const BeamOptions& options, double length_m) {
  std::vector<BeamPoint> points;
  for (const std::string& text : options.points) {
    const auto numbers = NumbersFromText(text, ',');
    if (!numbers || numbers->size() != 2) {
      throw BeamUsageError(
          fmt::format("--point-mm: \"{}\" is not Z,Y in mm; for example 900,40", text));
    }
    const BeamPoint point{1e-3 * numbers->at(0), 1e-3 * numbers->at(1)};
    if (point.z_m < 0 || point.z_m > length_m) {
      throw BeamUsageError(fmt::format("--point-mm: Z of {} lies outside the beam, 0..{:.6g} mm",
                                       text, 1e3 * length_m));
    }
    points.push_back(point);
  }
  return points;
}

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

}  // namespace plumbline
