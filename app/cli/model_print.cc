#include "app/cli/model_print.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>

#include "app/base/text/json_text.h"
#include "app/cell/model_store/model_json.h"
#include "app/cell/model_store/superseded_text.h"

namespace plumbline::cli {
namespace {

std::string MarkOf(int number, const cell::ModelState& state) {
  std::vector<std::string> marks;
  if (number == state.applied) marks.emplace_back("APPLIED");
  if (number == state.proposed) marks.emplace_back("proposed");
  if (number == state.declared) marks.emplace_back("declared");
  if (state.set_aside && number == state.set_aside->version) marks.emplace_back("SET ASIDE");
  return fmt::format("{}", fmt::join(marks, ", "));
}

std::string Millimetres(const std::optional<double>& value) {
  return value ? fmt::format("{:.3f}", *value) : "-";
}

}  // namespace

nlohmann::json VersionJson(const cell::ModelVersion& version, const cell::ModelState& state) {
  nlohmann::json json = text::JsonOrNull(cell::JsonFrom(version.facts));
  json["version"] = version.number;
  json["applied"] = version.number == state.applied;
  json["proposed"] = version.number == state.proposed;
  json["declared"] = version.number == state.declared;
  const bool aside = state.set_aside && version.number == state.set_aside->version;
  json["set_aside"] = aside;
  if (aside) json["set_aside_because"] = state.set_aside->changes;
  return json;
}

void PrintVersions(const std::vector<cell::ModelVersion>& versions, const cell::ModelState& state,
                   std::ostream& out) {
  out << fmt::format("{:>7}  {:<20} {:<9} {:<9} {:>6} {:>6}\n", "version", "date", "origin",
                     "verdict", "before", "after")
      << fmt::format("{:>7}  {:<20} {:<9} {:<9} {:>6} {:>6}\n", "", "", "", "", "mm", "mm");
  for (const auto& [number, facts] : versions) {
    const std::string mark = MarkOf(number, state);
    out << fmt::format("{:>7}  {:<20} {:<9} {:<9} {:>6} {:>6}{}\n", number, facts.date,
                       NameOf(facts.origin), facts.verdict.empty() ? "-" : facts.verdict,
                       Millimetres(facts.rms_before_mm), Millimetres(facts.rms_after_mm),
                       mark.empty() ? "" : "  " + mark);
  }
}

void PrintVersion(const cell::ModelVersion& version, const cell::ModelState& state,
                  const std::string& report_file, std::ostream& out) {
  const auto& [number, facts] = version;
  out << fmt::format("# version {}  {}\n# {}, {}, from {}\n", number, MarkOf(number, state),
                     NameOf(facts.origin), facts.date, facts.from);
  if (facts.based_on) out << fmt::format("# based on version {}\n", *facts.based_on);
  if (!facts.verdict.empty()) {
    out << fmt::format("# {}: {}; held out {} -> {} mm\n", facts.verdict,
                       fmt::join(facts.effects, ", "), Millimetres(facts.rms_before_mm),
                       Millimetres(facts.rms_after_mm));
  }
  for (const std::string& implausible : facts.implausible) {
    out << "# implausible for a healthy machine: " << implausible << '\n';
  }
  if (facts.discrepancy_share) {
    out << fmt::format("# {:.0f} % of the correction is from the discrepancy model\n",
                       100 * *facts.discrepancy_share);
  }
  if (facts.change_mm) {
    out << fmt::format("# moves the predicted tip by up to {:.3f} mm\n", *facts.change_mm);
  }
  if (facts.points_change_mm) {
    out << fmt::format("# moved the configured points by up to {:.3f} mm when it was fitted\n",
                       *facts.points_change_mm);
  }
  if (!facts.report.empty()) {
    out << fmt::format("# report: {}\n", report_file);
  }
}

void PrintSetAside(const cell::ModelState& state, const std::string& state_directory,
                   std::ostream& out) {
  if (!state.set_aside) return;
  out << '\n' << cell::SupersededText(state, state_directory) << '\n';
  for (const std::string& change : state.set_aside->changes) out << "  " << change << '\n';
}

}  // namespace plumbline::cli
