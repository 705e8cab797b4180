#include "app/base/config/robot_profile_reader.h"

#include <bit>
#include <catch2/catch.hpp>
#include <filesystem>
#include <map>
#include <numbers>

#include "app/base/config/required_file.h"
#include "drivers/robot/codec.h"
#include "drivers/robot/push_codec.h"
#include "tests/file_text.h"

namespace plumbline::robot_profile_reader_test {

using namespace plumbline::config;

namespace {

constexpr double kRad = std::numbers::pi / 180;

robot::RobotProfile Shipped(const std::string& name) {
  FaultList faults;
  const std::string path = "config/profiles/" + name;
  const auto profile = RobotProfileFromText(test::FileText(path), path, faults);
  INFO(FaultsText(faults));
  REQUIRE(profile);
  CHECK(faults.All().empty());
  return *profile;
}

/// A hand-made image of registers, decoded through a profile.
class Registers {
 public:
  void Word(robot::RegisterTable table, int address, int value) {
    words_[{table, address}] = static_cast<std::uint16_t>(value & 0xFFFF);
  }
  void Words(robot::RegisterTable table, int first, const std::vector<int>& values) {
    for (const int value : values) Word(table, first++, value);
  }
  void Float(robot::RegisterTable table, int address, float value) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    Word(table, address, static_cast<int>(bits >> 16));
    Word(table, address + 1, static_cast<int>(bits & 0xFFFF));
  }
  void Floats(robot::RegisterTable table, int first, const std::vector<float>& values) {
    for (const float value : values) {
      Float(table, first, value);
      first += 2;
    }
  }
  model::RobotState DecodedBy(const robot::RobotProfile& profile) const {
    const Result<robot::RobotCodec> codec = robot::RobotCodec::Create(profile);
    REQUIRE(codec.ok());
    std::vector<std::uint16_t> buffer;
    for (const robot::RegisterBlock& block : profile.blocks) {
      for (int i = 0; i < block.count; ++i) {
        const auto found = words_.find({block.table, block.first + i});
        buffer.push_back(found == words_.end() ? std::uint16_t{0} : found->second);
      }
    }
    model::RobotState state;
    codec->RobotStateFromRegisters(buffer, state);
    return state;
  }

 private:
  std::map<std::pair<robot::RegisterTable, int>, std::uint16_t> words_;
};

constexpr auto kHolding = robot::RegisterTable::kHolding;
constexpr auto kInput = robot::RegisterTable::kInput;

void CheckJoints(const model::RobotState& state, const std::vector<double>& expected,
                 double within) {
  REQUIRE(state.q.size() == static_cast<int>(expected.size()));
  for (std::size_t i = 0; i < expected.size(); ++i) {
    INFO("joint " << i + 1);
    CHECK(state.q[static_cast<int>(i)] == Approx(expected[i]).margin(within));
  }
}

Mat3 Turn(double angle, const Vec3& axis) {
  return Eigen::AngleAxisd(angle, axis).toRotationMatrix();
}

}  // namespace

TEST_CASE("Universal Robots without modification") {
  const robot::RobotProfile profile = Shipped("universal-robots.toml");
  Registers registers;
  registers.Words(kHolding, 258, {7, 0, 1, 0, 0, 0});
  registers.Words(kHolding, 270, {0, 4712, 1571, 4712, 1571, 6283});
  registers.Words(kHolding, 320, {0, 65535, 0, 65535, 0, 65535});
  registers.Words(kHolding, 300, {30, 31, 32, 33, 34, 35});
  registers.Words(kHolding, 400, {5000, -2500, 7345, 0, 0, 1571});
  registers.Words(kHolding, 420, {0, 10, 1200, 0, 0, 0});
  model::RobotState state = registers.DecodedBy(profile);
  CheckJoints(state, {0, -1.5708, 1.5708, -1.5708, 1.5708, 0}, 0.5e-3);
  CHECK(state.q_resolution == Approx(1e-3));
  REQUIRE(state.X_BT);
  CHECK(state.X_BT->p.isApprox(Vec3(0.5, -0.25, 0.7345)));
  CHECK((state.X_BT->R * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-3));
  CHECK_FALSE(state.tcp_is_flange);
  CHECK(state.X_FT->p.isApprox(Vec3(0, 0.001, 0.12)));
  CHECK(state.temp_C == Approx(32.5));
  CHECK_FALSE(state.payload_kg);
  CHECK(state.mode == model::RobotMode::kRunning);
  CHECK(profile.port == 502);

  struct Row {
    int address, value;
    model::RobotMode mode;
  };
  const Row rows[] = {
      {258, 3, model::RobotMode::kNotReady},     {258, 9, model::RobotMode::kUnknown},
      {258, 65535, model::RobotMode::kNotReady}, {263, 1, model::RobotMode::kManual},
      {261, 1, model::RobotMode::kStopped},      {262, 1, model::RobotMode::kEmergencyStop}};
  for (const Row& row : rows) {
    registers.Word(kHolding, row.address, row.value);
    CHECK(registers.DecodedBy(profile).mode == row.mode);
  }
}

