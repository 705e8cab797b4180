#include "app/display/view/state_strip.h"

#include <array>

#include "app/display/view/health_message.h"
#include "app/display/view/palette.h"

namespace plumbline::display {

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

}  // namespace

StateStrip StripOf(const ViewFacts& facts) {
  const CellHealth health = DisplayedHealth(facts);
  const HealthMessage message = MessageOf(health, facts);
  if (health.reason == HealthReason::kNoDaemon)
    return {StateClass::kUnknown, "NO DAEMON", message.reason, message.remedy};
  if (health.severity != HealthSeverity::kAlarm) {
    const std::vector<StaleReason> stale = StaleReasonsOf(facts, facts.shown);
    if (!stale.empty())
      return {StateClass::kWarning, "STALE", stale.front().text, stale.front().remedy};
  }
  return {ClassOfSeverity(health.severity), Describe(health.severity), message.reason,
          message.remedy};
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

}  // namespace plumbline::display
