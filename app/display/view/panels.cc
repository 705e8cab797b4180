#include "app/display/view/panels.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "app/display/view/board_guide.h"
#include "app/display/view/point_tiles.h"
#include "app/display/view/state_strip.h"
#include "app/display/view/status_text.h"
#include "drivers/plc/register_map.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::display {
namespace {

std::string Mm(double metres, int digits = 2) {
  return fmt::format("{:.{}f} mm", metres * kMmPerMetre, digits);
}

void AddBits(std::uint16_t word, std::span<const plc::BitMeaning> bits, Tone tone, Panel& panel) {
  for (const plc::BitMeaning& bit : bits) {
    if ((word & bit.mask) != 0) panel.lines.push_back({bit.meaning, tone});
  }
}

/// What is wrong, then what to do about the most severe of it.
Panel AlarmPanel(const ViewFacts& facts) {
  const cell::ViewState& state = *facts.state;
  const CellHealth health = DisplayedHealth(facts);
  Panel panel{"Alarms and warnings", {}};
  AddBits(state.alarms, plc::registers::AlarmBits(), Tone::kBad, panel);
  AddBits(state.warnings, plc::registers::WarningBits(), Tone::kAttention, panel);
  if (health.severity >= HealthSeverity::kAttention) {
    panel.lines.push_back({"→ " + MessageOf(health, facts).remedy, ToneOf(health.severity)});
  }
  if (panel.lines.empty()) panel.lines.push_back({"none", Tone::kGood});
  return panel;
}

/// One panel for all cameras: first the first line of each camera, then their other lines. Of a
/// silent daemon's cameras nothing is known.
using LinesOfCamera = std::vector<PanelLine> (*)(const ViewFacts& facts, std::size_t camera);
Panel OfCameras(const char* title, const ViewFacts& facts, LinesOfCamera lines_of) {
  Panel panel{title, {}};
  const std::vector<cell::ViewCamera>& cameras = facts.state->cameras;
  if (!cameras.empty() && WithoutDaemon(*facts.state)) {
    panel.lines.push_back({Describe(HealthReason::kNoDaemon), Tone::kBad});
    return panel;
  }
  std::vector<PanelLine> rest;
  for (std::size_t k = 0; k < cameras.size(); ++k) {
    const std::vector<PanelLine> lines = lines_of(facts, k);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      (i == 0 ? panel.lines : rest)
          .push_back({CameraPrefix(cameras[k]) + lines[i].text, lines[i].tone});
    }
  }
  panel.lines.insert(panel.lines.end(), rest.begin(), rest.end());
  return panel;
}

std::vector<PanelLine> LensLines(const ViewFacts& facts, std::size_t k) {
  const cell::ViewCamera& camera = facts.state->cameras[k];
  const status::CameraStatus& status = camera.status;
  const bool valid = status.state == lens::ZoomState::kValid;
  const bool in_place = valid && status.reason == lens::ZoomReason::kTagsGood;
  const bool calibrated = valid && status.reason == lens::ZoomReason::kBoardAccepted;
  std::vector<PanelLine> lines = {
      {in_place     ? "valid: tags in place"  // short: must fit one line behind a camera name
       : calibrated ? "valid: calibrated now"
                    : fmt::format("{}: {}", lens::ZoomStateText(status.state),
                                  lens::ZoomReasonText(status.reason)),
       valid ? Tone::kGood : Tone::kAttention}};
  if (status.prompt != lens::BoardPrompt::kNone) {
    lines.push_back({"→ " + std::string(lens::BoardPromptText(status.prompt)), Tone::kAttention});
    if (camera.guidance) lines.push_back({BoardViewsText(camera), Tone::kAttention});
  }
  std::string zoom = status.zoom_counts ? fmt::format("zoom {}", *status.zoom_counts)
                                        : std::string("no zoom reading");
  if (status.lens_id > 0) zoom += fmt::format(", stored lens {}", status.lens_id);
  lines.push_back({zoom});
  for (const auto& [rests, key] : {std::pair(status.rests_on_no_window, "no_window"),
                                   std::pair(status.rests_on_fixed_focus, "fixed_focus")}) {
    if (rests) lines.push_back({fmt::format("rests on the declaration {}", key), Tone::kFaded});
  }
  if (camera.lens && camera.usable_radius_px) {
    lines.push_back({fmt::format("usable up to {:.0f} px from the middle",
                                 std::floor(*camera.usable_radius_px))});
  }
  if (camera.lens) lines.push_back({fmt::format("focal length {:.0f} px", camera.lens->fx)});
  return lines;
}

