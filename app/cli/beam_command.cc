#include "app/cli/beam_command.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <memory>

#include "app/base/terminal/terminal_output.h"
#include "app/cli/beam_options.h"
#include "app/cli/beam_print.h"
#include "app/cli/exit_codes.h"
#include "firmware-like/deflection/linear_range.h"

namespace plumbline::cli {
namespace {

constexpr double kStandardGravity_m_s2 = 9.80665;

/// Where force and moment act: on the beam, or beyond its tip on a rigid extension.
struct LoadPlace {
  double on_beam_m = 0;
  double beyond_m = 0;
};

/// A rotation about this axis moves +z towards `along`.
Vec3 BendingAbout(const Vec3& along) {
  return Vec3::UnitZ().cross(along);
}

/// A force at z beyond the tip L: the same force at the tip, with the moment F (z - L).
beam::PointLoad ForceAt(const LoadPlace& place, double force_N, const Vec3& along) {
  return {.z_m = place.on_beam_m,
          .force_F = force_N * along,
          .moment_F = force_N * place.beyond_m * BendingAbout(along)};
}

/// The loads that act in addition to the force of the series.
beam::BeamLoads ConstantLoads(const BeamOptions& options, const Vec3& along,
                              const LoadPlace& place) {
  beam::BeamLoads loads;
  const Vec3 bending = BendingAbout(along);
  if (options.own_weight) loads.g_F = kStandardGravity_m_s2 * along;
  loads.acceleration_F = options.acceleration_m_s2 * along;
  loads.angular_acceleration_F = options.angular_acceleration_rad_s2 * bending;
  if (options.moment_Nm != 0) {
    loads.points.push_back({.z_m = place.on_beam_m, .moment_F = options.moment_Nm * bending});
  }
  return loads;
}

std::string LoadsText(const BeamOptions& options, const LoadPlace& place) {
  std::string words = fmt::format("force at {:.6g} mm", 1e3 * (place.on_beam_m + place.beyond_m));
  if (place.beyond_m > 0) {
    words += fmt::format(", {:.6g} mm beyond the tip", 1e3 * place.beyond_m);
  }
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

BeamSeries Solve(const BeamOptions& options) {
  BeamSeries series;
  BeamTool chosen = BeamToolOf(options);
  series.tool = std::move(chosen.tool);
  series.used_tool = std::move(chosen.used);
  series.axis = options.direction == "x" ? BendingAxis::kX : BendingAxis::kY;
  series.stress = options.stress;
  const beam::Beam beam(series.tool, options.elements);
  const double at_m = options.at_mm ? 1e-3 * *options.at_mm : beam.Length();
  if (!(at_m > 0)) {
    throw BeamUsageError(fmt::format(
        "--at-mm: {:.6g} is not on the free side of the clamp at 0; give a value above 0",
        1e3 * at_m));
  }
  const LoadPlace place{std::min(at_m, beam.Length()), std::max(0.0, at_m - beam.Length())};
  std::vector<double> forces{0};
  if (!options.forces.empty()) {
    const auto read = ForceSeriesFromText(options.forces);
    if (!read) throw BeamUsageError("--force-n: " + read.error());
    forces = *read;
  } else if (options.moment_Nm == 0 && !options.LoadsTheMass()) {
    throw BeamUsageError(
        "the beam has no load; give --force-n, --moment-nm, --own-weight or "
        "--acceleration-m-s2");
  }
  series.points = BeamPointsOf(options, beam.Length());
  series.loads = LoadsText(options, place);
  if (options.at_mm) series.force_at_m = at_m;
  const Vec3 along = Vec3::Unit(static_cast<int>(series.axis));
  for (const double force_N : forces) {
    beam::BeamLoads loads = ConstantLoads(options, along, place);
    loads.points.push_back(ForceAt(place, force_N, along));
    series.cases.push_back({force_N, beam.Solve(loads)});
  }
  return series;
}

/// Warns if a tip deflection exceeds the validity of linear beam theory, or the stress the yield
/// strength.
void WarnAboutLinearTheory(const BeamSeries& series) {
  double largest = 0, force_N = 0;
  for (const BeamCase& load_case : series.cases) {
    const double share = load_case.solution.Tip().d_F.norm() / series.tool.Length();
    if (share <= largest) continue;
    largest = share;
    force_N = load_case.force_N;
  }
  if (largest > deflection::kLargestLinearBend) {
    std::cerr << fmt::format(
        "plumbline beam: warning: at {:g} N the tip moves by {:.0f} % of the length; linear theory "
        "is valid up to about {:.0f} %: it neglects that the tip moves towards the clamp, here by "
        "about {:.3g} mm\n",
        force_N, 100 * largest, 100 * deflection::kLargestLinearBend,
        1e3 * 0.6 * largest * largest * series.tool.Length());
  }
  for (const BeamCase& load_case : series.cases) {
    const auto yield = deflection::YieldShare(load_case.solution);
    if (!yield || *yield <= 1) continue;
    std::cerr << fmt::format(
        "plumbline beam: warning: at {:g} N the stress is {:.0f} % of the yield strength: the beam "
        "bends permanently, and linear theory does not hold\n",
        load_case.force_N, 100 * *yield);
    break;
  }
}

int Run(const BeamOptions& options) {
  if (options.paper_table2) {
    PrintPaperTable2(std::cout << terminal::ForReading);
    return kExitOk;
  }
  try {
    const BeamSeries series = Solve(options);
    if (!series.used_tool.empty()) std::cerr << "plumbline beam: " << series.used_tool << '\n';
    WarnAboutLinearTheory(series);
    if (options.csv) {
      PrintBeamCsv(series, std::cout);
    } else if (options.json) {
      PrintBeamJson(series, std::cout);
    } else {
      PrintBeamTable(series, std::cout << terminal::ForReading);
    }
  } catch (const BeamCellError& error) {
    std::cerr << "plumbline beam: " << error.what() << '\n';
    return kExitFault;
  } catch (const BeamUsageError& error) {
    std::cerr << "plumbline beam: " << error.what() << '\n';
    return kExitUsage;
  }
  return kExitOk;
}

}  // namespace

void AddBeamCommand(CLI::App& app, int& exit_code) {
  auto options = std::make_shared<BeamOptions>();
  CLI::App* command =
      app.add_subcommand("beam", "Compute deflection and stress of a beam-shaped tool");
  AddBeamOptions(*command, *options);
  command->footer(
      "The tool is a cantilever along z of the flange, clamped at z = 0, where node 1 is.\n\n"
      "Examples:\n"
      "  plumbline beam --length-mm 900 --section square_tube --side-mm 60 \\\n"
      "      --wall-mm 4 --material steel --force-n 100:100:500 --own-weight --stress\n"
      "  plumbline beam --length-mm 1800 --section rectangle --b-mm 50 --h-mm 50 \\\n"
      "      --youngs-modulus-gpa 200 --elements 3 --force-n 100 --point-mm 900,40\n"
      "  plumbline beam --cell tests/virtual_cell/demo/cockpit-cell.toml \\\n"
      "      --force-n 800 --csv\n"
      "  plumbline beam --paper-table2\n\n"
      "Exit codes: 0 success, 1 the cell has faults or cannot be read, 2 wrong arguments.");
  command->callback([options, &exit_code] { exit_code = Run(*options); });
}

}  // namespace plumbline::cli
