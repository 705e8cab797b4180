#include "app/measure/diagnosis/summary.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/measure/diagnosis/candidates.h"
#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/empirical_curve.h"
#include "app/measure/diagnosis/headline.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxEffects = 5;  // lines of each list without details
constexpr std::size_t kMaxPoses = 3;
constexpr std::size_t kMaxLines = 8;  // numbers of outlier lines

/// "  and 3 more\n" if a list is longer than shown.
std::string More(std::size_t count, std::size_t shown) {
  return count > shown ? fmt::format("  and {} more\n", count - shown) : "";
}

bool IsDoubtful(const Diagnosis& diagnosis, const Finding& finding) {
  return std::ranges::any_of(diagnosis.doubts, [&](const Doubt& doubt) {
    return doubt.id == finding.effect.term.effect->traits().id &&
           doubt.scope == ScopeOf(finding.effect.term);
  });
}

/// One line for each effect: its name, its size at the tip, and whether it is in doubt.
void AddEffects(const Diagnosis& diagnosis, std::string& text) {
  const auto& findings = diagnosis.findings;
  if (findings.empty()) return;
  text += fmt::format("  {:<40}  RMS at the tip\n", "effect");
  for (std::size_t k = 0; k < std::min(findings.size(), kMaxEffects); ++k) {
    text += fmt::format("  {:<40}  {} mm{}\n", EffectName(findings[k]),
                        MillimetreText(findings[k].tip_rms_m),
                        IsDoubtful(diagnosis, findings[k]) ? ", in doubt" : "");
  }
  text += More(findings.size(), kMaxEffects);
}

void AddParameters(const Diagnosis& diagnosis, std::string& text) {
  for (const Finding& finding : diagnosis.findings) {
    for (const EmpiricalCurve& curve : EmpiricalCurvesOf(finding.effect)) {
      text += fmt::format("  {:<21} {}: {} {} along {}\n", EffectName(finding), curve.meaning,
                          curve.range, curve.unit, Listed(finding.effect.term.drivers));
    }
    if (finding.effect.term.effect->traits().empirical) {
      const std::string line = LinearTrendText(finding.effect);
      if (!line.empty()) text += "    " + line + '\n';
      continue;
    }
    const model::WrittenEffect written =
        effects::WrittenFromActive(finding.effect, finding.covariance);
    for (const model::EffectParameter& parameter : written.parameters) {
      const ValueText shown = ShownValueOf(parameter);
      text += fmt::format("  {:<21} {:<14}{:>12}{:<12} {}\n", EffectName(written.id),
                          parameter.name, shown.value, shown.sd.empty() ? "" : " +- " + shown.sd,
                          ShownUnitOf(parameter).unit);
    }
    if (!finding.implausible.empty()) text += "    implausible: " + finding.implausible + '\n';
  }
}

void AddRivals(const Diagnosis& diagnosis, std::string& text) {
  for (const Rival& rival : diagnosis.rivals) {
    text +=
        fmt::format("Rival: {} instead of {}; it reproduces {} of the signal\n", RivalName(rival),
                    ReplacedName(rival), PercentText(std::max(0.0, 1 - rival.signal_left)));
  }
}

/// Why an effect is doubtful, and what the answer leaves unexplained: the first reason, or all.
void AddDoubts(const Diagnosis& diagnosis, bool all, std::string& text) {
  std::vector<std::string> lines;
  for (const ExplanationCheck& check : diagnosis.checks) {
    if (check.effect.empty() && !check.passed) lines.push_back("Not explained: " + check.sentence);
  }
  for (const Doubt& doubt : diagnosis.doubts) {
    lines.push_back(
        fmt::format("Doubtful: {}: {}", EffectName(doubt.id, doubt.scope), doubt.reason));
  }
  if (lines.size() > 1 && !all) {
    lines.front() += fmt::format(" (and {} more)", lines.size() - 1);
    lines.resize(1);
  }
  for (const std::string& line : lines) text += line + '\n';
}

