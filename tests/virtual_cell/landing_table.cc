#include "tests/virtual_cell/landing_table.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace virtual_cell {
namespace {

constexpr std::array kAxes = {'X', 'Y', 'Z'};

constexpr std::array kBases = {"unknown", "assumed", "propagated", "measured"};
constexpr int kMeasured = 3;

/// Rounded to a hundredth, never -0.00.
double Hundredths(double mm) {
  return std::round(mm * 100) / 100 + 0.0;
}

nlohmann::json List(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}

}  // namespace

std::string LandingTable(const std::vector<Landing>& landings) {
  const bool three = std::all_of(landings.begin(), landings.end(),
                                 [](const Landing& landing) { return landing.declared_mm; });
  std::vector<const char*> titles = {"uncorrected", "corrected"};
  if (three) titles = {"uncorrected", "declared model", "fitted model"};
  const std::string rule(23 + 23 * titles.size(), '-');
  std::string names = fmt::format("{:<14}{:>9}", "Assembly", "Wanted");
  std::string units = fmt::format("{:<14}{:>9}", "point", "(mm)");
  for (const char* title : titles) {
    names += fmt::format("{:>15}{:>8}", title, "Error");
    units += fmt::format("{:>15}{:>8}", "(mm)", "(mm)");
  }
  std::string text = fmt::format("{0}\n{1}\n{2}\n{0}\n", rule, names, units);
  for (const Landing& landing : landings) {
    std::vector<Vec3> landed = {landing.uncorrected_mm, landing.corrected_mm};
    if (three) landed.insert(landed.begin() + 1, *landing.declared_mm);
    for (int k = 0; k < 3; ++k) {
      text += fmt::format("{:<12} {}{:>+9.1f}", k == 1 ? landing.name : "",
                          kAxes[static_cast<std::size_t>(k)], landing.wanted_mm[k]);
      for (const Vec3& p_mm : landed) {
        text +=
            fmt::format("{:>+15.2f}{:>+8.2f}", p_mm[k], Hundredths(p_mm[k] - landing.wanted_mm[k]));
      }
      text += '\n';
    }
    text += fmt::format("{:<14}{:>9}", "", "distance");
    for (const Vec3& p_mm : landed) {
      text += fmt::format("{:>15}{:>8.2f}", "", (p_mm - landing.wanted_mm).norm());
    }
    text += fmt::format("\n{}\n", rule);
  }
  return text;
}

std::string RadiusLines(const std::vector<Landing>& landings) {
  std::string text;
  for (const Landing& landing : landings) {
    text += fmt::format("{}: error {:.2f} mm, 95 % radius {:.2f} mm ({}{})\n", landing.name,
                        landing.CorrectedError(), landing.uncertainty_mm,
                        kBases.at(static_cast<std::size_t>(landing.basis)),
                        landing.extrapolated ? ", outside the calibrated range" : "");
  }
  return text;
}

bool RadiiHold(const std::vector<Landing>& landings) {
  return std::all_of(landings.begin(), landings.end(), [](const Landing& landing) {
    return landing.basis == kMeasured && !landing.extrapolated &&
           landing.CorrectedError() < 1.64 * landing.uncertainty_mm;
  });
}

void AddDeclared(const std::string& json, std::vector<Landing>& landings) {
  try {
    const nlohmann::json before = nlohmann::json::parse(json);
    for (Landing& landing : landings) {
      for (const nlohmann::json& point : before.at("points")) {
        if (point.at("id") != landing.id) continue;
        const nlohmann::json& p = point.at("corrected_mm");
        landing.declared_mm = Vec3(p.at(0), p.at(1), p.at(2));
      }
      if (!landing.declared_mm) {
        throw std::runtime_error(fmt::format("no point {} in the earlier result", landing.id));
      }
    }
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(fmt::format("the earlier result: {}", error.what()));
  }
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
                      {"uncertainty_mm", landing.uncertainty_mm},
                      {"radius_basis", kBases.at(static_cast<std::size_t>(landing.basis))},
                      {"extrapolated", landing.extrapolated}});
    if (!landing.declared_mm) continue;
    points.back()["declared_mm"] = List(*landing.declared_mm);
    points.back()["declared_error_mm"] = landing.DeclaredError();
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