TEST_CASE("Universal Robots with the program that copies finer values") {
  const robot::RobotProfile profile = Shipped("universal-robots-fine.toml");
  Registers registers;
  registers.Words(kHolding, 140, {1250, -105, 0, 1500, 4});
  registers.Words(kHolding, 150, {0xFFE8, 0x0830, 0x0017, 0xF7D0});  // -1.570768, 1.570768
  registers.Words(kHolding, 258, {7});
  registers.Words(kHolding, 400, {5000, 0, 0, 0, 0, 0});
  const model::RobotState state = registers.DecodedBy(profile);
  CheckJoints(state, {-1.570768, 1.570768, 0, 0, 0, 0}, 1e-12);
  CHECK(state.q_resolution == Approx(1e-6));
  CHECK(state.payload_kg == Approx(12.5));
  CHECK(state.payload_cog_F->isApprox(Vec3(-0.0105, 0, 0.15)));
  CHECK(state.tool_number == 4);
  CHECK(state.mode == model::RobotMode::kRunning);
  CHECK(profile.sequence);
  CHECK(profile.push->first == 200);
}

TEST_CASE("Techman") {
  const robot::RobotProfile profile = Shipped("techman.toml");
  Registers registers;
  registers.Floats(kInput, 7001, {400.5F, -100.25F, 300, 0, 0, 90});
  registers.Floats(kInput, 7013, {-90, 45.5F, 0, 0.001F, 179.5F, -270});
  registers.Floats(kInput, 7025, {1, 2, 3, 4, 5, 6});
  const model::RobotState state = registers.DecodedBy(profile);
  CheckJoints(state, {-90 * kRad, 45.5 * kRad, 0, 0.001 * kRad, 179.5 * kRad, -270 * kRad}, 1e-9);
  CHECK(state.q_resolution == 0);
  CHECK(state.tcp_is_flange);
  CHECK(state.X_BT->p.isApprox(Vec3(0.4005, -0.10025, 0.3)));
  CHECK(state.X_BT->R.isApprox(Turn(90 * kRad, Vec3::UnitZ())));
  CHECK(state.mode == model::RobotMode::kUnknown);
}

TEST_CASE("UFACTORY xArm") {
  const robot::RobotProfile profile = Shipped("xarm.toml");
  Registers registers;
  registers.Words(kInput, 64, {3000, -1234, 55, 1800, -300, 450});
  registers.Words(kInput, 73, {2750, 100, -20, 455, 0, 0, 1720, 0, 900, 0});
  registers.Words(kInput, 89, {-1800, 0, 455, 1, -1, 900, 3599});
  registers.Words(kInput, 96, {30, 32, 34, 36, 38, 40, 42});
  model::RobotState state = registers.DecodedBy(profile);
  CheckJoints(state,
              {-180 * kRad, 0, 45.5 * kRad, 0.1 * kRad, -0.1 * kRad, 90 * kRad, 359.9 * kRad},
              1e-12);
  CHECK(state.q_resolution == Approx(0.1 * kRad));
  CHECK(state.X_BT->p.isApprox(Vec3(0.3, -0.1234, 0.0055)));
  CHECK(state.X_BT->R.isApprox(Turn(45 * kRad, Vec3::UnitZ()) * Turn(-30 * kRad, Vec3::UnitY()) *
                               Turn(180 * kRad, Vec3::UnitX())));
  CHECK(state.X_FT->p.isApprox(Vec3(0, 0, 0.172)));
  CHECK(state.X_FT->R.isApprox(Turn(90 * kRad, Vec3::UnitY())));
  CHECK(state.payload_kg == Approx(2.75));
  CHECK(state.payload_cog_F->isApprox(Vec3(0.01, -0.002, 0.0455)));
  CHECK(state.temp_C == Approx(36));
  CHECK(state.mode == model::RobotMode::kRunning);
  registers.Word(kInput, 32, 22);
  CHECK(registers.DecodedBy(profile).mode == model::RobotMode::kUnknown);
}

