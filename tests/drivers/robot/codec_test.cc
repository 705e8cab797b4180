#include "drivers/robot/codec.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "tests/drivers/robot/small_profile.h"

namespace plumbline::codec_test {

using namespace plumbline::robot;

namespace {

constexpr double kPi = std::numbers::pi;
using modbus::WordOrder;

/// Decodes one joint whose registers start at 0.
double Decode(const JointSignal& joint, std::vector<std::uint16_t> words) {
  RobotProfile profile;
  profile.blocks = {{RegisterTable::kHolding, 0, 4}};
  profile.joints = {joint};
  words.resize(4);
  const Result<RobotCodec> codec = RobotCodec::Create(profile);
  REQUIRE(codec.ok());
  model::RobotState state;
  codec->RobotStateFromRegisters(words, state);
  return state.q[0];
}

double Decode(RegisterType type, WordOrder order, double scale, double offset,
              const std::vector<std::uint16_t>& words) {
  RegisterValue value = ValueAt(0, type, scale);
  value.order = order;
  value.offset = offset;
  return Decode({value, JointWrap::kNone, {}}, words);
}

}  // namespace

TEST_CASE("every type and word order decodes correctly") {
  struct Row {
    RegisterType type;
    WordOrder order;
    std::vector<std::uint16_t> words;
    double raw;
  };
  const Row rows[] = {
      {RegisterType::kInt16, WordOrder::kAbcd, {0x0000}, 0},
      {RegisterType::kInt16, WordOrder::kAbcd, {0x7FFF}, 32767},
      {RegisterType::kInt16, WordOrder::kAbcd, {0x8000}, -32768},
      {RegisterType::kInt16, WordOrder::kDcba, {0xFFFF}, -1},
      {RegisterType::kUint16, WordOrder::kAbcd, {0x8000}, 32768},
      {RegisterType::kUint16, WordOrder::kAbcd, {0xFFFF}, 65535},
      {RegisterType::kInt32, WordOrder::kAbcd, {0x0102, 0x0304}, 16909060},
      {RegisterType::kInt32, WordOrder::kCdab, {0x0304, 0x0102}, 16909060},
      {RegisterType::kInt32, WordOrder::kBadc, {0x0201, 0x0403}, 16909060},
      {RegisterType::kInt32, WordOrder::kDcba, {0x0403, 0x0201}, 16909060},
      {RegisterType::kInt32, WordOrder::kAbcd, {0xFFFF, 0xFFFE}, -2},
      {RegisterType::kInt32, WordOrder::kCdab, {0x0000, 0x8000}, -2147483648.0},
      {RegisterType::kUint32, WordOrder::kAbcd, {0xFFFF, 0xFFFE}, 4294967294.0},
      {RegisterType::kUint32, WordOrder::kDcba, {0x0403, 0x0201}, 16909060},
      {RegisterType::kFloat32, WordOrder::kAbcd, {0x3F80, 0x0000}, 1},
      {RegisterType::kFloat32, WordOrder::kCdab, {0x0000, 0x3F80}, 1},
      {RegisterType::kFloat32, WordOrder::kBadc, {0x803F, 0x0000}, 1},
      {RegisterType::kFloat32, WordOrder::kDcba, {0x0000, 0x803F}, 1},
      {RegisterType::kFloat32, WordOrder::kAbcd, {0xC2F6, 0xE979}, static_cast<double>(-123.456F)},
  };
  for (const Row& row : rows) {
    INFO("type " << static_cast<int>(row.type) << " order " << static_cast<int>(row.order));
    CHECK(Decode(row.type, row.order, 1, 0, row.words) == row.raw);
    CHECK(Decode(row.type, row.order, -0.25, 3, row.words) == Approx(3 - 0.25 * row.raw));
  }
}

TEST_CASE("implausible numbers are decoded unchanged") {
  CHECK(std::isnan(Decode(RegisterType::kFloat32, WordOrder::kAbcd, 1, 0, {0x7FC0, 0x0000})));
  CHECK(Decode(RegisterType::kFloat32, WordOrder::kAbcd, 1, 0, {0x7F80, 0x0000}) ==
        std::numeric_limits<double>::infinity());
  CHECK(Decode(RegisterType::kFloat32, WordOrder::kAbcd, 1, 0, {0x7149, 0xF2CA}) > 1e29);
}

TEST_CASE("an angle above pi is unwrapped by minus two pi if the profile says so") {
  const RegisterValue mrad = ValueAt(0, RegisterType::kUint16, 1e-3);
  struct Row {
    std::uint16_t word;
    double angle;
  };
  const Row rows[] = {{0, 0},
                      {1000, 1.0},
                      {3141, 3.141},
                      {3142, 3.142 - 2 * kPi},
                      {6282, 6.282 - 2 * kPi},
                      {6283, 6.283 - 2 * kPi}};
  for (const Row& row : rows) {
    CHECK(Decode({mrad, JointWrap::kPi, {}}, {row.word}) == Approx(row.angle).margin(1e-12));
  }
  const RegisterValue exact = ValueAt(0, RegisterType::kUint16, kPi / 1000);
  CHECK(Decode({exact, JointWrap::kPi, {}}, {1000}) == kPi);
}

TEST_CASE("whole turns are added, and may count backwards") {
  const RegisterValue mrad = ValueAt(0, RegisterType::kUint16, 1e-3);
  const RegisterValue turns = ValueAt(1, RegisterType::kInt16, 1);
  const RegisterValue backwards = ValueAt(1, RegisterType::kInt16, -1);
  CHECK(Decode({mrad, JointWrap::kRevolutions, turns}, {3142, 0}) == Approx(3.142));
  CHECK(Decode({mrad, JointWrap::kRevolutions, turns}, {6282, 0}) == Approx(6.282));
  CHECK(Decode({mrad, JointWrap::kRevolutions, turns}, {3142, 65535}) == Approx(3.142 - 2 * kPi));
  CHECK(Decode({mrad, JointWrap::kRevolutions, turns}, {6283, 65535}) == Approx(6.283 - 2 * kPi));
  CHECK(Decode({mrad, JointWrap::kRevolutions, turns}, {0, 65535}) == Approx(-2 * kPi));
  CHECK(Decode({mrad, JointWrap::kRevolutions, turns}, {10, 2}) == Approx(0.010 + 4 * kPi));
  CHECK(Decode({mrad, JointWrap::kRevolutions, backwards}, {6283, 1}) == Approx(6.283 - 2 * kPi));
}

namespace {

/// Registers as documented by Universal Robots: the angle modulo one turn in whole mrad, and the
/// turn.
std::vector<std::uint16_t> ShownByController(double angle) {
  int turn = 0;
  while (angle < 0) {
    angle += 2 * kPi;
    --turn;
  }
  while (angle >= 2 * kPi) {
    angle -= 2 * kPi;
    ++turn;
  }
  const auto mrad = std::lround(angle * 1000);
  return {static_cast<std::uint16_t>(mrad), static_cast<std::uint16_t>(turn & 0xFFFF)};
}

}  // namespace

TEST_CASE("any joint angle is recovered from the 1 mrad registers within 0.5 mrad") {
  const JointSignal joint{ValueAt(0, RegisterType::kUint16, 1e-3), JointWrap::kRevolutions,
                          ValueAt(1, RegisterType::kInt16, 1)};
  std::mt19937 random(20260101);
  std::uniform_real_distribution<double> angles(-2 * kPi, 2 * kPi);
  std::vector<double> chosen = {0,        kPi,        -kPi,           kPi / 2,          -kPi / 2,
                                -1e-9,    -0.0004999, 2 * kPi - 1e-3, 1e-3 - 2 * kPi,   -0.0005001,
                                -2 * kPi, 3.1415,     -3.1415,        2 * kPi - 0.0001, 5e-4};
  for (int i = 0; i < 2000; ++i) chosen.push_back(angles(random));
  double worst = 0;
  for (const double angle : chosen) {
    worst = std::max(worst, std::abs(Decode(joint, ShownByController(angle)) - angle));
  }
  CHECK(worst <= 0.5e-3 + 1e-12);
  CHECK(worst > 0.49e-3);
}

namespace {

/// 32 holding registers and every signal that a profile can contain.
RobotProfile FullProfile() {
  RobotProfile profile = SmallProfile();
  profile.blocks = {{RegisterTable::kInput, 200, 3},
                    {RegisterTable::kHolding, 0, 32},
                    {RegisterTable::kDiscrete, 7, 2}};
  PoseSignal pose;
  for (int i = 0; i < 3; ++i) {
    const auto k = static_cast<std::size_t>(i);
    pose.position[k] = ValueAt(2 + i, RegisterType::kInt16, 1e-4);
    pose.orientation[k] = ValueAt(5 + i, RegisterType::kInt16, 1e-3);
  }
  profile.tcp = pose;
  profile.tool_offset = pose;
  profile.tool_offset->convention = ReportedOrientation::kZyz;
  profile.payload_mass = ValueAt(8, RegisterType::kUint16, 0.01);
  profile.payload_cog = {ValueAt(9, RegisterType::kInt16, 1e-4),
                         ValueAt(10, RegisterType::kInt16, 1e-4),
                         ValueAt(11, RegisterType::kInt16, 1e-4)};
  for (int i = 200; i < 203; ++i) {
    RegisterValue value = ValueAt(i, RegisterType::kInt16, 1);
    value.table = RegisterTable::kInput;
    profile.temperatures.push_back(value);
  }
  profile.tool_number = ValueAt(12, RegisterType::kUint16, 1);
  profile.sequence = ValueAt(13, RegisterType::kUint32, 1);
  profile.mode.value = ValueAt(15, RegisterType::kInt16, 1);
  profile.mode.meanings = {{7, model::RobotMode::kRunning}, {-1, model::RobotMode::kNotReady}};
  profile.mode.bits = {{RegisterTable::kDiscrete, 8, 0, true, model::RobotMode::kEmergencyStop},
                       {RegisterTable::kHolding, 16, 3, false, model::RobotMode::kManual}};
  return profile;
}

/// The words of FullProfile: three input, 32 holding, two discrete.
struct Image {
  std::vector<std::uint16_t> words = std::vector<std::uint16_t>(37);
  std::uint16_t& input(std::size_t i) { return words[i]; }
  std::uint16_t& holding(std::size_t i) { return words[3 + i]; }
  std::uint16_t& discrete(std::size_t i) { return words[35 + i]; }
};

}  // namespace

TEST_CASE("several blocks are decoded to a state in SI") {
  const Result<RobotCodec> codec = RobotCodec::Create(FullProfile());
  REQUIRE(codec.ok());
  CHECK(codec->word_count() == 37);
  Image image;
  image.holding(0) = 1500;
  image.holding(1) = static_cast<std::uint16_t>(-700);
  image.holding(2) = 4000;
  image.holding(4) = static_cast<std::uint16_t>(-12345);
  image.holding(7) = 1571;  // a rotation vector of a quarter turn about z
  image.holding(8) = 1234;
  image.holding(10) = static_cast<std::uint16_t>(-55);
  image.holding(12) = 9;
  image.holding(13) = 1;
  image.holding(14) = 2;
  image.holding(15) = 7;
  image.holding(16) = 0x0008;
  image.input(0) = 30;
  image.input(1) = 40;
  image.input(2) = 35;
  model::RobotState state;
  codec->RobotStateFromRegisters(image.words, state);

  REQUIRE(state.q.size() == 2);
  CHECK(state.q[0] == Approx(1.5));
  CHECK(state.q[1] == Approx(-0.7));
  CHECK(state.q_resolution == Approx(1e-3));
  REQUIRE(state.X_BT);
  CHECK(state.X_BT->p.isApprox(Vec3(0.4, 0, -1.2345)));
  CHECK((state.X_BT->R * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-3));
  REQUIRE(state.X_FT);
  CHECK((state.X_FT->R * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-3));
  CHECK(state.payload_kg == Approx(12.34));
  REQUIRE(state.payload_cog_F);
  CHECK(state.payload_cog_F->isApprox(Vec3(0, -0.0055, 0)));
  CHECK(state.temp_C == Approx(35));
  CHECK(state.tool_number == 9);
  CHECK(state.mode == model::RobotMode::kRunning);
  CHECK(codec->RefreshCounter(image.words) == 65538U);
}

TEST_CASE("the mode is decided by the first matching bit, otherwise by the value") {
  const Result<RobotCodec> codec = RobotCodec::Create(FullProfile());
  REQUIRE(codec.ok());
  struct Row {
    std::uint16_t discrete, word, value;
    model::RobotMode mode;
  };
  const Row rows[] = {
      {1, 8, 7, model::RobotMode::kEmergencyStop}, {1, 0, 7, model::RobotMode::kEmergencyStop},
      {0, 0xFFF7, 7, model::RobotMode::kManual},   {0, 8, 7, model::RobotMode::kRunning},
      {0, 8, 0xFFFF, model::RobotMode::kNotReady}, {0, 8, 3, model::RobotMode::kUnknown}};
  for (const Row& row : rows) {
    Image image;
    image.discrete(1) = row.discrete;
    image.holding(16) = row.word;
    image.holding(15) = row.value;
    model::RobotState state;
    codec->RobotStateFromRegisters(image.words, state);
    CHECK(state.mode == row.mode);
  }
}

TEST_CASE("the temperature is the mean or the maximum of the joints") {
  RobotProfile profile = FullProfile();
  profile.hottest_joint = true;
  const Result<RobotCodec> codec = RobotCodec::Create(profile);
  REQUIRE(codec.ok());
  Image image;
  image.input(0) = static_cast<std::uint16_t>(-5);
  image.input(1) = 41;
  model::RobotState state;
  codec->RobotStateFromRegisters(image.words, state);
  CHECK(state.temp_C == Approx(41));
}

TEST_CASE("orientations are decoded in the convention of the profile") {
  struct Row {
    ReportedOrientation convention;
    Mat3 R;  // for the angles 0.1, -0.2, 0.3
  };
  const auto turn = [](double angle, const Vec3& axis) {
    return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  };
  const Vec3 x = Vec3::UnitX();
  const Vec3 y = Vec3::UnitY();
  const Vec3 z = Vec3::UnitZ();
  const Vec3 v(0.1, -0.2, 0.3);
  const Row rows[] = {
      {ReportedOrientation::kRotationVector, turn(v.norm(), v.normalized())},
      {ReportedOrientation::kRollPitchYaw, turn(0.3, z) * turn(-0.2, y) * turn(0.1, x)},
      {ReportedOrientation::kAbc, turn(0.1, z) * turn(-0.2, y) * turn(0.3, x)},
      {ReportedOrientation::kZyz, turn(0.1, z) * turn(-0.2, y) * turn(0.3, z)}};
  for (const Row& row : rows) {
    RobotProfile profile = FullProfile();
    profile.tcp->convention = row.convention;
    const Result<RobotCodec> codec = RobotCodec::Create(profile);
    REQUIRE(codec.ok());
    Image image;
    image.holding(5) = 100;
    image.holding(6) = static_cast<std::uint16_t>(-200);
    image.holding(7) = 300;
    model::RobotState state;
    codec->RobotStateFromRegisters(image.words, state);
    INFO("convention " << static_cast<int>(row.convention));
    CHECK(state.X_BT->R.isApprox(row.R, 1e-12));
  }
}

TEST_CASE("an invalid profile is rejected with the reason") {
  struct Row {
    const char* what;
    void (*spoil)(RobotProfile&);
    const char* message;
  };
  const Row rows[] = {
      {"no joints", [](RobotProfile& p) { p.joints.clear(); }, "0 joints"},
      {"too many joints", [](RobotProfile& p) { p.joints.resize(13, p.joints[0]); }, "13 joints"},
      {"empty block", [](RobotProfile& p) { p.blocks[0].count = 0; }, "block of 0"},
      {"large block", [](RobotProfile& p) { p.blocks[0].count = 126; }, "block of 126"},
      {"block beyond the end", [](RobotProfile& p) { p.blocks[0].first = 65534; }, "65534"},
      {"joint outside", [](RobotProfile& p) { p.joints[1].value.address = 32; }, "joint 2 at 32"},
      {"second word outside",
       [](RobotProfile& p) {
         p.joints[1].value.address = 31;
         p.joints[1].value.type = RegisterType::kFloat32;
       },
       "joint 2 at 31"},
      {"other table", [](RobotProfile& p) { p.joints[0].value.table = RegisterTable::kInput; },
       "joint 1 at 0"},
      {"scale 0", [](RobotProfile& p) { p.payload_mass->scale = 0; }, "scale 0"},
      {"scale NaN", [](RobotProfile& p) { p.payload_mass->scale = std::nan(""); }, "nan"},
      {"counter as float", [](RobotProfile& p) { p.sequence->type = RegisterType::kFloat32; },
       "integer"},
      {"bit 16", [](RobotProfile& p) { p.mode.bits[0].bit = 16; }, "mode bit 16"},
  };
  for (const Row& row : rows) {
    RobotProfile profile = FullProfile();
    row.spoil(profile);
    INFO(row.what);
    const Result<RobotCodec> codec = RobotCodec::Create(profile);
    REQUIRE_FALSE(codec.ok());
    CHECK_THAT(codec.error(), Catch::Contains(row.message));
  }
}

}  // namespace plumbline::codec_test
