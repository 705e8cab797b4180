// plumbline beam: deflection and stress of a beam-shaped tool for a series of loads.
#include <fmt/format.h>
#include <fmt/ostream.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstddef>
#include <iostream>
#include <memory>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cli/beam_options.h"
#include "app/cli/beam_paper.h"
#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "app/cli/rounded.h"
#include "firmware-like/beam/beam.h"
#include "firmware-like/deflection/linear_range.h"

namespace plumbline::cli {
namespace {

/// The beam under one force of the series.
struct BeamCase {
  double force_N = 0;
  beam::BeamSolution solution;
};

/// A series of load cases in one plane of bending.
struct BeamSeries {
  model::Tool tool;
  std::string used_tool{};  ///< which of several tools of a cell; empty: the only one
  BendingAxis axis = BendingAxis::kY;
  std::string loads;                 ///< description of all loads
  std::optional<double> force_at_m;  ///< position of force and moment; may be beyond the tip
  std::vector<BeamPoint> points;     ///< points to compensate
  bool stress = false;
  std::vector<BeamCase> cases;
};

/// The section at z. Beyond the tip, at L, on a rigid extension of it:
///   d = d_L + theta_L (z - L),  theta = theta_L
/// Only z_m, d_F and r_F are set.
beam::SectionState SectionOrExtension(const beam::BeamSolution& solution, double z_m) {
  const beam::SectionState tip = solution.Tip();
  const beam::SectionState at = z_m <= tip.z_m ? solution.At(z_m) : tip;
  const Vec3 lever(0, 0, std::max(0.0, z_m - tip.z_m));
  return {.z_m = z_m, .d_F = at.d_F + at.r_F.cross(lever), .r_F = at.r_F};
}

constexpr double kMm = 1e3, kMrad = 1e3, kMPa = 1e-6;

/// State of a section in the plane of bending, in output units.
struct NodeValues {
  double z_mm, displacement_mm, slope_mrad, moment_Nm, shear_N;
};

/// Adding 0.0 turns -0 into 0.
NodeValues ValuesOf(const beam::SectionState& state, BendingAxis axis) {
  const bool along_x = axis == BendingAxis::kX;
  const double slope = along_x ? state.r_F.y() : -state.r_F.x();
  const double moment_Nm = along_x ? state.moment_F.y() : -state.moment_F.x();
  const int k = static_cast<int>(axis);
  return {kMm * state.z_m, kMm * state.d_F[k] + 0.0, kMrad * slope + 0.0, moment_Nm + 0.0,
          state.force_F[k] + 0.0};
}

bool IsBeyondTip(const BeamSeries& series) {
  return series.force_at_m && *series.force_at_m > series.tool.Length();
}

const model::Section& SectionInboardOf(const beam::BeamSolution& solution, int node) {
  return solution.elements()[static_cast<std::size_t>(std::max(node - 1, 0))].section;
}

void PrintSegments(const BeamSeries& series, std::ostream& out) {
  double root_mm = 0;
  for (const model::ToolSegment& segment : series.tool.segments) {
    const double tip_mm = root_mm + kMm * segment.length_m;
    const double moment_m4 =
        series.axis == BendingAxis::kX ? segment.section.iy_m4 : segment.section.ix_m4;
    fmt::print(out,
               "  {:.1f} .. {:.1f} mm: A {:.6g} mm2, I {:.6g} mm4, E {:.4g} GPa, {:.5g} kg/m3\n",
               root_mm, tip_mm, 1e6 * segment.section.area_m2, 1e12 * moment_m4,
               1e-9 * segment.material.youngs_modulus_Pa, segment.material.density_kg_m3);
    root_mm = tip_mm;
  }
}

void PrintNodes(const BeamSeries& series, const BeamCase& load_case, std::ostream& out) {
  fmt::print(out, "  {:>4} {:>10} {:>14} {:>12} {:>12} {:>12}\n", "node", "z", "displacement",
             "slope", "moment", "shear");
  fmt::print(out, "  {:>4} {:>10} {:>14} {:>12} {:>12} {:>12}\n", "", "mm", "mm", "mrad", "N m",
             "N");
  for (int node = 0; node < load_case.solution.node_count(); ++node) {
    const NodeValues v = ValuesOf(load_case.solution.Node(node), series.axis);
    fmt::print(out, "  {:>4} {:>10.1f} {:>14.4f} {:>12.5f} {:>12.3f} {:>12.3f}\n", node + 1, v.z_mm,
               WithoutNegativeZero(v.displacement_mm, 4), WithoutNegativeZero(v.slope_mrad, 5),
               WithoutNegativeZero(v.moment_Nm, 3), WithoutNegativeZero(v.shear_N, 3));
  }
}

/// The displacement where force and moment act.
void PrintForcePlace(const BeamSeries& series, const BeamCase& load_case, std::ostream& out) {
  if (!series.force_at_m) return;
  const NodeValues v =
      ValuesOf(SectionOrExtension(load_case.solution, *series.force_at_m), series.axis);
  fmt::print(out, "  {:>4} {:>9.1f} {:>14.4f} {:>12.5f}{}\n", "force", v.z_mm,
             WithoutNegativeZero(v.displacement_mm, 4), WithoutNegativeZero(v.slope_mrad, 5),
             IsBeyondTip(series) ? "  on the rigid extension" : "");
}

/// The row of the force point, if it was given; without moment, shear and stress, which the nodes
/// have.
void PrintForcePlaceCsv(const BeamSeries& series, const BeamCase& load_case, std::ostream& out) {
  if (!series.force_at_m) return;
  const NodeValues v =
      ValuesOf(SectionOrExtension(load_case.solution, *series.force_at_m), series.axis);
  fmt::print(out, "{:.10g},force,{:.10g},{:.9g},{:.9g},,{}\n", load_case.force_N, v.z_mm,
             v.displacement_mm, v.slope_mrad, series.stress ? ",,," : "");
}

void PrintStress(const BeamSeries& series, const BeamCase& load_case, std::ostream& out) {
  const beam::BeamSolution& solution = load_case.solution;
  fmt::print(out, "\n  {:>7} {:>16} {:>9} {:>9} {:>8} {:>7} {:>9} {:>6}\n", "element", "from .. to",
             "|moment|", "|shear|", "bending", "shear", "von Mises", "at z");
  fmt::print(out, "  {:>7} {:>16} {:>9} {:>9} {:>8} {:>7} {:>9} {:>6}\n", "", "mm", "N m", "N",
             "MPa", "MPa", "MPa", "mm");
  for (int e = 0; e + 1 < solution.node_count(); ++e) {
    const beam::ElementStress stress = beam::StressInElement(solution, e);
    const NodeValues moment = ValuesOf(stress.largest_moment, series.axis);
    const NodeValues shear = ValuesOf(stress.largest_shear, series.axis);
    fmt::print(
        out, "  {:>7} {:>16} {:>9.3f} {:>9.3f}", e + 1,
        fmt::format("{:.1f} .. {:.1f}", kMm * solution.NodeZ(e), kMm * solution.NodeZ(e + 1)),
        std::abs(moment.moment_Nm), std::abs(shear.shear_N));
    if (stress.peak) {
      fmt::print(out, " {:>8.3f} {:>7.3f} {:>9.3f} {:>6.1f}\n",
                 kMPa * stress.peak->stress.normal_Pa, kMPa * stress.peak->stress.shear_Pa,
                 kMPa * stress.peak->stress.von_mises_Pa, kMm * stress.peak->z_m);
    } else {
      fmt::print(out, " {:>8}\n", "unknown");
    }
  }
  const beam::LargestStress largest = beam::LargestStressOf(solution);
  if (largest.peak) {
    fmt::print(out, "  largest: {:.3f} MPa in element {} at {:.1f} mm{}\n",
               kMPa * largest.peak->stress.von_mises_Pa, largest.element + 1,
               kMm * largest.peak->z_m,
               largest.complete ? "" : ", among the elements whose stress is known");
  }
}

void PrintPoints(const BeamSeries& series, const BeamCase& load_case, std::ostream& out) {
  const char name = series.axis == BendingAxis::kX ? 'x' : 'y';
  fmt::print(out, "\n  {:<24} {:>12} {:>12}\n", "point", "z", name);
  fmt::print(out, "  {:<24} {:>12} {:>12}\n", "", "mm", "mm");
  const auto row = [&](const char* what, const BeamPoint& p) {
    fmt::print(out, "  {:<24} {:>12.4f} {:>12.4f}\n", what, kMm * p.z_m,
               WithoutNegativeZero(kMm * p.y_m, 4));
  };
  for (const BeamPoint& point : series.points) {
    row("as taught", point);
    row("loaded", LoadedPoint(load_case.solution, series.axis, point));
    row("compensated: section", CompensatedBySection(load_case.solution, series.axis, point));
    row("compensated: eq. 3", CompensatedByElementAngle(load_case.solution, series.axis, point));
  }
}

void PrintSummary(const BeamSeries& series, std::ostream& out) {
  fmt::print(out, "\nTip over the series\n  {:>12} {:>14} {:>12}", "force N", "displace. mm",
             "slope mrad");
  if (IsBeyondTip(series)) fmt::print(out, " {:>14}", "at force mm");
  if (series.stress) fmt::print(out, " {:>14} {:>10}", "von Mises MPa", "at z mm");
  out << '\n';
  for (const BeamCase& load_case : series.cases) {
    const NodeValues tip = ValuesOf(load_case.solution.Tip(), series.axis);
    fmt::print(out, "  {:>12.6g} {:>14.4f} {:>12.5f}", load_case.force_N,
               WithoutNegativeZero(tip.displacement_mm, 4), WithoutNegativeZero(tip.slope_mrad, 5));
    if (IsBeyondTip(series)) {
      const NodeValues at =
          ValuesOf(SectionOrExtension(load_case.solution, *series.force_at_m), series.axis);
      fmt::print(out, " {:>14.4f}", WithoutNegativeZero(at.displacement_mm, 4));
    }
    if (series.stress) {
      if (const auto peak = beam::LargestStressOf(load_case.solution).peak) {
        fmt::print(out, " {:>14.3f} {:>10.1f}", kMPa * peak->stress.von_mises_Pa, kMm * peak->z_m);
      } else {
        fmt::print(out, " {:>14}", "unknown");
      }
    }
    out << '\n';
  }
}

nlohmann::json StressJson(const beam::SectionStress& stress) {
  return {{"normal_MPa", kMPa * stress.normal_Pa},
          {"shear_MPa", kMPa * stress.shear_Pa},
          {"von_mises_MPa", kMPa * stress.von_mises_Pa}};
}

nlohmann::json PointJson(const BeamPoint& point) {
  return {kMm * point.z_m, kMm * point.y_m};
}

nlohmann::json CaseJson(const BeamSeries& series, const BeamCase& load_case) {
  const beam::BeamSolution& solution = load_case.solution;
  nlohmann::json written = {{"force_N", load_case.force_N}};
  for (int node = 0; node < solution.node_count(); ++node) {
    const NodeValues v = ValuesOf(solution.Node(node), series.axis);
    written["nodes"].push_back({{"node", node + 1},
                                {"z_mm", v.z_mm},
                                {"displacement_mm", v.displacement_mm},
                                {"slope_mrad", v.slope_mrad},
                                {"moment_Nm", v.moment_Nm},
                                {"shear_N", v.shear_N}});
  }
  if (series.force_at_m) {
    const NodeValues v = ValuesOf(SectionOrExtension(solution, *series.force_at_m), series.axis);
    written["force_point"] = {
        {"z_mm", v.z_mm}, {"displacement_mm", v.displacement_mm}, {"slope_mrad", v.slope_mrad}};
  }
  const std::vector<double> angles = ElementAngles(solution, series.axis);
  for (int e = 0; e + 1 < solution.node_count(); ++e) {
    const beam::ElementStress stress = beam::StressInElement(solution, e);
    nlohmann::json element = {{"element", e + 1},
                              {"angle_mrad", kMrad * angles[static_cast<std::size_t>(e)]}};
    if (series.stress) {
      element["largest_moment_Nm"] = stress.largest_moment.moment_F.norm();
      element["largest_shear_N"] = stress.largest_shear.force_F.norm();
      element["stress"] = nullptr;
      if (stress.peak) {
        element["stress"] = StressJson(stress.peak->stress);
        element["stress"]["z_mm"] = kMm * stress.peak->z_m;
      }
    }
    written["elements"].push_back(element);
  }
  for (const BeamPoint& point : series.points) {
    written["points"].push_back(
        {{"point_mm", PointJson(point)},
         {"loaded_mm", PointJson(LoadedPoint(solution, series.axis, point))},
         {"compensated_by_section_mm",
          PointJson(CompensatedBySection(solution, series.axis, point))},
         {"compensated_by_element_angle_mm",
          PointJson(CompensatedByElementAngle(solution, series.axis, point))}});
  }
  return written;
}

const char* TheoryName(const model::Tool& tool, bool for_file) {
  if (tool.theory == model::BeamTheory::kTimoshenko) return for_file ? "timoshenko" : "Timoshenko";
  return for_file ? "euler_bernoulli" : "Euler-Bernoulli";
}

void PrintBeamTable(const BeamSeries& series, std::ostream& out) {
  const char name = series.axis == BendingAxis::kX ? 'x' : 'y';
  const std::size_t elements = series.cases.front().solution.elements().size();
  fmt::print(out, "Cantilever along z, bending along {}; {}, {} {}\n", name,
             TheoryName(series.tool, false), elements, elements == 1 ? "element" : "elements");
  PrintSegments(series, out);
  fmt::print(out, "  loads: {}\n", series.loads);
  for (const BeamCase& load_case : series.cases) {
    fmt::print(out, "\nForce {:.6g} N\n", load_case.force_N);
    PrintNodes(series, load_case, out);
    PrintForcePlace(series, load_case, out);
    if (series.stress) PrintStress(series, load_case, out);
    if (!series.points.empty()) PrintPoints(series, load_case, out);
  }
  if (series.cases.size() > 1) PrintSummary(series, out);
}

/// One row per node and force: force_N,node,z_mm,displacement_mm,slope_mrad,moment_Nm,shear_N, and
/// with stress normal_MPa,shear_MPa,von_mises_MPa, which are empty if unknown. If the place of the
/// force was given, a row with node `force` follows the nodes: its displacement and slope.
void PrintBeamCsv(const BeamSeries& series, std::ostream& out) {
  out << "force_N,node,z_mm,displacement_mm,slope_mrad,moment_Nm,shear_N"
      << (series.stress ? ",normal_MPa,shear_MPa,von_mises_MPa\n" : "\n");
  for (const BeamCase& load_case : series.cases) {
    for (int node = 0; node < load_case.solution.node_count(); ++node) {
      const beam::SectionState state = load_case.solution.Node(node);
      const NodeValues v = ValuesOf(state, series.axis);
      fmt::print(out, "{:.10g},{},{:.10g},{:.9g},{:.9g},{:.9g},{:.9g}", load_case.force_N, node + 1,
                 v.z_mm, v.displacement_mm, v.slope_mrad, v.moment_Nm, v.shear_N);
      if (series.stress) {
        if (const auto s = beam::StressOf(SectionInboardOf(load_case.solution, node), state)) {
          fmt::print(out, ",{:.9g},{:.9g},{:.9g}", kMPa * s->normal_Pa, kMPa * s->shear_Pa,
                     kMPa * s->von_mises_Pa);
        } else {
          out << ",,,";
        }
      }
      out << '\n';
    }
    PrintForcePlaceCsv(series, load_case, out);
  }
}

void PrintBeamJson(const BeamSeries& series, std::ostream& out) {
  nlohmann::json written = {{"schema", 1},
                            {"theory", TheoryName(series.tool, true)},
                            {"direction", series.axis == BendingAxis::kX ? "x" : "y"}};
  for (const BeamCase& load_case : series.cases) {
    written["cases"].push_back(CaseJson(series, load_case));
  }
  out << text::JsonText(written, 2) << '\n';
}

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
