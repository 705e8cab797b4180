#include "tests/virtual_cell/landing_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace virtual_cell {
namespace {

constexpr std::array kAxes = {'X', 'Y', 'Z'};

/// To a hundredth, and never -0.00.
double Hundredths(double mm) {
  return std::round(mm * 100) / 100 + 0.0;
}

nlohmann::json List(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

std::string LandingTable(const std::vector<Landing>& landings) {
  const std::string rule(86, '-');
  std::string text = fmt::format(
      "{0}\n{1:<14} {2:>12} {3:>14} {4:>12} {5:>14} {4:>12}\n{6:<14} {7:>12} {8:>14} {7:>12} "
      "{9:>14} {7:>12}\n{0}\n",
      rule, "Assembly", "Wanted", "Lands", "Error", "Lands", "point", "(mm)", "uncorrected",
      "corrected");
  for (const Landing& landing : landings) {
    for (int k = 0; k < 3; ++k) {
      const double wanted = landing.wanted_mm[k], before = landing.uncorrected_mm[k],
                   after = landing.corrected_mm[k];
      text += fmt::format("{:<12} {} {:>+12.1f} {:>+14.2f} {:>+12.2f} {:>+14.2f} {:>+12.2f}\n",
                          k == 1 ? landing.name : "", kAxes[static_cast<std::size_t>(k)], wanted,
                          before, Hundredths(before - wanted), after, Hundredths(after - wanted));
    }
    text += fmt::format("{:<14} {:>12} {:>14} {:>12.2f} {:>14} {:>12.2f}\n{}\n", "", "distance", "",
                        landing.UncorrectedError(), "", landing.CorrectedError(), rule);
  }
  return text;
}

std::string LandingJson(const std::vector<Landing>& landings, double require_mm) {
  nlohmann::json points = nlohmann::json::array();
  for (const Landing& landing : landings) {
    points.push_back({{"id", landing.id},
                      {"name", landing.name},
                      {"wanted_mm", List(landing.wanted_mm)},
                      {"uncorrected_mm", List(landing.uncorrected_mm)},
                      {"uncorrected_error_mm", landing.UncorrectedError()},
                      {"uncorrected_turn_deg", landing.uncorrected_turn_deg},
                      {"corrected_mm", List(landing.corrected_mm)},
                      {"corrected_error_mm", landing.CorrectedError()},
                      {"corrected_turn_deg", landing.corrected_turn_deg},
                      {"correction_mm", landing.correction_mm},
                      {"uncertainty_mm", landing.uncertainty_mm}});
  }
  const bool passed = std::all_of(landings.begin(), landings.end(), [&](const Landing& landing) {
    return landing.CorrectedError() < require_mm;
  });
  const nlohmann::json root = {
      {"schema", 1}, {"require_mm", require_mm}, {"passed", passed}, {"points", points}};
  return root.dump(2) + "\n";
}

std::string LandingCsv(const std::vector<Landing>& landings) {
  std::string text = "point,axis,wanted_mm,uncorrected_mm,error_mm,corrected_mm,error_left_mm\n";
  for (const Landing& landing : landings) {
    for (int k = 0; k < 3; ++k) {
      text +=
          fmt::format("{},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f}\n", landing.id,
                      kAxes[static_cast<std::size_t>(k)], landing.wanted_mm[k],
                      landing.uncorrected_mm[k], landing.uncorrected_mm[k] - landing.wanted_mm[k],
                      landing.corrected_mm[k], landing.corrected_mm[k] - landing.wanted_mm[k]);
    }
  }
  return text;
}

}  // namespace virtual_cell
