#include <catch2/catch.hpp>
#include <string>

#include "app/base/config/daemon_settings.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::motion_reader_test {

using namespace plumbline::config;

namespace {

constexpr const char* kGood = R"(enabled = true
robot = "192.168.1.10"
timeout_ms = 120
)";

struct Read {
  motion_link::MotionSettings settings;
  std::string faults;
};

Read ReadMotion(const std::string& keys, const model::CellModel* cell = nullptr,
                bool targets_corrected = false) {
  FaultList faults;
  TomlDocument document("[motion]\n" + keys, "plumbline.toml", faults);
  Read read;
  read.settings = MotionFromToml(*document.Root().Table("motion"), cell, targets_corrected);
  for (const Fault& fault : faults.All()) read.faults += FaultText(fault) + "\n";
  return read;
}

std::string FaultsWith(const std::string& keys) {
  return ReadMotion(kGood + keys + "\n").faults;
}

}  // namespace

TEST_CASE("without settings there is no motion link, and its defaults are safe") {
  const Read read = ReadMotion("enabled = false");
  CHECK(read.faults.empty());
  CHECK_FALSE(read.settings.enabled);
  const Read good = ReadMotion(kGood);
  CHECK(good.faults.empty());
  CHECK(good.settings.port == 59152);
  CHECK(good.settings.limits.timeout_s == Approx(0.12));
  CHECK(FaultOf(good.settings.limits) == motion_offset::LimitsFault::kNone);
  CHECK(good.settings.rules.weakest_basis == model::RadiusBasis::kMeasured);
  CHECK_FALSE(good.settings.rules.rotates);
  CHECK(good.settings.rules.frame == motion_offset::OffsetFrame::kBase);
}

TEST_CASE("EGM has its own port and frame") {
  const Read read = ReadMotion(kGood + std::string("kind = \"egm\"\ncycle_ms = 48\n"));
  CHECK(read.faults.empty());
  CHECK(read.settings.kind == "egm");
  CHECK(read.settings.port == 6510);
  CHECK(read.settings.rules.frame == motion_offset::OffsetFrame::kTool);
}

TEST_CASE("settings that are not safe, or that an interface does not have, are refused in words") {
  const std::pair<const char*, const char*> cases[] = {
      {"rate_mm_per_s = 10", "max_jump_mm: is less than 1.32"},
      {"holds_last = false", "max_jump_mm: is less than max_offset_mm = 2"},
      {"cycle_ms = 12.0\nmax_lost_packets = 51", "max_lost_packets: 51 is outside 0..50"},
      {"max_rotation_deg = 2", "max_jump_deg: is less than 0.132"},
      {"max_rotation_deg = 2\nmax_offset_mm = 0.4\nholds_last = false",
       "max_jump_deg: is less than max_rotation_deg = 2"},
      {"max_offset_mm = 20", "rate_mm_per_s: lets the way back to 0 take 20 s"},
      {"kind = \"egm\"", "cycle_ms: missing"},
      {"mode = \"relative\"", "mode: \"relative\" adds each answer"},
      {"kind = \"egm_guidance\"", "kind: \"egm_guidance\" replaces the robot program"},
      {"kind = \"egm\"\nframe = \"base\"", "frame: \"base\" is not offered by EGM"},
      {"kind = \"egm\"\nmax_rotation_deg = 1", "max_rotation_deg: 1 must be 0 with EGM"},
      {"listen = \"eth0\"", "listen: \"eth0\" is not an IPv4 address"},
      {"joints_tag = \"<A>\"", "joints_tag: \"<A>\" must have 1..32 letters"},
  };
  for (const auto& [keys, fault] : cases) {
    CAPTURE(keys);
    CHECK(FaultsWith(keys).find(fault) != std::string::npos);
    INFO(FaultsWith(keys));
  }
  CHECK(ReadMotion("enabled = true\n").faults.find("robot: missing") != std::string::npos);
  CHECK(ReadMotion("enabled = true\n").faults.find("timeout_ms: missing") != std::string::npos);
  CHECK(ReadMotion("enabled = true\nrobot = \"kuka\"\ntimeout_ms = 40\n")
            .faults.find("robot: \"kuka\" is not an IPv4 address") != std::string::npos);
}

TEST_CASE("beside corrected targets the motion is corrected only if that is acknowledged") {
  const std::string fault = "only_taught_targets: must be true";
  CHECK(ReadMotion(kGood, nullptr, true).faults.find(fault) != std::string::npos);
  CHECK(ReadMotion(kGood + std::string("only_taught_targets = true\n"), nullptr, true)
            .faults.empty());
  CHECK(ReadMotion("enabled = false", nullptr, true).faults.empty());
}

TEST_CASE("the offset of an arm with a prismatic joint is refused") {
  model::CellModel cell;
  cell.robot.joints.resize(6);
  CHECK(ReadMotion(kGood, &cell).faults.empty());
  cell.robot.joints[2].type = model::JointType::kPrismatic;
  CHECK(ReadMotion(kGood, &cell).faults.find("prismatic") != std::string::npos);
}

}  // namespace plumbline::motion_reader_test