std::vector<PanelLine> TrackingLines(const ViewFacts& facts, std::size_t k) {
  const cell::Carriers& carriers = facts.carriers[k];
  std::vector<PanelLine> lines;
  if (!facts.state->cameras[k].lens) {
    lines.push_back({"no poses without a lens", Tone::kAttention});
  } else if (!carriers.world) {
    lines.push_back({"cell tags not seen yet", Tone::kAttention});
  } else if (carriers.world->stale) {
    lines.push_back({"cell tags not visible", Tone::kAttention});
  } else {
    lines.push_back({"cell tags visible", Tone::kGood});
  }
  const status::CameraStatus& status = facts.state->cameras[k].status;
  if (status.contradicting_count > 0) {
    const std::vector<std::int32_t> ids(
        status.contradicting_tags.begin(),
        status.contradicting_tags.begin() +
            static_cast<std::ptrdiff_t>(status.contradicting_count));
    lines.push_back({fmt::format("cell tag {} contradicts the others", fmt::join(ids, ", ")),
                     Tone::kAttention});
  }
  if (status.opencv_prints) {
    lines.push_back({"tags drawn by OpenCV: set drawn_by", Tone::kAttention});
  }
  for (const auto& [name, placed] : carriers.bodies) {
    lines.push_back({fmt::format("{}: {:.3f} m away{}", name, placed.X_CK.p.norm(),
                                 placed.stale ? ", STALE" : ""),
                     placed.stale ? Tone::kAttention : Tone::kPlain});
  }
  return lines;
}

/// "by motion 0.84 ±0.12 mm (4.1 m/s²)": displacement of the tip by the acceleration of the arm.
std::optional<PanelLine> MotionLine(const cell::ViewMotion& motion) {
  using motion::MotionState;
  switch (motion.state) {
    case MotionState::kMoving:
      return PanelLine{fmt::format("by motion {:.2f} ±{:.2f} mm, {:.1f} m/s²",
                                   kMmPerMetre * motion.tip_W.norm(), kMmPerMetre * motion.radius_m,
                                   motion.tip_acceleration)};
    case MotionState::kReadingsTooSlow:
      return PanelLine{"by motion: unknown, slow readings", Tone::kFaded};
    default:
      return std::nullopt;
  }
}

std::vector<PanelLine> RobotLines(const ViewFacts& facts) {
  const cell::ViewState& state = *facts.state;
  std::vector<PanelLine> lines;
  if (facts.carriers.front().tool && !facts.carriers.front().robot_stale) {
    const cell::ToolState& tool = *facts.carriers.front().tool;
    lines.push_back(
        {fmt::format("tip {} off nominal now", Mm((tool.tip_W - tool.tip_nominal_W).norm()))});
  }
  if (const auto line = MotionLine(state.motion)) lines.push_back(*line);
  if (WithoutDaemon(state)) {
    lines.push_back({"last robot reading " + AgeText(state.data_age_s), Tone::kBad});
    return lines;
  }
  lines.push_back(state.payload_kg ? PanelLine{fmt::format("payload {:.2f} kg", *state.payload_kg)}
                                   : PanelLine{"payload unknown", Tone::kAttention});
  lines.push_back({(state.alarms & alarm::kRobotMissing) != 0 ? "no robot reading yet"
                   : state.data_age_s < 1
                       ? "last robot reading less than 1 s ago"  // still while the cell is
                       : "last robot reading " + AgeText(state.data_age_s),
                   facts.carriers.front().robot_stale ? Tone::kBad : Tone::kPlain});
  return lines;
}

