#include "app/plant/publish/change_detector.h"

#include <catch2/catch.hpp>
#include <optional>

#include "app/base/text/json_text.h"
#include "firmware-like/snapshot.h"

namespace plumbline::change_detector_test {

using namespace plumbline::plant;

namespace {

config::MqttConfig Rates() {
  config::MqttConfig config;
  config.state_period_s = 5;
  config.change_period_s = 1;
  config.point_change_m = 1e-4;
  return config;
}

struct Detector {
  cell::ViewState state;
  std::optional<ChangeDetector> changes{
      std::in_place, Rates(), FleetCell{"plumbline", "cell-7", "UR10", {}, {{1, "left"}}}, ""};
  double now_s = 100;

  Detector() {
    state.utc_s = 1.7e9;
    state.model_version = 1;
    state.status = status::kReady;
    cell::ViewPoint point;
    point.id = 1;
    point.valid = true;
    point.code = correction::CorrectionCode::kOk;
    state.points = {point};
  }
  std::vector<Message> After(double seconds) {
    now_s += seconds;
    state.utc_s += seconds;
    return changes->Update(state, now_s);
  }
  int Count(const std::vector<Message>& messages, MessageKind kind) const {
    int count = 0;
    for (const Message& message : messages) count += message.kind == kind;
    return count;
  }
};

}  // namespace

TEST_CASE("the first state is reported in full, then one per period and nothing else") {
  Detector detector;
  const auto first = detector.After(0);
  CHECK(detector.Count(first, MessageKind::kState) == 1);
  CHECK(detector.Count(first, MessageKind::kModel) == 1);
  CHECK(detector.Count(first, MessageKind::kPoint) == 1);
  CHECK(detector.Count(first, MessageKind::kAlarm) == 0);
  CHECK(first.back().utc_ms == 1'700'000'000'000);
  int states = 0;
  for (int k = 0; k < 1000; ++k) {
    detector.state.status = static_cast<std::uint16_t>(detector.state.status ^ status::kToggle);
    const auto messages = detector.After(0.1);
    states += detector.Count(messages, MessageKind::kState);
    CHECK(messages.size() ==
          static_cast<std::size_t>(detector.Count(messages, MessageKind::kState)));
  }
  CHECK((states >= 19 && states <= 20));
}

TEST_CASE("a change is reported at once, but at most once per change_s") {
  Detector detector;
  static_cast<void>(detector.After(0));
  int states = 0, points = 0;
  for (int k = 0; k < 100; ++k) {
    detector.state.monitoring.recording = k % 2 == 1;
    detector.state.points[0].translation_B.x() += 2e-4;
    const auto messages = detector.After(0.1);
    states += detector.Count(messages, MessageKind::kState);
    points += detector.Count(messages, MessageKind::kPoint);
  }
  CHECK((states >= 9 && states <= 10));
  CHECK((points >= 9 && points <= 10));
  // A point that drifts slowly is reported once it has left the band.
  Detector slow;
  static_cast<void>(slow.After(0));
  slow.state.points[0].translation_B.x() = 0.9e-4;
  CHECK(slow.Count(slow.After(2), MessageKind::kPoint) == 0);
  slow.state.points[0].translation_B.x() = 1.1e-4;
  CHECK(slow.Count(slow.After(2), MessageKind::kPoint) == 1);
  slow.state.points[0].code = correction::CorrectionCode::kNoRobot;
  slow.state.points[0].valid = false;
  CHECK(slow.Count(slow.After(2), MessageKind::kPoint) == 1);
}

TEST_CASE(
    "an alarm begins at once and ends after being clear; a flickering alarm is reported once") {
  Detector detector;
  static_cast<void>(detector.After(0));
  int reported = 0;
  for (int k = 0; k < 40; ++k) {
    detector.state.alarms = k % 2 == 0 ? alarm::kRobotStale : std::uint16_t{0};
    reported += detector.Count(detector.After(0.2), MessageKind::kAlarm);
  }
  CHECK(reported == 1);
  detector.state.alarms = 0;
  const double gone_utc_s = detector.state.utc_s - 0.2;  // it was last set one state before
  CHECK(detector.Count(detector.After(0.2), MessageKind::kAlarm) == 0);
  const auto messages = detector.After(1.0);
  REQUIRE(detector.Count(messages, MessageKind::kAlarm) == 1);
  CHECK(text::JsonOrNull(messages[0].body).at("event") == "end");
  CHECK(messages[0].utc_ms == Approx(1e3 * gone_utc_s).margin(1));
}

TEST_CASE("a restart repeats no alarm and reports the end of one that ended meanwhile") {
  Detector detector;
  detector.state.alarms = alarm::kRobotStale | alarm::kPointRefused;
  static_cast<void>(detector.After(0));
  detector.changes.emplace(Rates(), FleetCell{"plumbline", "cell-7", "UR10", {}, {}},
                           std::string(detector.changes->Memory()));
  detector.state.alarms = alarm::kPointRefused;
  auto messages = detector.After(3);
  CHECK(detector.Count(messages, MessageKind::kAlarm) == 0);  // it may only flicker
  CHECK(detector.Count(messages, MessageKind::kModel) == 0);
  CHECK(detector.Count(messages, MessageKind::kState) == 1);
  messages = detector.After(1.1);
  REQUIRE(detector.Count(messages, MessageKind::kAlarm) == 1);
  const auto end = text::JsonOrNull(messages[0].body);
  CHECK(end.at("event") == "end");
  CHECK(end.at("bit") == 1);
  // A malformed memory is ignored.
  for (const char* text : {"", "x", "[]", "{\"schema\":10}", "null"}) {
    ChangeDetector other(Rates(), {"plumbline", "cell-7", "UR10", {}, {}}, text);
    CHECK(detector.Count(other.Update(detector.state, 0), MessageKind::kModel) == 1);
  }
}

TEST_CASE("a silent daemon is reported as an alarm, once, until data arrive again") {
  Detector detector;
  static_cast<void>(detector.After(0));
  CHECK(detector.changes->UpdateWithoutState(detector.now_s + 4, 0).empty());
  CHECK(detector.changes->UpdateWithoutState(detector.now_s + 5.1, 0).size() == 1);
  CHECK(detector.changes->UpdateWithoutState(detector.now_s + 60, 0).empty());
  const auto messages = detector.After(61);
  CHECK(detector.Count(messages, MessageKind::kAlarm) == 1);
  CHECK(detector.Count(messages, MessageKind::kState) == 1);
}

TEST_CASE("stream, number and time precede the message body") {
  const auto json =
      text::JsonOrNull(MessageText("0123abcd", {7, {MessageKind::kState, 1234, "{\"status\":9}"}}));
  CHECK(json ==
        nlohmann::json{{"stream", "0123abcd"}, {"seq", 7}, {"timestamp", 1234}, {"status", 9}});
  CHECK(text::JsonOrNull(MessageText("a", {1, {MessageKind::kLost, 2, "{}"}})).size() == 3);
}

TEST_CASE("non-finite values become null; joints are in degrees") {
  cell::ViewState state;
  state.q = model::JointVector::Constant(2, 0.5);
  state.monitoring.drift_statistic = std::numeric_limits<double>::infinity();
  FleetCell cell;
  cell.joints.resize(2);
  cell.joints[1].type = model::JointType::kPrismatic;
  const auto json = text::JsonOrNull(StateBody(state, cell));
  CHECK(json.at("drift_statistic").is_null());
  CHECK(json.at("temp_C").is_null());
  CHECK(json.at("q")[0] == Approx(28.6479));
  CHECK(json.at("q")[1] == 500);
  CHECK(json.at("cameras").empty());
}

}  // namespace plumbline::change_detector_test
