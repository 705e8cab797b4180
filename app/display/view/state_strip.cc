#include "app/display/view/state_strip.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>

#include "app/cell/view_link/view_client.h"
#include "app/display/view/palette.h"
#include "app/display/view/point_tiles.h"
#include "firmware-like/correction/code_remedy.h"
#include "firmware-like/geometry/units.h"

namespace plumbline::display {
namespace {

using cell::ViewPoint;

/// "left bracket (point 3)", or "point 3" if it has no name.
std::string NumberedName(const ViewFacts& facts, int id) {
  const std::string name = PointName(facts, id), number = fmt::format("point {}", id);
  return name == number ? name : fmt::format("{} ({})", name, number);
}

/// The first of the points that `holds`, by name, and how many more there are; empty if there are
/// none.
template <typename Predicate>
std::string PointsWhere(const ViewFacts& facts, Predicate holds) {
  const std::vector<ViewPoint>& points = facts.state->points;
  const auto first = std::find_if(points.begin(), points.end(), holds);
  if (first == points.end()) return "";
  const auto more = std::count_if(first + 1, points.end(), holds);
  return NumberedName(facts, first->id) + (more > 0 ? fmt::format(" and {} more", more) : "");
}

/// "left bracket (point 3): TEXT" for the valid points whose radius has that basis.
HealthMessage OfBasis(const ViewFacts& facts, HealthReason reason, model::RadiusBasis basis,
                      const char* text) {
  const std::string points = PointsWhere(
      facts, [&](const ViewPoint& point) { return point.valid && point.basis == basis; });
  return {points.empty() ? Describe(reason) : fmt::format("{}: {}", points, text),
          RemedyOf(reason)};
}

HealthMessage NoDaemon(const ViewFacts& facts) {
  const bool refused = facts.link_problem == cell::kMayNotConnect;
  const std::string age =
      facts.state == nullptr ? "" : "last data " + AgeText(facts.now_s - facts.state->now_s);
  const std::string what =
      facts.link_problem.empty() ? "plumblined does not respond" : facts.link_problem;
  return {age.empty() ? what : fmt::format("{}, {}", what, age),
          refused ? "run plumbline-view as the user plumbline" : RemedyOf(HealthReason::kNoDaemon)};
}

/// The reason with what the daemon knows of it, which may be nothing.
HealthMessage Explained(HealthReason reason, const std::string& problem,
                        const std::string& remedy) {
  return {problem.empty() ? Describe(reason) : fmt::format("{}: {}", Describe(reason), problem),
          remedy.empty() ? RemedyOf(reason) : remedy};
}

template <HealthReason kReason>
HealthMessage RobotNotRead(const ViewFacts& facts) {
  return Explained(kReason, facts.state->robot_problem, facts.state->robot_remedy);
}

HealthMessage PointRefused(const ViewFacts& facts) {
  using enum correction::CorrectionCode;
  const auto refused = [](const ViewPoint& point) {
    return !point.valid && point.code != kOk && point.code != kNoRobot && point.code != kPending;
  };
  const std::vector<ViewPoint>& points = facts.state->points;
  const auto first = std::find_if(points.begin(), points.end(), refused);
  if (first == points.end())
    return {Describe(HealthReason::kPointRefused), RemedyOf(HealthReason::kPointRefused)};
  return {
      fmt::format("no correction at {}: {}", PointsWhere(facts, refused), CodeText(first->code)),
      fmt::format("do not assemble there; {}", correction::RemedyOf(first->code))};
}

/// "gripper is near car body: 12.3 mm", of the pair with the least distance.
HealthMessage ObjectsNear(const ViewFacts& facts) {
  const HealthReason reason = HealthReason::kObjectsNear;
  const cell::MeasuredPair* nearest = nullptr;
  for (const cell::MeasuredPair& pair : facts.measured->pairs) {
    if (pair.state != scene::Proximity::kNear || !pair.separation) continue;
    if (nearest == nullptr || pair.separation->distance_m < nearest->separation->distance_m)
      nearest = &pair;
  }
  if (nearest == nullptr) return {Describe(reason), RemedyOf(reason)};
  return {fmt::format("{} is near {}: {:.1f} mm", nearest->a, nearest->b,
                      kMmPerMetre * nearest->separation->distance_m),
          RemedyOf(reason)};
}

HealthMessage InterferenceMessage(const ViewFacts& facts) {
  const HealthReason reason = HealthReason::kInterference;
  for (const cell::MeasuredPair& pair : facts.measured->pairs) {
    if (pair.state != scene::Proximity::kInterference) continue;
    const std::string text = fmt::format("interference: {} touches {}", pair.a, pair.b);
    const bool deep = pair.separation && pair.separation->touching;
    return {deep ? fmt::format("{}, {:.1f} mm deep", text, kMmPerMetre * pair.separation->depth_m)
                 : text,
            fmt::format("stop and move {} and {} apart", pair.a, pair.b)};
  }
  return {Describe(reason), RemedyOf(reason)};
}

HealthMessage FiducialMoved(const ViewFacts& facts) {
  const HealthReason reason = HealthReason::kFiducialMoved;
  for (const cell::ViewCamera& camera : facts.state->cameras) {
    const status::CameraStatus& status = camera.status;
    if (status.contradicting_count == 0) continue;
    const auto end =
        status.contradicting_tags.begin() + static_cast<std::ptrdiff_t>(status.contradicting_count);
    const std::string ids =
        fmt::format("{}", fmt::join(status.contradicting_tags.begin(), end, ", "));
    return {fmt::format("{}reference tag {} has moved", CameraPrefix(camera), ids),
            fmt::format("put tag {} back, or measure its position again", ids)};
  }
  return {Describe(reason), RemedyOf(reason)};
}

HealthMessage CameraLost(const ViewFacts& facts) {
  const HealthReason reason = HealthReason::kCameraLost;
  for (std::size_t k = 0; k < facts.state->cameras.size() && k < facts.carriers.size(); ++k) {
    const cell::ViewCamera& camera = facts.state->cameras[k];
    if (camera.image && !facts.carriers[k].image_stale) continue;
    return {fmt::format("{}no images from the camera {}", CameraPrefix(camera), camera.serial),
            "check its cable and its power; plumbline cameras lists what is connected"};
  }
  return {Describe(reason), RemedyOf(reason)};
}

HealthMessage DecodingUnchecked(const ViewFacts& facts) {
  const HealthReason reason = HealthReason::kDecodingUnchecked;
  if (facts.model != nullptr && facts.model->config.robot.transport == "replay")
    return {"the joints are played back from a table, not read from a robot",
            "to read the robot, set transport = \"tcp\" and host in [robot]"};
  return {Describe(reason), RemedyOf(reason)};
}

HealthMessage RadiusTooLarge(const ViewFacts& facts) {
  const HealthReason reason = HealthReason::kRadiusTooLarge;
  const std::string points =
      facts.model == nullptr ? "" : PointsWhere(facts, [&](const ViewPoint& point) {
        return point.valid &&
               point.uncertainty_m > facts.model->config.machine.limits.max_translation_m;
      });
  return {
      points.empty() ? Describe(reason) : points + ": the radius exceeds the largest correction",
      RemedyOf(reason)};
}

/// Reasons whose message names more than cell_health.h can.
struct NamedMessage {
  HealthReason reason;
  HealthMessage (*message)(const ViewFacts& facts);
};
constexpr std::array kNamedMessages = {
    NamedMessage{HealthReason::kRobotNotRead, RobotNotRead<HealthReason::kRobotNotRead>},
    NamedMessage{HealthReason::kRobotStale, RobotNotRead<HealthReason::kRobotStale>},
    NamedMessage{HealthReason::kPayloadUnknown,
                 [](const ViewFacts& facts) {
                   return Explained(HealthReason::kPayloadUnknown, facts.state->payload_problem,
                                    facts.state->payload_remedy);
                 }},
    NamedMessage{HealthReason::kPointRefused, PointRefused},
    NamedMessage{HealthReason::kFiducialMoved, FiducialMoved},
    NamedMessage{HealthReason::kCameraLost, CameraLost},
    NamedMessage{HealthReason::kDecodingUnchecked, DecodingUnchecked},
    NamedMessage{HealthReason::kRadiusTooLarge, RadiusTooLarge},
    NamedMessage{HealthReason::kRadiusUnknown,
                 [](const ViewFacts& facts) {
                   return OfBasis(facts, HealthReason::kRadiusUnknown, model::RadiusBasis::kUnknown,
                                  "the radius has no basis");
                 }},
    NamedMessage{HealthReason::kRadiusAssumed,
                 [](const ViewFacts& facts) {
                   return OfBasis(facts, HealthReason::kRadiusAssumed, model::RadiusBasis::kAssumed,
                                  "the radius is assumed, not measured");
                 }},
    NamedMessage{HealthReason::kExtrapolating,
                 [](const ViewFacts& facts) {
                   const std::string points = PointsWhere(facts, [](const ViewPoint& point) {
                     return point.valid && point.extrapolated;
                   });
                   const HealthReason reason = HealthReason::kExtrapolating;
                   return HealthMessage{points.empty() ? Describe(reason)
                                                       : points + ": outside the calibrated range",
                                        RemedyOf(reason)};
                 }},
    NamedMessage{HealthReason::kProposalWaiting,
                 [](const ViewFacts& facts) {
                   const int version = facts.state->monitoring.model.proposed;
                   const HealthReason reason = HealthReason::kProposalWaiting;
                   if (version <= 0) return HealthMessage{Describe(reason), RemedyOf(reason)};
                   return HealthMessage{
                       fmt::format("model version {} awaits approval", version),
                       fmt::format("read its report, then run plumbline model apply {}", version)};
                 }},
};

}  // namespace

std::string CodeText(correction::CorrectionCode code) {
  return fmt::format("{} (code {})", Describe(code), static_cast<int>(code));
}

std::string LearningText(const status::MonitoringStatus& monitoring) {
  return fmt::format("learning the reference: {} of {} probes", monitoring.reference_learned,
                     monitoring.reference_wanted);
}

HealthMessage MessageOf(const CellHealth& health, const ViewFacts& facts) {
  const HealthReason reason = health.reason;
  if (reason == HealthReason::kNoDaemon) return NoDaemon(facts);
  if (facts.state != nullptr) {
    // An older measurement says nothing.
    const bool fresh =
        facts.measured != nullptr && facts.now_s - facts.measured->time_s <= cell::kMeasuredFresh_s;
    if (fresh && reason == HealthReason::kObjectsNear) return ObjectsNear(facts);
    if (fresh && reason == HealthReason::kInterference) return InterferenceMessage(facts);
    for (const NamedMessage& row : kNamedMessages) {
      if (row.reason == reason) return row.message(facts);
    }
  }
  return {Describe(reason), RemedyOf(reason)};
}

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