Panel DistancePanel(const ViewFacts& facts) {
  Panel panel{"Distances", {}};
  const cell::SceneMeasurements* const measured = facts.measured;
  const bool configured =
      facts.table != nullptr && !(facts.table->pairs.empty() && facts.table->distances.empty());
  if (measured == nullptr || facts.now_s - measured->time_s > cell::kMeasuredFresh_s) {
    if (configured) panel.lines.push_back({"no current measurement", Tone::kFaded});
    return panel;
  }
  std::vector<PanelLine> rest;
  for (const cell::MeasuredPair& pair : measured->pairs) {
    const std::string names = pair.a + " / " + pair.b;
    if (!pair.separation) {
      rest.push_back({names + ": not measured", Tone::kFaded});
    } else if (pair.state == scene::Proximity::kInterference) {
      panel.lines.push_back(
          {pair.separation->touching
               ? fmt::format("{}: INTERFERENCE, {} deep", names, Mm(pair.separation->depth_m))
               : names + ": INTERFERENCE",
           Tone::kBad});
    } else {
      rest.push_back({fmt::format("{}: {}", names, Mm(pair.separation->distance_m, 1)),
                      pair.state == scene::Proximity::kNear ? Tone::kAttention : Tone::kPlain});
    }
  }
  for (const cell::MeasuredSweep& sweep : measured->sweeps) {
    if (!sweep.result) continue;
    rest.push_back(sweep.result->hits
                       ? PanelLine{fmt::format("{}: hits {} after {}", sweep.name, sweep.other,
                                               Mm(sweep.result->travelled_m, 0)),
                                   Tone::kBad}
                       : PanelLine{fmt::format("{}: clear, {} from {}", sweep.name,
                                               Mm(sweep.result->least_m, 1), sweep.other)});
  }
  for (const cell::MeasuredDistance& distance : measured->distances) {
    rest.push_back(distance.distance_m
                       ? PanelLine{fmt::format("{}: {}", distance.name, Mm(*distance.distance_m))}
                       : PanelLine{distance.name + ": not measured", Tone::kFaded});
  }
  panel.lines.insert(panel.lines.end(), rest.begin(), rest.end());
  return panel;
}

std::vector<PanelLine> CameraLines(const ViewFacts& facts, std::size_t k) {
  const cell::ViewCamera& camera = facts.state->cameras[k];
  std::vector<PanelLine> lines;
  if (!camera.image) {
    lines.push_back({"no image yet", Tone::kAttention});
  } else if (facts.carriers[k].image_stale) {
    lines.push_back({"last image " + AgeText(facts.now_s - camera.image->time_s), Tone::kBad});
  } else {
    const double rate = k < facts.frames_per_s.size() ? facts.frames_per_s[k] : 0;
    lines.push_back(
        {fmt::format("{}x{}, {:.0f} frames/s", camera.image->width, camera.image->height, rate)});
  }
  if (!camera.serial.empty()) lines.push_back({camera.serial, Tone::kFaded});
  return lines;
}

std::vector<PanelLine> TagLines(const ViewFacts& facts, std::size_t k) {
  const std::vector<cell::ViewTag>& seen = facts.state->cameras[k].tags;
  std::string text = fmt::format("{} visible", seen.size());
  if (facts.model != nullptr) {
    const config::TagsConfig& tags = facts.model->config.vision.tags;
    text += tags.threshold ? fmt::format(", threshold {}", *tags.threshold)
                           : std::string(", threshold automatic");
  }
  std::vector<PanelLine> lines = {{text, seen.empty() ? Tone::kAttention : Tone::kPlain}};
  std::string ids;
  for (const cell::ViewTag& tag : seen) {
    ids += fmt::format("{}{}{}", ids.empty() ? "" : " ", tag.id, tag.ambiguous ? "?" : "");
  }
  if (!ids.empty()) lines.push_back({ids, Tone::kFaded});
  return lines;
}

Panel ObjectsPanel(const ViewFacts& facts) {
  Panel panel{"Objects", facts.objects};
  if (facts.table != nullptr) {
    const auto shown = std::count_if(
        facts.table->objects.begin(), facts.table->objects.end(),
        [&](const cell::SceneObject& object) {
          return object.visible && std::any_of(facts.carriers.begin(), facts.carriers.end(),
                                               [&](const cell::Carriers& camera) {
                                                 return camera.Find(object.on) != nullptr;
                                               });
        });
    panel.lines.push_back({fmt::format("{} of {} placed", shown, facts.table->objects.size())});
  }
  return panel;
}

