#include "app/measure/diagnosis/summary.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/measure/diagnosis/diagnosis_text.h"
#include "app/measure/diagnosis/empirical_curve.h"
#include "app/measure/diagnosis/headline.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::measure {
namespace {

constexpr std::size_t kMaxParameters = 8;
constexpr std::size_t kMaxRivals = 2;
constexpr std::size_t kMaxPoses = 6;
constexpr std::size_t kMaxRemarks = 2;  // of each kind
constexpr std::size_t kMaxLines = 8;    // numbers of outlier lines

void AddParameters(const Diagnosis& diagnosis, std::string& text) {
  std::size_t count = 0;
  std::string lines;
  for (const Finding& finding : diagnosis.findings) {
    for (const EmpiricalCurve& curve : EmpiricalCurvesOf(finding.effect)) {
      if (++count > kMaxParameters) continue;
      lines += fmt::format("  {:<21} {}: {} {} along {}\n", EffectName(finding), curve.meaning,
                           curve.range, curve.unit, Listed(finding.effect.term.drivers));
    }
    if (finding.effect.term.effect->traits().empirical) {
      const std::string line = LinearTrendText(finding.effect);
      if (!line.empty()) lines += "    " + line + '\n';
      continue;
    }
    const model::WrittenEffect written =
        effects::WrittenFromActive(finding.effect, finding.covariance);
    for (const model::EffectParameter& parameter : written.parameters) {
      if (++count > kMaxParameters) continue;
      const ValueText shown = ShownValueOf(parameter);
      lines += fmt::format("  {:<21} {:<14}{:>12}{:<12} {}\n", EffectName(written.id),
                           parameter.name, shown.value, shown.sd.empty() ? "" : " +- " + shown.sd,
                           ShownUnitOf(parameter).unit);
    }
    if (!finding.implausible.empty() && count <= kMaxParameters) {
      lines += "    implausible: " + finding.implausible + '\n';
    }
  }
  text += lines;
  if (count > kMaxParameters)
    text += fmt::format("  and {} more parameters\n", count - kMaxParameters);
}

void AddRivals(const Diagnosis& diagnosis, std::string& text) {
  for (std::size_t k = 0; k < std::min(diagnosis.rivals.size(), kMaxRivals); ++k) {
    const Rival& rival = diagnosis.rivals[k];
    text +=
        fmt::format("Rival: {} instead of {}; it reproduces {} of the signal\n", RivalName(rival),
                    ReplacedName(rival), PercentText(std::max(0.0, 1 - rival.signal_left)));
  }
  if (diagnosis.rivals.size() > kMaxRivals) {
    text += fmt::format("  and {} more rivals\n", diagnosis.rivals.size() - kMaxRivals);
  }
}

void AddDoubts(const Diagnosis& diagnosis, std::string& text) {
  for (std::size_t k = 0; k < std::min(diagnosis.doubts.size(), kMaxRemarks); ++k) {
    const Doubt& doubt = diagnosis.doubts[k];
    text += fmt::format("Doubtful: {}: {}\n", EffectName(doubt.id, doubt.scope), doubt.reason);
  }
  if (diagnosis.doubts.size() > kMaxRemarks) {
    const std::size_t more = diagnosis.doubts.size() - kMaxRemarks;
    text += fmt::format("  and {} more doubt{}\n", more, more == 1 ? "" : "s");
  }
  for (const ExplanationCheck& check : diagnosis.checks) {
    if (check.effect.empty() && !check.passed) text += "Not explained: " + check.sentence + '\n';
  }
}

void AddNextPoses(const Diagnosis& diagnosis, const model::CellModel& cell, std::string& text) {
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
  for (std::size_t k = 0; k < std::min(poses.size(), kMaxPoses); ++k) {
    text += fmt::format("  {}:", k + 1);
    for (Eigen::Index i = 0; i < poses[k].q.size(); ++i) {
      const bool linear = slides(cell.robot.joints[i]);
      text += fmt::format(" {:7.1f}", poses[k].q[i] * (linear ? kMmPerMetre : kDegPerRad));
    }
    const std::string how = MeasuringText(poses[k]);
    text += fmt::format("  {:5.1f} kg  {} mm apart{}{}\n", poses[k].payload_kg,
                        MillimetreText(poses[k].separation_m), how.empty() ? "" : "; ", how);
  }
  if (poses.size() > kMaxPoses) text += fmt::format("  and {} more\n", poses.size() - kMaxPoses);
}

void AddRemarks(const char* topic, const std::vector<std::string>& remarks, std::string& text) {
  for (std::size_t k = 0; k < std::min(remarks.size(), kMaxRemarks); ++k) {
    text += fmt::format("{}: {}\n", topic, remarks[k]);
  }
  if (remarks.size() > kMaxRemarks) {
    text += fmt::format("  and {} more, see the report\n", remarks.size() - kMaxRemarks);
  }
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

std::string SummaryText(const Diagnosis& diagnosis, const model::CellModel& cell) {
  std::string text = Capitalized(Headline(diagnosis));
  const std::string error = ErrorSentence(diagnosis);
  text += error.empty() ? "\n" : ":\n" + error + '\n';
  AddParameters(diagnosis, text);
  AddRivals(diagnosis, text);
  AddDoubts(diagnosis, text);
  AddNextPoses(diagnosis, cell, text);
  text += DataLine(diagnosis);
  AddRemarks("Not recorded", diagnosis.not_recorded, text);
  AddRemarks("Note", diagnosis.notes, text);
  return text;
}

}  // namespace plumbline::measure
