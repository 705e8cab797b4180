// Command `plumbline effects`: prints the catalogue of effects as a document.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#include <cctype>
#include <iostream>

#include "app/cli/commands.h"
#include "app/cli/failure.h"
#include "firmware-like/effects/catalogue.h"

namespace plumbline::cli {
namespace {

/// What the rows or the cell must contain.
std::string_view NeedOf(effects::Signal signal) {
  using effects::Signal;
  switch (signal) {
    case Signal::kTime:
      return "`t_s`";
    case Signal::kTemperature:
      return "`temp_C`, and `reference_temperature_C` in the cell";
    case Signal::kVelocity:
      return "velocities `qd1_deg_s`..";
    case Signal::kAcceleration:
      return "accelerations `qdd1_deg_s2`..";
    case Signal::kOrder:
      return "rows in the order of the moves, without missing moves";
    case Signal::kPayload:
      return "`payload_kg`, and `[payload]` in the cell";
    case Signal::kTorques:
      return "link masses in the cell, or measured torques `tau1_Nm`..";
    case Signal::kWeight:
      return "link masses in the cell";
    case Signal::kNoTorques:
      return "a cell without all link masses, and no measured torques";
    case Signal::kBeam:
      return "a tool that bends (`model` other than `rigid`)";
    case Signal::kCamera:
      return "`camera_xyz_mm` and `camera_rpy_deg` in the cell";
    case Signal::kRange:
      return "measured ranges (`kind = \"range\"`)";
    case Signal::kTilt:
      return "`tilt_x_deg` and `tilt_y_deg` that vary";
    case Signal::kCameras:
      return "rows of different cameras (column `camera`)";
  }
  return "";
}

/// "q#" becomes `q1`.., "q#_of_q#" `q2_of_q1`.., "q#_link#_x" `q2_link2_x`.., "q#_#_phase"
/// `q1_2_phase`..
std::string FirstName(const effects::ParameterSpec& spec) {
  std::string name(spec.name);
  const bool not_of_first = IsOfTwoJoints(spec) || IsOfJointAndLink(spec) || spec.not_of_first;
  std::string number = not_of_first ? "2" : "1";
  for (auto at = name.find('#'); at != std::string::npos; at = name.find('#')) {
    name.replace(at, 1, number);
    number = IsOfTwoJoints(spec) ? "1" : "2";
  }
  return fmt::format("`{}`{}", name, name == spec.name ? "" : "..");
}

std::string RangeOf(const model::Interval& range) {
  return fmt::format("{:.4g}..{:.4g}", range.low, range.high);
}

/// The cells of unit and limit.
std::string LimitOf(const effects::ParameterSpec& spec) {
  if (spec.role == effects::ParameterRole::kWord) {
    std::string words;
    for (const char letter : spec.words)
      words += letter == ',' ? std::string(", ") : std::string(1, letter);
    return "word | " + words;
  }
  std::string unit(spec.unit), range = RangeOf(spec.plausible);
  if (spec.only == model::JointType::kPrismatic) unit += ", linear axes only";
  if (spec.only == model::JointType::kRevolute) unit += ", rotary joints only";
  if (spec.parallel_axes_only) unit += ", between parallel axes only";
  if (!spec.prismatic_unit.empty()) {
    unit += fmt::format("; linear axis: {}", spec.prismatic_unit);
    const std::string linear = RangeOf(spec.prismatic_plausible);
    if (linear != range) range += "; " + linear;
  }
  if (spec.role == effects::ParameterRole::kShape) range += " (searched)";
  if (!spec.not_negative_with.empty())
    range += fmt::format("; not negative with `{}`", spec.not_negative_with);
  return unit + " | " + range;
}

/// One row for successive parameters of the same unit and limit.
std::string ParameterRows(const std::vector<effects::ParameterSpec>& parameters) {
  std::string rows, names, limit;
  const auto finish = [&] {
    if (!names.empty()) rows += fmt::format("| {} | {} |\n", names, limit);
  };
  for (const effects::ParameterSpec& spec : parameters) {
    const std::string own = LimitOf(spec);
    if (own != limit) finish();
    names = own == limit ? names + ", " + FirstName(spec) : FirstName(spec);
    limit = own;
  }
  finish();
  return rows;
}

std::string SectionOf(const effects::EffectTraits& traits) {
  std::string section = fmt::format(
      "\n### {0}\n\n![{1}](effects/{0}.svg)\n\n{2}{3}.\n\n`{4}`\n\n"
      "| parameter | unit | limit on a sound machine |\n|---|---|---|\n",
      traits.id, traits.meaning, static_cast<char>(std::toupper(traits.meaning.front())),
      traits.meaning.substr(1), traits.formula);
  section += ParameterRows(traits.parameters) + "\n";
  if (!traits.sound_size.empty()) section += fmt::format("- **Size**: {}.\n", traits.sound_size);
  std::vector<std::string> needs;
  for (const effects::Signal signal : traits.needs) needs.emplace_back(NeedOf(signal));
  for (const effects::VariantSignal& variant : traits.word_needs)
    needs.push_back(fmt::format("with `{}` {}", variant.word, NeedOf(variant.signal)));
  if (!needs.empty()) section += fmt::format("- **Needs**: {}.\n", fmt::join(needs, "; "));
  std::vector<std::string> others;
  for (const std::string_view other : traits.confused_with)
    others.push_back(fmt::format("[{0}](#{0})", other));
  section += fmt::format("- **Shown by**: {}.\n- **Confused with**: {}.\n- **Remedy**: {}.\n",
                         traits.shown_by, fmt::join(others, ", "), traits.remedy);
  return section;
}

/// The sections of docs/effects.md, one for each effect of the catalogue.
std::string EffectsMarkdown() {
  std::string page;
  for (const effects::Effect* effect : effects::Catalogue()) page += SectionOf(effect->traits());
  return page.substr(1);
}

}  // namespace

void AddEffectsCommand(CLI::App& app, int& exit_code) {
  CLI::App* command =
      app.add_subcommand("effects", "Print every effect that the diagnosis can find");
  command->footer("Example:\n  plumbline effects > effects.md");
  command->callback([&exit_code] {
    std::cout << EffectsMarkdown();
    exit_code = kExitOk;
  });
}

}  // namespace plumbline::cli