void AddNextPoses(const Diagnosis& diagnosis, const model::CellModel& cell, bool all,
                  std::string& text) {
  const auto& poses = diagnosis.next_poses;
  if (poses.empty()) return;
  const auto slides = [&](const model::Joint& joint) {
    return joint.type == model::JointType::kPrismatic;
  };
  const bool some_slide = std::ranges::any_of(cell.robot.joints, slides);
  text += fmt::format(
      "Measure next (joints in degrees{}; apart: distance between the tips that the explanations "
      "predict)\n",
      some_slide ? ", linear joints in mm" : "");
  const std::size_t shown = all ? poses.size() : std::min(poses.size(), kMaxPoses);
  for (std::size_t k = 0; k < shown; ++k) {
    text += fmt::format("  {}:", k + 1);
    for (Eigen::Index i = 0; i < poses[k].q.size(); ++i) {
      const bool linear = slides(cell.robot.joints[i]);
      text += fmt::format(" {:7.1f}", poses[k].q[i] * (linear ? kMmPerMetre : kDegPerRad));
    }
    const std::string how = MeasuringText(poses[k]);
    text += fmt::format("  {:5.1f} kg  {} mm apart{}{}\n", poses[k].payload_kg,
                        MillimetreText(poses[k].separation_m), how.empty() ? "" : "; ", how);
  }
  text += More(poses.size(), shown);
}

std::string DataLine(const Diagnosis& diagnosis) {
  const std::string floor_mm = MillimetreText(diagnosis.noise_floor_m),
                    sigma_mm = MillimetreText(diagnosis.sigma_m),
                    origin = OriginText(diagnosis.sigma_origin);
  std::string text = fmt::format("{} rows, ", diagnosis.rows.size());
  if (diagnosis.noise_floor_origin == diagnosis.sigma_origin) {
    text += fmt::format("noise floor {} mm (sigma {} mm, {})", floor_mm, sigma_mm, origin);
  } else {
    text += fmt::format("noise floor {} mm ({}), sigma in use {} mm ({})", floor_mm,
                        OriginText(diagnosis.noise_floor_origin), sigma_mm, origin);
  }
  if (!diagnosis.held_out_by.empty()) text += "; held out: " + diagnosis.held_out_by;
  const auto& outliers = diagnosis.outlier_rows;
  if (outliers.empty()) return text + "; no outliers\n";
  text += fmt::format("; {} outlier{} in line{}", outliers.size(), outliers.size() == 1 ? "" : "s",
                      outliers.size() == 1 ? "" : "s");
  for (std::size_t k = 0; k < std::min(outliers.size(), kMaxLines); ++k) {
    text += fmt::format("{} {}", k == 0 ? "" : ",", outliers[k]);
  }
  return text + (outliers.size() > kMaxLines ? ", ..\n" : "\n");
}

}  // namespace

std::string SummaryText(const Diagnosis& diagnosis, const SummaryContext& context) {
  std::string word = Describe(diagnosis.verdict);
  for (char& letter : word) letter = letter == '_' ? ' ' : static_cast<char>(letter - 'a' + 'A');
  std::string text = fmt::format("{}: {}\n", word, Headline(diagnosis));
  if (const std::string error = ErrorSentence(diagnosis); !error.empty()) {
    text += error;
    if (context.tolerance_m) {
      text += fmt::format("; tolerance {} mm", MillimetreText(*context.tolerance_m));
    }
    text += '\n';
  }
  if (!context.next_step.empty()) text += "Next: " + context.next_step + '\n';
  AddEffects(diagnosis, text);
  AddDoubts(diagnosis, context.details, text);
  AddNextPoses(diagnosis, context.cell, context.details, text);
  text += DataLine(diagnosis);
  if (!context.details) return text + "--details shows values, rivals and notes\n";
  AddParameters(diagnosis, text);
  AddRivals(diagnosis, text);
  for (const std::string& remark : diagnosis.not_recorded) text += "Not recorded: " + remark + '\n';
  for (const std::string& note : diagnosis.notes) text += "Note: " + note + '\n';
  return text;
}

}  // namespace plumbline::measure
