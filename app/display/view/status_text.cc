#include "app/display/view/status_text.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "app/display/view/state_strip.h"

namespace plumbline::display {
bool DaemonIsSilent(const cell::ViewState& state, const std::string& link_problem, double now_s) {
  const double limit_s = link_problem.empty() ? kDaemonSilent_s : cell::kStateOld_s;
  return now_s - state.now_s > limit_s;
}

std::optional<cell::ViewState> WithdrawnState(const cell::ViewState& state,
                                              const std::string& link_problem, double now_s) {
  const bool done = WithoutDaemon(state);
  if (done || !DaemonIsSilent(state, link_problem, now_s)) return std::nullopt;
  cell::ViewState withdrawn = state;
  withdrawn.health = HealthOf({.daemon_silent = true});
  withdrawn.data_age_s += now_s - state.now_s;
  withdrawn.motion = {};
  for (cell::ViewPoint& point : withdrawn.points) point.valid = false;
  for (cell::ViewCamera& camera : withdrawn.cameras) {
    camera.status.state = lens::ZoomState::kUnknown;
  }
  return withdrawn;
}

std::string InvalidReason(const cell::ViewPoint& point, const cell::ViewState& state) {
  if (WithoutDaemon(state)) return Describe(state.health.reason);
  return CodeText(point.code);
}

std::string AgeText(double age_s) {
  if (!std::isfinite(age_s) || age_s > 86400) return "long ago";
  if (age_s < 1) return fmt::format("{:.0f} ms ago", std::max(0.0, 1e3 * age_s));
  return age_s < 120 ? fmt::format("{:.0f} s ago", age_s)
                     : fmt::format("{:.0f} min ago", age_s / 60);
}

std::string CameraPrefix(const cell::ViewCamera& camera) {
  const std::string name = status::CameraNameText(camera.status.name);
  return name.empty() ? "" : name + ": ";
}

Tone ToneOf(HealthSeverity severity) {
  switch (severity) {
    case HealthSeverity::kGood:
      return Tone::kGood;
    case HealthSeverity::kNotice:
      return Tone::kPlain;
    case HealthSeverity::kAttention:
      return Tone::kAttention;
    case HealthSeverity::kAlarm:
      return Tone::kBad;
  }
  return Tone::kBad;
}

Tone ToneOf(const cell::ViewPoint& point, const cell::ViewState& state) {
  if (!point.valid) return Tone::kBad;
  constexpr std::uint16_t kDoubts = warning::kDrift | warning::kModelSetAside;
  const bool doubtful = point.extrapolated || point.differs ||
                        point.basis == model::RadiusBasis::kUnknown ||
                        (state.warnings & kDoubts) != 0;
  if (doubtful) return Tone::kAttention;
  return point.basis == model::RadiusBasis::kAssumed ? Tone::kPlain : Tone::kGood;
}

namespace {

constexpr const char* kClearTags = "clear the view of the cell's tags";

std::vector<StaleReason> StaleCameraReasons(const ViewFacts& facts, std::size_t k) {
  const cell::ViewCamera& camera = facts.state->cameras[k];
  const cell::Carriers& carriers = facts.carriers[k];
  constexpr const char* kCable = "check the camera and its cable";
  std::vector<StaleReason> reasons;
  if (!camera.image) {
    reasons.push_back({"no image", kCable});
  } else if (carriers.image_stale) {
    reasons.push_back({"last image " + AgeText(facts.now_s - camera.image->time_s), kCable});
  }
  if (camera.status.state != lens::ZoomState::kValid) {
    const std::string_view prompt = lens::BoardPromptText(camera.status.prompt);
    reasons.push_back({fmt::format("lens {}: {}", lens::ZoomStateText(camera.status.state),
                                   lens::ZoomReasonText(camera.status.reason)),
                       camera.guidance ? "hold the board where the outline shows it"
                       : camera.status.prompt != lens::BoardPrompt::kNone
                           ? std::string(prompt)
                           : "keep the zoom at rest and the reference tags in view"});
  } else if (camera.image && !camera.lens) {
    reasons.push_back({"no lens for the image", "show the calibration board"});
  }
  if (camera.image && camera.lens && !carriers.world) {  // without a lens nothing is placed
    reasons.push_back({"cell tags not seen yet", kClearTags});
  } else if (carriers.world && carriers.world->stale && !carriers.lens_stale &&
             !carriers.image_stale) {
    reasons.push_back({"cell tags not visible", kClearTags});
  }
  return reasons;
}

}  // namespace

std::vector<StaleReason> StaleReasonsOf(const ViewFacts& facts,
                                        std::span<const std::size_t> cameras) {
  if (facts.state == nullptr) return {};
  const cell::ViewState& state = *facts.state;
  std::vector<StaleReason> reasons;
  if (facts.now_s - state.now_s > cell::kStateOld_s) {
    return {{"last data from plumblined " + AgeText(facts.now_s - state.now_s),
             RemedyOf(HealthReason::kNoDaemon)}};
  }
  if (facts.model == nullptr)
    reasons.push_back({"plumbline-view cannot read the configuration or the model",
                       "journalctl -u plumbline-view names the file and the line"});
  for (const std::size_t k : cameras) {
    if (k >= state.cameras.size()) continue;
    for (const StaleReason& reason : StaleCameraReasons(facts, k)) {
      reasons.push_back({CameraPrefix(state.cameras[k]) + reason.text, reason.remedy});
    }
  }
  if (facts.carriers.front().robot_stale)
    reasons.push_back({"no current robot joint positions", RemedyOf(HealthReason::kRobotStale)});
  if (!state.payload_kg)
    reasons.push_back({"payload unknown", RemedyOf(HealthReason::kPayloadUnknown)});
  return reasons;
}

std::vector<std::string> StaleReasons(const ViewFacts& facts,
                                      std::span<const std::size_t> cameras) {
  std::vector<std::string> texts;
  for (const StaleReason& reason : StaleReasonsOf(facts, cameras)) texts.push_back(reason.text);
  return texts;
}

CellHealth DisplayedHealth(const ViewFacts& facts) {
  const bool silent =
      facts.state == nullptr || DaemonIsSilent(*facts.state, facts.link_problem, facts.now_s);
  return silent ? HealthOf({.daemon_silent = true}) : facts.state->health;
}

namespace {

/// Text in which every number reads the same but that of an assembly point: the key of repeats.
std::string WithoutNumbers(const std::string& text) {
  std::string key;
  bool named = false;
  for (const char c : text) {
    const bool digit = (c >= '0' && c <= '9') || c == '.';
    if (!digit) named = (key += c).ends_with("point ");
    if (digit && (named || key.empty() || key.back() != '0')) key += named ? c : '0';
  }
  return key;
}

std::string LocalTimeOfDay(double utc_s) {
  return fmt::format("{:%H:%M:%S}", fmt::localtime(static_cast<std::time_t>(std::max(utc_s, 0.0))));
}

}  // namespace

std::vector<PanelLine> RecentMessages(const ViewFacts& facts, std::size_t count) {
  std::vector<cell::ViewLine> lines =
      facts.state != nullptr ? facts.state->lines : facts.viewer_lines;
  std::stable_sort(
      lines.begin(), lines.end(),
      [](const cell::ViewLine& a, const cell::ViewLine& b) { return a.utc_s > b.utc_s; });
  struct Folded {
    cell::ViewLine newest;
    int count = 1;
  };
  std::vector<Folded> folded;
  std::map<std::string, std::size_t> place;
  for (const cell::ViewLine& line : lines) {
    const auto [found, fresh] = place.try_emplace(WithoutNumbers(line.text), folded.size());
    if (fresh) folded.push_back({line});
    if (!fresh) ++folded[found->second].count;
  }
  std::vector<PanelLine> messages;
  for (std::size_t k = 0; k < folded.size() && k < count; ++k) {
    const auto& [line, repeats] = folded[k];
    const Tone tone = line.level <= 3   ? Tone::kBad
                      : line.level == 4 ? Tone::kAttention
                                        : Tone::kPlain;
    const std::string times = repeats > 1 ? fmt::format(" ({} times)", repeats) : "";
    messages.push_back({LocalTimeOfDay(line.utc_s) + times + " " + line.text, tone});
  }
  return messages;
}

}  // namespace plumbline::display