Panel ModelPanel(const cell::ViewState& state) {
  const status::MonitoringStatus& monitoring = state.monitoring;
  Panel panel{"Model", {}};
  panel.lines.push_back(state.model_version > 0
                            ? PanelLine{fmt::format("version {} in force", state.model_version)}
                            : PanelLine{"cell file, no stored version"});
  const int proposed = monitoring.model.proposed;
  if (proposed > 0) {
    panel.lines.push_back(
        {fmt::format("version {} proposed: plumbline model apply {}", proposed, proposed),
         Tone::kAttention});
  }
  if (monitoring.recording) {
    panel.lines.push_back(
        monitoring.reference_refused
            ? PanelLine{fmt::format("{} probes, no drift check: reference probes disagree",
                                    monitoring.probes),
                        Tone::kAttention}
        : monitoring.learning
            ? PanelLine{LearningText(monitoring)}
            : PanelLine{fmt::format("{} probes, drift {}", monitoring.probes,
                                    DriftRatioText(monitoring.drift_statistic)),
                        monitoring.drift_alarm ? Tone::kAttention : Tone::kPlain});
  }
  if (monitoring.quarantined > 0) {
    panel.lines.push_back(
        {"probes in quarantine: plumbline journal quarantine list", Tone::kAttention});
  }
  if (monitoring.diagnosing) {
    panel.lines.push_back({"diagnosis running", Tone::kAttention});
  }
  return panel;
}

/// Without the panels that have nothing to say: of what is not configured.
std::vector<Panel> Configured(std::vector<Panel> panels) {
  std::erase_if(panels, [](const Panel& panel) { return panel.lines.empty(); });
  return panels;
}

std::vector<Panel> PanelsOfState(const ViewFacts& facts) {
  return Configured({AlarmPanel(facts),
                     OfCameras("Lens", facts, LensLines),
                     OfCameras("Tracking", facts, TrackingLines),
                     {"Robot", RobotLines(facts)},
                     DistancePanel(facts),
                     OfCameras("Camera", facts, CameraLines),
                     OfCameras("Tags", facts, TagLines),
                     ObjectsPanel(facts),
                     ModelPanel(*facts.state)});
}

/// Lens, then whether images and cell tags are missing: the rest is on the page.
std::vector<PanelLine> WallCameraLines(const ViewFacts& facts, std::size_t k) {
  std::vector<PanelLine> lines = LensLines(facts, k);
  if (facts.state->cameras[k].lens) lines.pop_back();  // the focal length
  for (const LinesOfCamera more : {TrackingLines, CameraLines}) {
    const PanelLine first = more(facts, k).front();
    if (first.tone == Tone::kAttention || first.tone == Tone::kBad) lines.push_back(first);
  }
  return lines;
}

std::vector<Panel> WallPanelsOfState(const ViewFacts& facts) {
  Panel model = ModelPanel(*facts.state);
  model.title = "Robot and model";
  const std::vector<PanelLine> robot = RobotLines(facts);
  model.lines.insert(model.lines.begin(), robot.begin(), robot.end());
  return Configured({OfCameras("Camera", facts, WallCameraLines), DistancePanel(facts), model});
}

/// Applies `panels_of` to the facts as they may be shown if the daemon is silent.
std::vector<Panel> Withdrawn(const ViewFacts& facts,
                             std::vector<Panel> (*panels_of)(const ViewFacts&)) {
  const auto withdrawn = WithdrawnState(*facts.state, facts.link_problem, facts.now_s);
  if (!withdrawn) return panels_of(facts);
  ViewFacts silent = facts;
  silent.state = &*withdrawn;
  return panels_of(silent);
}

}  // namespace

std::vector<Panel> PanelsOf(const ViewFacts& facts) {
  if (facts.state != nullptr) return Withdrawn(facts, PanelsOfState);
  return Configured({{"Daemon", {{facts.link_problem, Tone::kBad}}}, {"Objects", facts.objects}});
}

std::vector<Panel> WallPanelsOf(const ViewFacts& facts) {
  if (facts.state != nullptr) return Withdrawn(facts, WallPanelsOfState);
  return {{"Daemon", {{facts.link_problem, Tone::kBad}}}};
}

}  // namespace plumbline::display