TEST_CASE("Doosan") {
  const robot::RobotProfile profile = Shipped("doosan.toml");
  Registers registers;
  registers.Words(kHolding, 260, {1, 0, 0, 0, 0});
  registers.Words(kHolding, 270, {-900, 0, 1234, 0, 5, -3600});
  registers.Words(kHolding, 300, {40, 40, 40, 40, 40, 46});
  registers.Words(kHolding, 400, {7000, -20, 4500, 300, 900, -450});
  registers.Words(kHolding, 420, {0, 0, 1000, 0, 0, 0});
  const model::RobotState state = registers.DecodedBy(profile);
  CheckJoints(state, {-90 * kRad, 0, 123.4 * kRad, 0, 0.5 * kRad, -360 * kRad}, 1e-12);
  CHECK(state.X_BT->p.isApprox(Vec3(0.7, -0.002, 0.45)));
  CHECK(state.X_BT->R.isApprox(Turn(30 * kRad, Vec3::UnitZ()) * Turn(90 * kRad, Vec3::UnitY()) *
                               Turn(-45 * kRad, Vec3::UnitZ())));
  CHECK(state.X_FT->p.isApprox(Vec3(0, 0, 0.1)));
  CHECK(state.temp_C == Approx(41));
  CHECK(state.mode == model::RobotMode::kRunning);
}

TEST_CASE("the generic map") {
  const robot::RobotProfile profile = Shipped("generic.toml");
  Registers registers;
  registers.Floats(kHolding, 0, {0.5F, -0.25F, 3, -3, 0, 6.5F});
  registers.Floats(kHolding, 16, {1.5F, -0.5F, 2, 0, 0.25F, 0, 80, 0, 0.125F, 0.25F, 21.5F});
  registers.Words(kHolding, 38, {2, 77, 3, 6});
  const model::RobotState state = registers.DecodedBy(profile);
  CheckJoints(state, {0.5, -0.25, 3, -3, 0, 6.5}, 0);
  CHECK(state.q_resolution == 0);
  CHECK(state.X_BT->p == Vec3(1.5, -0.5, 2));
  CHECK(state.X_BT->R.isApprox(Turn(0.25, Vec3::UnitY())));
  CHECK(state.payload_kg == 80.0);
  CHECK(*state.payload_cog_F == Vec3(0, 0.125, 0.25));
  CHECK(state.temp_C == 21.5);
  CHECK(state.tool_number == 3);
  CHECK(state.mode == model::RobotMode::kRunning);
}

TEST_CASE("every shipped profile has a source and slots large enough for a pushed pose") {
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator("config/profiles")) {
    if (entry.path().extension() != ".toml") continue;
    ++count;
    INFO(entry.path());
    const robot::RobotProfile profile = Shipped(entry.path().filename());
    CHECK_FALSE(profile.source.empty());
    REQUIRE(profile.push);
    CHECK(robot::IsConsistent(*profile.push));
  }
  CHECK(count == 6);
}

namespace {

const std::string kSmall = R"(schema = 1
name = "small"
source = "none"
[[read]]
table = "holding"
first = 10
count = 20
[[joints]]
table = "holding"
address = [10, 12]
type = "int32"
unit = "urad"
)";

const std::string kPush = R"([push]
first = 100
slots = 2
stride = 8
pose_place = 1
sequence_place = 7
type = "int16"
position_step_mm = 0.1
angle_step_mrad = 1.0
convention = "abc"
)";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  REQUIRE(at != std::string::npos);
  return text.replace(at, from.size(), to);
}

std::string FaultsIn(const std::string& text) {
  FaultList faults;
  const auto profile = RobotProfileFromText(text, "p.toml", faults);
  CHECK(profile.has_value() != faults.HasFaults());
  return FaultsText(faults);
}

}  // namespace

TEST_CASE("several [[joints]] are concatenated, each in its own units") {
  FaultList faults;
  const auto profile = RobotProfileFromText(Replaced(kSmall, "[[joints]]", R"([[joints]]
table = "holding"
address = [20]
type = "uint16"
scale = 0.1
offset = -5
unit = "mm"
[[joints]])"),
                                            "p.toml", faults);
  INFO(FaultsText(faults));
  REQUIRE(profile);
  Registers registers;
  registers.Word(kHolding, 20, 12345);
  registers.Words(kHolding, 10, {0, 1000, -1, -1});
  const model::RobotState state = registers.DecodedBy(*profile);
  CheckJoints(state, {1.2295, 1e-3, -1e-6}, 1e-12);
}

