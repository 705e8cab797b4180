#include "app/fleet/changes.h"

#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <optional>

#include "firmware-like/snapshot.h"

using namespace plumbline;

namespace {

MqttConfig Rates() {
  MqttConfig config;
  config.state_period_s = 5;
  config.change_period_s = 1;
  config.point_change_m = 1e-4;
  return config;
}

struct Watched {
  ViewState state;
  std::optional<Changes> kept{std::in_place, Rates(),
                              FleetCell{"plumbline", "cell-7", "UR10", {}, {{1, "left"}}}, ""};
  double now_s = 100;

  Watched() {
    state.utc_s = 1.7e9;
    state.model_version = 1;
    state.status = status::kReady;
    ViewPoint point;
    point.id = 1;
    point.valid = true;
    point.code = CorrectionCode::kOk;
    state.points = {point};
  }
  std::vector<Message> After(double seconds) {
    now_s += seconds;
    state.utc_s += seconds;
    return kept->Take(state, now_s);
  }
  int Count(const std::vector<Message>& messages, MessageKind kind) const {
    int count = 0;
    for (const Message& message : messages) count += message.kind == kind;
    return count;
  }
};

}  // namespace

TEST_CASE("the first state tells all; then one comes each period, and nothing else") {
  Watched watched;
  const auto first = watched.After(0);
  CHECK(watched.Count(first, MessageKind::kState) == 1);
  CHECK(watched.Count(first, MessageKind::kModel) == 1);
  CHECK(watched.Count(first, MessageKind::kPoint) == 1);
  CHECK(watched.Count(first, MessageKind::kAlarm) == 0);
  CHECK(first.back().utc_ms == 1'700'000'000'000);
  int states = 0;
  for (int k = 0; k < 1000; ++k) {
    watched.state.status = static_cast<std::uint16_t>(watched.state.status ^ status::kToggle);
    const auto messages = watched.After(0.1);
    states += watched.Count(messages, MessageKind::kState);
    CHECK(messages.size() ==
          static_cast<std::size_t>(watched.Count(messages, MessageKind::kState)));
  }
  CHECK((states >= 19 && states <= 20));
}

TEST_CASE("a change is told at once, but not more often than change_s") {
  Watched watched;
  static_cast<void>(watched.After(0));
  int states = 0, points = 0;
  for (int k = 0; k < 100; ++k) {
    watched.state.monitoring.recording = k % 2 == 1;
    watched.state.points[0].translation_B.x() += 2e-4;
    const auto messages = watched.After(0.1);
    states += watched.Count(messages, MessageKind::kState);
    points += watched.Count(messages, MessageKind::kPoint);
  }
  CHECK((states >= 9 && states <= 10));
  CHECK((points >= 9 && points <= 10));
  // A point that creeps below the band is told when it has left it.
  Watched slow;
  static_cast<void>(slow.After(0));
  slow.state.points[0].translation_B.x() = 0.9e-4;
  CHECK(slow.Count(slow.After(2), MessageKind::kPoint) == 0);
  slow.state.points[0].translation_B.x() = 1.1e-4;
  CHECK(slow.Count(slow.After(2), MessageKind::kPoint) == 1);
  slow.state.points[0].code = CorrectionCode::kNoRobot;
  slow.state.points[0].valid = false;
  CHECK(slow.Count(slow.After(2), MessageKind::kPoint) == 1);
}

TEST_CASE("an alarm begins at once and ends when it stayed away; one that flickers is one") {
  Watched watched;
  static_cast<void>(watched.After(0));
  int told = 0;
  for (int k = 0; k < 40; ++k) {
    watched.state.alarms = k % 2 == 0 ? alarm::kRobotStale : std::uint16_t{0};
    told += watched.Count(watched.After(0.2), MessageKind::kAlarm);
  }
  CHECK(told == 1);
  watched.state.alarms = 0;
  const double gone_utc_s = watched.state.utc_s - 0.2;  // it was set one state before the last
  CHECK(watched.Count(watched.After(0.2), MessageKind::kAlarm) == 0);
  const auto messages = watched.After(1.0);
  REQUIRE(watched.Count(messages, MessageKind::kAlarm) == 1);
  CHECK(nlohmann::json::parse(messages[0].body).at("event") == "end");
  CHECK(messages[0].utc_ms == Approx(1e3 * gone_utc_s).margin(1));
}

TEST_CASE("memory: a restart tells no alarm twice, and the end of one that ended meanwhile") {
  Watched watched;
  watched.state.alarms = alarm::kRobotStale | alarm::kPointRefused;
  static_cast<void>(watched.After(0));
  watched.kept.emplace(Rates(), FleetCell{"plumbline", "cell-7", "UR10", {}, {}},
                       std::string(watched.kept->Memory()));
  watched.state.alarms = alarm::kPointRefused;
  auto messages = watched.After(3);
  CHECK(watched.Count(messages, MessageKind::kAlarm) == 0);  // it may only flicker
  CHECK(watched.Count(messages, MessageKind::kModel) == 0);
  CHECK(watched.Count(messages, MessageKind::kState) == 1);
  messages = watched.After(1.1);
  REQUIRE(watched.Count(messages, MessageKind::kAlarm) == 1);
  const auto end = nlohmann::json::parse(messages[0].body);
  CHECK(end.at("event") == "end");
  CHECK(end.at("bit") == 1);
  // A memory that makes no sense is none.
  for (const char* text : {"", "x", "[]", "{\"schema\":9}", "null"}) {
    Changes other(Rates(), {"plumbline", "cell-7", "UR10", {}, {}}, text);
    CHECK(watched.Count(other.Take(watched.state, 0), MessageKind::kModel) == 1);
  }
}

TEST_CASE("a daemon that is silent is an alarm, once, until it speaks") {
  Watched watched;
  static_cast<void>(watched.After(0));
  CHECK(watched.kept->Wait(watched.now_s + 4, 0).empty());
  CHECK(watched.kept->Wait(watched.now_s + 5.1, 0).size() == 1);
  CHECK(watched.kept->Wait(watched.now_s + 60, 0).empty());
  const auto messages = watched.After(61);
  CHECK(watched.Count(messages, MessageKind::kAlarm) == 1);
  CHECK(watched.Count(messages, MessageKind::kState) == 1);
}

TEST_CASE("a message as it goes out: stream, number and time before its own values") {
  const auto json = nlohmann::json::parse(
      MessageText("0123abcd", {7, {MessageKind::kState, 1234, "{\"status\":9}"}}));
  CHECK(json ==
        nlohmann::json{{"stream", "0123abcd"}, {"seq", 7}, {"timestamp", 1234}, {"status", 9}});
  CHECK(nlohmann::json::parse(MessageText("a", {1, {MessageKind::kLost, 2, "{}"}})).size() == 3);
}

TEST_CASE("values that are not finite become null, joints go in degrees") {
  ViewState state;
  state.q = JointVector::Constant(2, 0.5);
  state.monitoring.drift_statistic = std::numeric_limits<double>::infinity();
  FleetCell cell;
  cell.joints.resize(2);
  cell.joints[1].type = JointType::kPrismatic;
  const auto json = nlohmann::json::parse(StateBody(state, cell));
  CHECK(json.at("drift_statistic").is_null());
  CHECK(json.at("temp_C").is_null());
  CHECK(json.at("q")[0] == Approx(28.6479));
  CHECK(json.at("q")[1] == 500);
  CHECK(json.at("cameras").empty());
}
