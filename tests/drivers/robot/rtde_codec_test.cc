#include "drivers/robot/rtde_codec.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <limits>

#include "firmware-like/geometry/rotation.h"

namespace plumbline::rtde_codec_test {

using namespace plumbline::robot::rtde;
using model::RobotMode;
using Octets = std::vector<std::uint8_t>;

namespace {

Octets Of(std::string_view text) {
  return {text.begin(), text.end()};
}

void AppendDouble(Octets& bytes, double value) {
  std::uint64_t bits = 0;
  static_assert(sizeof bits == sizeof value);
  std::memcpy(&bits, &value, sizeof bits);
  for (int shift = 56; shift >= 0; shift -= 8) {
    bytes.push_back(static_cast<std::uint8_t>(bits >> shift));
  }
}

}  // namespace

TEST_CASE("requests have the bytes of the RTDE guide") {
  CHECK(VersionRequest(2) == Octets{0, 5, 86, 0, 2});
  CHECK(MessageOf(Message::kStart) == Octets{0, 3, 83});
  Octets outputs{0, 20, 79};
  AppendDouble(outputs, 500);
  for (const std::uint8_t c : Of("timestamp")) outputs.push_back(c);
  CHECK(OutputsRequest(2, 500, "timestamp") == outputs);
  CHECK(OutputsRequest(1, 500, "a,b") == Octets{0, 6, 79, 'a', ',', 'b'});
  CHECK(InputsRequest("a") == Octets{0, 4, 73, 'a'});
}

TEST_CASE("a message is cut off the stream once it is complete") {
  const Octets stream{0, 4, 83, 1, 0, 3, 80};
  CHECK(FirstFrame({}).state == Frame::State::kIncomplete);
  for (std::size_t n = 0; n < 4; ++n) {
    CHECK(FirstFrame(Bytes(stream).first(n)).state == Frame::State::kIncomplete);
  }
  const Frame first = FirstFrame(stream);
  REQUIRE(first.state == Frame::State::kComplete);
  CHECK(first.type == Message::kStart);
  CHECK(first.size == 4);
  CHECK(Accepted(first.payload) == true);
  const Frame second = FirstFrame(Bytes(stream).subspan(4));
  CHECK(second.type == Message::kPause);
  CHECK(second.payload.empty());
  CHECK(Accepted(second.payload) == std::nullopt);
}

TEST_CASE("a size that no message has is malformed at once") {
  CHECK(FirstFrame(Octets{0, 2}).state == Frame::State::kMalformed);
  CHECK(FirstFrame(Of("HTTP/1.1 400")).state == Frame::State::kMalformed);
}

TEST_CASE("replies to recipes give an id and a type per field") {
  const auto reply = RecipeReplyFrom(Octets{7, 'A', ',', 'N', 'O'}, true);
  REQUIRE(reply);
  CHECK(reply->id == 7);
  CHECK(reply->types == std::vector<std::string>{"A", "NO"});
  CHECK(RecipeReplyFrom(Of("A,,B"), false)->types == std::vector<std::string>{"A", "", "B"});
  CHECK(RecipeReplyFrom({}, false)->types.empty());
  CHECK_FALSE(RecipeReplyFrom({}, true));
}

TEST_CASE("texts of both protocol versions are one printable line") {
  CHECK(TextFrom(Octets{2, 'h', '\n', 1, 'S', 3}, 2) == "S: h ");
  CHECK(TextFrom(Octets{0, 'h', 'i'}, 1) == "hi");
  CHECK_FALSE(TextFrom(Octets{9, 'h'}, 2));
  CHECK_FALSE(TextFrom(Octets{1, 'h', 9, 'S'}, 2));
  CHECK_FALSE(TextFrom({}, 1));
}

TEST_CASE("a data package is decoded in the order of its recipe, in SI units") {
  const std::vector<Output> fields{Output::kTimestamp, Output::kPayload,   Output::kJoints,
                                   Output::kTcpPose,   Output::kRobotMode, Output::kToolNumber,
                                   Output::kPayloadCog};
  for (const int version : {1, 2}) {
    CAPTURE(version);
    const OutputLayout layout(fields, version, 3);
    Octets package;
    if (version == 2) package.push_back(3);
    AppendDouble(package, 12.5);
    AppendDouble(package, 4.25);
    for (int j = 1; j <= 6; ++j) AppendDouble(package, 0.1 * j);
    for (const double v : {0.4, -0.2, 0.6, 0.0, 3.0, 0.0}) AppendDouble(package, v);
    for (const int v : {7, 2})
      package.insert(package.end(), {0, 0, 0, static_cast<std::uint8_t>(v)});
    for (const double v : {0.01, 0.02, 0.03}) AppendDouble(package, v);
    REQUIRE(layout.Fits(package));
    CHECK(layout.Timestamp(package) == 12.5);
    model::RobotState state;
    state.temp_C = 99;
    layout.RobotStateFromPackage(package, state);
    CHECK(state.q[5] == 0.1 * 6);
    CHECK(state.payload_kg == 4.25);
    CHECK(state.payload_cog_F == Vec3(0.01, 0.02, 0.03));
    REQUIRE(state.X_BT);
    CHECK(state.X_BT->p == Vec3(0.4, -0.2, 0.6));
    CHECK(state.X_BT->R.isApprox(RotationFromVector({0, 3, 0}), 1e-15));
    CHECK(state.mode == RobotMode::kRunning);
    CHECK(state.tool_number == 2);
    CHECK_FALSE(state.X_FT);
    CHECK_FALSE(state.temp_C);
    CHECK(state.q_resolution == 0);

    CHECK_FALSE(layout.Fits(Bytes(package).first(package.size() - 1)));
    package[0] = 4;
    CHECK(layout.Fits(package) == (version == 1));
  }
  CHECK_FALSE(OutputLayout().Fits(Octets{0}));
}

TEST_CASE("the safety status comes before the robot's mode, and that before the program's state") {
  CHECK(ModeFrom(7, 7, 2) == RobotMode::kEmergencyStop);
  CHECK(ModeFrom(3, 7, 2) == RobotMode::kStopped);
  CHECK(ModeFrom(1, 7, 1) == RobotMode::kRunning);
  CHECK(ModeFrom(2, 5, 2) == RobotMode::kNotReady);
  CHECK(ModeFrom({}, {}, 2) == RobotMode::kRunning);
  CHECK(ModeFrom({}, {}, 1) == RobotMode::kUnknown);
  CHECK(ModeFrom({}, {}, {}) == RobotMode::kUnknown);
}

TEST_CASE("slots fill the registers from the first ones to number 47") {
  CHECK(SlotsOf({24, 24}) == 4);
  CHECK(SlotsOf({0, 0}) == 8);
  CHECK(SlotsOf({47, 0}) == 0);
  CHECK(SlotsOf({0, 43}) == 0);
  CHECK(InputNames({24, 30}, 1) ==
        "input_int_register_24,input_int_register_25,input_int_register_26,input_int_register_27,"
        "input_double_register_30,input_double_register_31,input_double_register_32,"
        "input_double_register_33,input_double_register_34,input_double_register_35");
  CHECK(InputNames({0, 0}, 8).size() <= 2048);
}

TEST_CASE("an input package holds the heartbeat, the integers of all slots, then the poses") {
  std::vector<InputSlot> slots(2);
  slots[0] = {-2, 17, 300, {0.1, 0.2, 0.3, 1, 2, 3}};
  Octets frame(InputFrameBytes(2));
  WriteInputFrame(9, 258, slots, frame);
  const Frame cut = FirstFrame(frame);
  REQUIRE(cut.state == Frame::State::kComplete);
  REQUIRE(cut.size == frame.size());
  CHECK(cut.type == Message::kData);
  CHECK(Octets(cut.payload.begin(), cut.payload.begin() + 17) ==
        Octets{9, 0, 0, 1, 2, 255, 255, 255, 254, 0, 0, 0, 17, 0, 0, 1, 44});
  Octets pose;
  for (const double v : slots[0].pose) AppendDouble(pose, v);
  CHECK(Octets(cut.payload.begin() + 29, cut.payload.begin() + 77) == pose);
}

TEST_CASE("a radius is rounded up to micrometres, and none is 0") {
  CHECK(RadiusInMicrometres(123.2e-6) == 124);
  CHECK(RadiusInMicrometres(0) == 0);
  CHECK(RadiusInMicrometres(std::numeric_limits<double>::quiet_NaN()) == 0);
  CHECK(RadiusInMicrometres(1e9) == std::numeric_limits<std::int32_t>::max());
}

}  // namespace plumbline::rtde_codec_test
