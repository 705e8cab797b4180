#include "firmware-like/cell_health.h"

#include <catch2/catch.hpp>
#include <cstring>
#include <set>

#include "firmware-like/cycle_status.h"
#include "firmware-like/snapshot.h"

namespace plumbline::cell_health_test {

TEST_CASE("health shows the most severe reason that applies") {
  HealthInputs facts;
  facts.weakest_basis = model::RadiusBasis::kMeasured;
  CHECK(HealthOf(facts) == CellHealth{});

  facts.weakest_basis = model::RadiusBasis::kAssumed;
  CHECK(HealthOf(facts) == CellHealth{HealthSeverity::kNotice, HealthReason::kRadiusAssumed});

  facts.warnings = warning::kDrift;
  CHECK(HealthOf(facts) == CellHealth{HealthSeverity::kAttention, HealthReason::kDrift});

  facts.warnings |= warning::kInterference;
  CHECK(HealthOf(facts) == CellHealth{HealthSeverity::kAlarm, HealthReason::kInterference});

  facts.alarms = alarm::kRobotStale;
  CHECK(HealthOf(facts) == CellHealth{HealthSeverity::kAlarm, HealthReason::kRobotStale});
}

TEST_CASE("health is never OK while an alarm bit, a warning bit or a doubt is set") {
  for (int bit = 0; bit < 8; ++bit) {
    CAPTURE(bit);
    CHECK(HealthOf({.alarms = static_cast<std::uint16_t>(1 << bit)}).severity ==
          HealthSeverity::kAlarm);
  }
  for (int bit = 0; bit < 16; ++bit) {
    CAPTURE(bit);
    CHECK(HealthOf({.warnings = static_cast<std::uint16_t>(1 << bit)}).severity >
          HealthSeverity::kGood);
  }
  CHECK(HealthOf({.alarms = 0xFF, .daemon_silent = true}) ==
        CellHealth{HealthSeverity::kAlarm, HealthReason::kNoDaemon});
  CHECK(HealthOf({.extrapolating = true}).reason == HealthReason::kExtrapolating);
  CHECK(HealthOf({.weakest_basis = model::RadiusBasis::kUnknown}).severity ==
        HealthSeverity::kAttention);
  CHECK(HealthOf({.radius_too_large = true}) ==
        CellHealth{HealthSeverity::kAttention, HealthReason::kRadiusTooLarge});
  CHECK(HealthOf({.fiducial_moved = true}).reason == HealthReason::kFiducialMoved);
  CHECK(HealthOf({.alarms = alarm::kPointRefused,
                  .warnings = warning::kLensStale,
                  .required_lens_missing = true}) ==
        CellHealth{HealthSeverity::kAlarm, HealthReason::kRequiredLens});
  CHECK(HealthOf({.scene_lost = true}).reason == HealthReason::kSceneLost);
  CHECK(HealthOf({.warnings = warning::kDrift, .compensated_twice = true}) ==
        CellHealth{HealthSeverity::kAttention, HealthReason::kCompensatedTwice});
  CHECK(HealthOf({.reference_refused = true}).reason == HealthReason::kReferenceRefused);
  CHECK(HealthOf({.warnings = warning::kDrift,
                  .weakest_basis = model::RadiusBasis::kUnknown,
                  .radius_contradicted = true}) ==
        CellHealth{HealthSeverity::kAttention, HealthReason::kRadiusContradicted});
  CHECK(HealthOf({.pending = true}).reason == HealthReason::kPointsPending);
  CHECK(HealthOf({.no_points = true}) ==
        CellHealth{HealthSeverity::kNotice, HealthReason::kNoPoints});
  CHECK(HealthOf({.quarantined = true}).reason == HealthReason::kQuarantined);
  CHECK(HealthOf({.objects_near = true}) ==
        CellHealth{HealthSeverity::kAttention, HealthReason::kObjectsNear});
  CHECK(HealthOf({.scene_incomplete = true}).reason == HealthReason::kSceneIncomplete);
}

TEST_CASE("no point is without correction, extrapolated or without basis while the cell is OK") {
  for (int number = 1; number <= static_cast<int>(correction::kLastCorrectionCode); ++number) {
    CAPTURE(number);
    Snapshot snapshot;
    snapshot.points.resize(2);
    snapshot.points[0].valid = true;
    snapshot.points[0].correction.basis = model::RadiusBasis::kMeasured;
    snapshot.points[1].valid = false;
    snapshot.points[1].code = static_cast<correction::CorrectionCode>(number);
    snapshot.alarms = AlarmsOf(snapshot.points);
    // Without a trusted robot reading, the alarm is that of the reading.
    if (snapshot.points[1].code == correction::CorrectionCode::kNoRobot)
      snapshot.alarms |= AlarmOf(InputFault::kStale);
    CHECK(HealthOf(HealthInputsFrom(snapshot, {}, 0.05)).severity >= HealthSeverity::kAttention);
  }
  for (int fault = 1; fault <= static_cast<int>(kLastInputFault); ++fault) {
    CAPTURE(fault);
    CHECK(HealthOf({.alarms = AlarmOf(static_cast<InputFault>(fault))}).severity ==
          HealthSeverity::kAlarm);
  }
  Snapshot snapshot;
  snapshot.points.resize(1);
  snapshot.points[0].valid = true;
  snapshot.points[0].correction.basis = model::RadiusBasis::kMeasured;
  CHECK(HealthOf(HealthInputsFrom(snapshot, {}, 0.05)) == CellHealth{});
  snapshot.points[0].correction.extrapolated = true;
  CHECK(HealthOf(HealthInputsFrom(snapshot, {}, 0.05)).severity == HealthSeverity::kAttention);
}

TEST_CASE("each reason has a text and, if there is something to do, a remedy") {
  std::set<std::string> texts;
  for (int number = 1; number <= static_cast<int>(kLastHealthReason); ++number) {
    const auto reason = static_cast<HealthReason>(number);
    const std::string text = Describe(reason);
    if (text.empty()) continue;  // unused number
    CAPTURE(number);
    CHECK(texts.insert(text).second);
    CHECK(std::strlen(RemedyOf(reason)) > 0);
  }
  CHECK(texts.size() == 40);
}

}  // namespace plumbline::cell_health_test
