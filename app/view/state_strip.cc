#include "app/view/state_strip.h"

#include <fmt/format.h>

#include <array>

#include "app/view/palette.h"
#include "app/view/silent_daemon.h"
#include "firmware-like/geometry/length.h"

namespace plumbline::view {

const StateMark& MarkOf(StateClass state) {
  using namespace palette;
  static const std::array<StateMark, 5> kMarks = {{{"healthy", "●", kPanel, kFaded},
                                                   {"advisory", "ℹ", kPanel, kAdvisory},
                                                   {"warning", "▲", kWarningFill, kDarkText},
                                                   {"alarm", "■", kAlarmFill, kDarkText},
                                                   {"unknown", "○", kAlarmFill, kDarkText}}};
  return kMarks.at(static_cast<std::size_t>(state));
}

StateClass ClassOf(Tone tone) {
  switch (tone) {
    case Tone::kAttention:
      return StateClass::kWarning;
    case Tone::kBad:
      return StateClass::kAlarm;
    case Tone::kPlain:
      return StateClass::kAdvisory;
    case Tone::kGood:
    case Tone::kFaded:
      break;
  }
  return StateClass::kHealthy;
}

namespace {

StateClass ClassOfSeverity(HealthSeverity severity) {
  switch (severity) {
    case HealthSeverity::kGood:
      return StateClass::kHealthy;
    case HealthSeverity::kNotice:
      return StateClass::kAdvisory;
    case HealthSeverity::kAttention:
      return StateClass::kWarning;
    case HealthSeverity::kAlarm:
      break;
  }
  return StateClass::kAlarm;
}

/// "gripper is near car body: 12.3 mm", of the pair with the least distance.
std::string NearestPairText(const SceneMeasurements& measured) {
  const MeasuredPair* nearest = nullptr;
  for (const MeasuredPair& pair : measured.pairs) {
    if (pair.state != scene::Proximity::kNear || !pair.separation) continue;
    if (nearest == nullptr || pair.separation->distance_m < nearest->separation->distance_m)
      nearest = &pair;
  }
  if (nearest == nullptr) return Describe(HealthReason::kObjectsNear);
  return fmt::format("{} is near {}: {:.1f} mm", nearest->a, nearest->b,
                     kMmPerMetre * nearest->separation->distance_m);
}

/// Names an undeclared number, or the objects of an interference that this process measures.
std::string ReasonOf(const CellHealth& health, const ViewFacts& facts) {
  if (health.reason == HealthReason::kPayloadUnknown && !facts.state->payload_problem.empty()) {
    return fmt::format("{}: {}", Describe(health.reason), facts.state->payload_problem);
  }
  const SceneMeasurements* const measured = facts.measured;
  const bool fresh = measured != nullptr && facts.now_s - measured->time_s <= kMeasuredFresh_s;
  if (!fresh) return Describe(health.reason);
  if (health.reason == HealthReason::kObjectsNear) return NearestPairText(*measured);
  if (health.reason != HealthReason::kInterference) return Describe(health.reason);
  for (const MeasuredPair& pair : measured->pairs) {
    if (pair.state != scene::Proximity::kInterference) continue;
    const std::string text = fmt::format("interference: {} touches {}", pair.a, pair.b);
    const bool deep = pair.separation && pair.separation->touching;
    return deep ? fmt::format("{}, {:.1f} mm deep", text, kMmPerMetre * pair.separation->depth_m)
                : text;
  }
  return Describe(health.reason);
}

StateStrip NoDaemon(std::string why) {
  return {StateClass::kUnknown, "NO DAEMON", std::move(why), RemedyOf(HealthReason::kNoDaemon)};
}

}  // namespace

StateStrip StripOf(const ViewFacts& facts) {
  if (facts.state == nullptr) return NoDaemon(facts.link_problem);
  const view_link::ViewState& state = *facts.state;
  if (DaemonIsSilent(state, facts.link_problem, facts.now_s)) {
    return NoDaemon(facts.link_problem.empty() ? "last data " + AgeText(facts.now_s - state.now_s)
                                               : facts.link_problem);
  }
  const CellHealth health = DisplayedHealth(facts);
  if (health.severity != HealthSeverity::kAlarm) {
    const auto stale = StaleReasons(facts);
    if (!stale.empty()) return {StateClass::kWarning, "STALE", stale.front(), ""};
  }
  return {ClassOfSeverity(health.severity), Describe(health.severity), ReasonOf(health, facts),
          DisplayedRemedy(state, health)};
}

PanelLine Headline(const ViewFacts& facts) {
  const StateStrip strip = StripOf(facts);
  switch (strip.state) {
    case StateClass::kHealthy:
      return {strip.Text(), Tone::kGood};
    case StateClass::kAdvisory:
      return {strip.Text(), Tone::kPlain};
    case StateClass::kWarning:
      return {strip.Text(), Tone::kAttention};
    case StateClass::kAlarm:
    case StateClass::kUnknown:
      break;
  }
  return {strip.Text(), Tone::kBad};
}

}  // namespace plumbline::view