TEST_CASE("each fault of a profile is reported with its line, key and remedy") {
  REQUIRE(FaultsIn(kSmall + kPush).empty());
  struct Row {
    const char* from;
    const char* to;
    const char* fault;
  };
  const Row rows[] = {
      {"schema = 1", "schema = 2", "p.toml:1 schema: 2 is outside 1..1"},
      {"name = \"small\"\n", "", "name: missing"},
      {"source = \"none\"\n", "", "source: missing"},
      {"source", "sauce", "p.toml:3 sauce: unknown key; did you mean \"source\"?"},
      {"first = 10", "first = -1", "p.toml:6 read[1].first: -1 is outside 0..65535"},
      {"count = 20", "count = 126", "p.toml:7 read[1].count: 126 is outside 1..125"},
      {"first = 10", "first = 65530", "ends beyond register 65535"},
      {"table = \"holding\"", "table = \"inputs\"",
       "p.toml:5 read[1].table: \"inputs\" is not one"},
      {"[[joints]]", "[[axes]]", "joints: missing"},
      {"[10, 12]", "[]", "p.toml:10 joints[1].address: [] is an empty list"},
      {"[10, 12]", "[10, 29]", "registers 29..30, which no [[read]]"},
      {"[10, 12]", "[9, 12]", "registers 9..10, which no [[read]]"},
      {"[10, 12]", "[10, 65536]", "65536 is outside 0..65535"},
      {"[10, 12]", "10", "is not a list of integers"},
      {"\"int32\"", "\"int64\"", "p.toml:11 joints[1].type: \"int64\" is not one of"},
      {"type = \"int32\"\n", "", "joints[1].type: missing"},
      {"\"urad\"", "\"grad\"", "p.toml:12 joints[1].unit: \"grad\" is not one of"},
      {"unit = \"urad\"", "unit = \"urad\"\nscale = 0",
       "scale: 0 must not be 0: every reading would be the same"},
      {"unit = \"urad\"", "unit = \"urad\"\nscale = nan", "scale: nan is not a finite number"},
      {"unit = \"urad\"", "unit = \"urad\"\nword_order = \"AB\"", "word_order: \"AB\" is not one"},
      {"unit = \"urad\"", "unit = \"urad\"\nwrap = \"2pi\"", "wrap: \"2pi\" is not one of"},
      {"unit = \"urad\"", "unit = \"urad\"\nwrap = \"revolutions\"", "revolutions: missing"},
      {"unit = \"urad\"", "unit = \"urad\"\nwrap = \"revolutions\"\nrevolutions = [15]",
       "is not a list of 2 registers"},
      {"name", "unit_id = 250\nname", "unit_id: 250 is not 0..247 or 255"},
      {"name", "port = 0\nname", "port: 0 is outside 1..65535"},
      {"[push]", "[tool_number]\ntable=\"holding\"\naddress=[10]\ntype=\"float32\"\n[push]",
       "tool_number.type: \"float32\" is not one of"},
      {"[push]",
       "[payload_cog]\ntable=\"holding\"\naddress=[10]\ntype=\"int16\"\nunit=\"m\"\n[push]",
       "payload_cog.address: [10] is not a list of 3 registers"},
      {"[push]", "[tcp]\nname = 1\n[push]", "tcp.position: missing"},
      {"[push]", "[[mode.bit]]\ntable=\"coil\"\naddress=3\nmode=\"running\"\n[push]",
       "register 3, which no [[read]]"},
      {"stride = 8", "stride = 7", "push: pose (6 registers), id and sequence overlap"},
      {"sequence_place = 7", "sequence_place = 2", "overlap or do not fit"},
      {"slots = 2", "slots = 65", "push.slots: 65 is outside 1..64"},
      {"position_step_mm = 0.1", "position_step_mm = 0", "position_step_mm: 0 is outside"},
      {"\"abc\"", "\"zyz\"", "push.convention: \"zyz\" is not one of"},
      {"schema = 1", "schema = ", "the value is missing"},
  };
  for (const Row& row : rows) {
    INFO(row.to);
    CHECK_THAT(FaultsIn(Replaced(kSmall + kPush, row.from, row.to)), Catch::Contains(row.fault));
  }
}

TEST_CASE("all faults are reported at once, ordered by line") {
  std::string text = Replaced(kSmall + kPush, "count = 20", "count = 0");
  text = Replaced(text, "\"urad\"", "\"arcmin\"");
  text = Replaced(text, "slots = 2", "slots = 0");
  const std::string faults = FaultsIn(text);
  const auto count = faults.find("count");
  const auto unit = faults.find("arcmin");
  const auto slots = faults.find("push.slots");
  REQUIRE(slots != std::string::npos);
  CHECK(count < unit);
  CHECK(unit < slots);
}

TEST_CASE("a file that is not there is a fault") {
  FaultList faults;
  CHECK_FALSE(ReadRequiredFile("config/profiles/none.toml", faults));
  CHECK_THAT(FaultsText(faults), Catch::Contains("config/profiles/none.toml"));
}

}  // namespace plumbline::robot_profile_reader_test
