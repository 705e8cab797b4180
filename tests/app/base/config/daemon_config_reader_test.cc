#include "app/base/config/daemon_config_reader.h"

#include <catch2/catch.hpp>
#include <map>

#include "app/base/config/cell_reader.h"
#include "app/base/config/daemon_settings.h"
#include "app/base/config/toml_reader.h"
#include "drivers/files/text_file.h"
#include "tests/app/base/config/wrong_line.h"
#include "tests/file_text.h"

namespace plumbline::daemon_config_reader_test {

using namespace plumbline::config;

namespace {

const std::string kCell = R"(schema = 1
[robot]
name = "two joints"
convention = "dh"
gravity_m_s2 = [0, 0, -9.8]
base_xyz_mm = [1000.0, 0.0, 0.0]
[[robot.joint]]
a_mm = 500
alpha_deg = 0
d_mm = 0
min_deg = -90
max_deg = 90
[[robot.joint]]
type = "prismatic"
a_mm = 0
alpha_deg = 0
d_mm = 0
[tool]
model = "rigid"
tcp_mm = [0, 0, 100]
[payload]
cog_mm = [0, 0, 50]
)";

const std::string kProfile = R"(schema = 1
name = "test"
source = "this test"
port = 1502
unit_id = 7
[[read]]
table = "holding"
first = 0
count = 20
[[joints]]
table = "holding"
address = [0, 1]
type = "int16"
unit = "mrad"
[payload_mass]
table = "holding"
address = [4]
type = "int16"
unit = "g"
[push]
first = 300
slots = 1
stride = 8
pose_place = 1
sequence_place = 7
type = "int16"
position_step_mm = 0.1
angle_step_mrad = 1.0
convention = "rotation_vector"
)";

const std::string kGood = R"(
cell = "cell.toml"
state_directory = "state"
[robot]
profile = "profile.toml"
transport = "tcp"
host = "10.0.0.2"
port = 503
unit_id = 9
device = "/dev/ttyS0"
baud = 9600
parity = "N"
stop_bits = 2
replay_file = "run.csv"
replay_rows_per_s = 25.0
replay_loop = false
timeout_ms = 50
stale_after_ms = 80
[payload]
source = "fixed"
mass_kg = 5.0
cog_mm = [1.0, 2.0, 3.0]
[[payload.tool]]
number = 3
mass_kg = 1.5
cog_mm = [0.0, 0.0, 4.0]
[[payload.tool]]
number = 4
mass_kg = 2.5
[plc]
listen = "127.0.0.1"
port = 1503
unit_id = 2
word_order = "CDAB"
orientation = "a_b_c"
max_clients = 8
allow = ["10.0.0.9", "::1"]
[plc.rtu]
device = "/dev/ttyS1"
baud = 38400
parity = "O"
stop_bits = 1
[correction]
max_translation_mm = 20.0
max_rotation_deg = 1.0
min_singular_value = 0.05
deflection_sd = 0.2
[push]
enabled = true
point_ids = [7]
max_step_mm = 2.0
min_period_ms = 200
[cycle]
period_ms = 20
[[frame]]
name = "fixture"
xyz_mm = [0.0, 2000.0, 0.0]
rpy_deg = [0.0, 0.0, 90.0]
[[point]]
id = 7
name = "bracket"
frame = "fixture"
xyz_mm = [100.0, 0.0, 0.0]
rpy_deg = [0.0, 0.0, 0.0]
tool_point_mm = [0.0, 0.0, 10.0]
near_deg = [45.0, 250.0]
orientation = "free"
payload_kg = 12.0
[[point]]
id = 8
frame = "base"
xyz_mm = [1.0, 0.0, 0.0]
)";

using FileMap = std::map<std::string, std::string>;

std::optional<DaemonConfig> ReadWith(const FileMap& files, const std::string& text,
                                     FaultList& faults) {
  const FileSource source = [&files](const std::string& path) -> Result<std::string> {
    const auto found = files.find(path);
    if (found == files.end()) return Error{"No such file or directory"};
    return found->second;
  };
  return DaemonConfigFromText(text, "cell/plumbline.toml", source, "/share", faults);
}

const FileMap kFiles = {{"cell/cell.toml", kCell}, {"cell/profile.toml", kProfile}};

bool Reads(const std::string& text, FaultList& faults) {
  return ReadWith(kFiles, text, faults).has_value();
}

TEST_CASE("Every value of a configuration is read and converted to SI") {
  FaultList faults;
  const auto config = ReadWith(kFiles, kGood, faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(config);
  CHECK(Texts(faults, Fault::Severity::kFault).empty());
  CHECK(config->file == "cell/plumbline.toml");
  CHECK(config->cell_file == "cell/cell.toml");
  CHECK(config->machine.cell.robot.name == "two joints");
  CHECK(config->state_directory == "cell/state");

  const robot::RobotConnection& robot = config->robot.connection;
  CHECK(robot.profile.name == "test");
  CHECK(config->robot.transport == "tcp");
  CHECK(robot.tcp.host == "10.0.0.2");
  CHECK(robot.tcp.port == 503);
  CHECK(robot.unit_id == 9);
  CHECK(robot.serial.device == "/dev/ttyS0");
  CHECK(robot.serial.baud == 9600);
  CHECK(robot.serial.parity == 'N');
  CHECK(robot.serial.stop_bits == 2);
  CHECK(robot.replay.rows_per_s == 25);
  CHECK_FALSE(robot.replay.loop);
  CHECK(robot.timeout_s == Approx(0.05));
  CHECK(config->machine.plausibility.stale_after_s == Approx(0.08));

  const PayloadPolicy& payload = config->machine.payload;
  CHECK(payload.source == PayloadPolicy::Source::kFixed);
  CHECK(payload.fixed.mass_kg == 5.0);
  CHECK(payload.fixed.cog_F->isApprox(Vec3(0.001, 0.002, 0.003)));
  REQUIRE(payload.table.size() == 2);
  CHECK(payload.table[0].number == 3);
  CHECK(payload.table[0].mass_kg == 1.5);
  CHECK(payload.table[0].cog_F->z() == Approx(0.004));
  CHECK_FALSE(payload.table[1].cog_F);

  const PlcConfig& plc = config->plc;
  CHECK(plc.tcp.address == "127.0.0.1");
  CHECK(plc.tcp.port == 1503);
  CHECK(plc.tcp.unit_id == 2);
  CHECK(plc.convention.little_word_first);
  CHECK(plc.convention.orientation == OrientationConvention::kAbc);
  CHECK(plc.tcp.max_clients == 8);
  CHECK(plc.tcp.allow == std::vector<std::string>{"10.0.0.9", "::1"});
  REQUIRE(plc.rtu);
  CHECK(plc.rtu->device == "/dev/ttyS1");
  CHECK(plc.rtu->baud == 38400);
  CHECK(plc.rtu->parity == 'O');
  CHECK(plc.rtu->unit_id == 2);

  CHECK(config->machine.limits.max_translation_m == Approx(0.02));
  CHECK(config->machine.limits.max_rotation_rad == Approx(kRadPerDeg));
  CHECK(config->machine.limits.min_singular_value == 0.05);
  CHECK(config->machine.limits.deviation.share == 0.2);
  CHECK(config->machine.limits.deviation.stated);
  CHECK(config->robot.connection.push.enabled);
  CHECK(config->push_ids == std::vector<int>{7});
  CHECK(config->robot.connection.push.max_step_m == Approx(0.002));
  CHECK(config->robot.connection.push.min_period_s == Approx(0.2));
  CHECK(config->cycle_period_s == Approx(0.02));

  REQUIRE(config->machine.points.size() == 2);
  const correction::AssemblyPoint& point = config->machine.points[0];
  CHECK(point.id == 7);
  CHECK(point.name == "bracket");
  CHECK(point.X_WP.p.isApprox(Vec3(0, 2.1, 0)));
  CHECK(point.X_WP.R.isApprox(RotationFromRollPitchYaw(Vec3(0, 0, 90 * kRadPerDeg))));
  CHECK(point.p_TP.z() == Approx(0.01));
  CHECK(point.orientation_free);
  CHECK((*point.near_q)[0] == Approx(45 * kRadPerDeg));
  CHECK((*point.near_q)[1] == Approx(0.25));
  CHECK(point.payload_kg == 12.0);
  CHECK(config->machine.points[1].X_WP.p.isApprox(Vec3(1.001, 0, 0)));
  CHECK_FALSE(config->machine.points[1].orientation_free);
}

/// A configuration over RTDE of a six-joint arm, with further lines in [robot] and at the end.
std::optional<DaemonConfig> ReadRtde(const std::string& robot, const std::string& more,
                                     FaultList& faults) {
  const FileMap files = {{"cell/cell.toml", test::FileText("config/cells/ur10.toml")}};
  return ReadWith(files,
                  "cell = \"cell.toml\"\n[robot]\ntransport = \"rtde\"\nhost = \"10.0.0.2\"\n" +
                      robot +
                      "[plc]\nlisten = \"127.0.0.1\"\n[[point]]\nid = 7\nxyz_mm = [800.0, 0.0, "
                      "300.0]\nrpy_deg = [180.0, 0.0, 0.0]\n" +
                      more,
                  faults);
}

TEST_CASE("RTDE needs no profile, has a port of its own, and every value is read") {
  FaultList faults;
  const auto config = ReadRtde(
      "rtde_hz = 500\nrtde_fields = [\"payload\"]\nrtde_tool_register = 30\nrtde_first_int = "
      "1\nrtde_first_double = 2\n",
      "[push]\nenabled = true\npoint_ids = [7]\n[payload]\nsource = \"robot\"\n", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(config);
  const robot::RobotConnection& link = config->robot.connection;
  CHECK(link.tcp == robot::TcpAddress{"10.0.0.2", 30004});
  CHECK(link.rtde.frequency_hz == 500);
  CHECK(link.rtde.fields == std::vector<std::string>{"payload"});
  CHECK(link.rtde.tool_number_register == 30);
  CHECK(link.rtde.push == robot::rtde::PushRegisters{1, 2});
  CHECK(link.pushed_points == 1);
}

TEST_CASE("what RTDE cannot give is a fault of the configuration") {
  const auto fault_of = [](const std::string& robot, const std::string& more) {
    FaultList faults;
    CHECK_FALSE(ReadRtde(robot, more, faults));
    return FaultsText(faults);
  };
  using Catch::Contains;
  CHECK_THAT(fault_of("rtde_fields = [\"payloads\"]\n", ""),
             Contains("contains \"payloads\", which is not one of actual_TCP_pose"));
  CHECK_THAT(fault_of("rtde_hz = 1000\n", ""), Contains("is outside 1..500"));
  CHECK_THAT(fault_of("rtde_fields = []\n", "[payload]\nsource = \"robot\"\n"),
             Contains("RTDE reads no payload mass"));
  CHECK_THAT(fault_of("",
                      "[payload]\nsource = \"table\"\n[[payload.tool]]\nnumber = 1\nmass_kg = "
                      "1.0\n"),
             Contains("requires a tool number, which RTDE does not read"));
  CHECK_THAT(fault_of("rtde_first_double = 43\n", "[push]\nenabled = true\npoint_ids = [7]\n"),
             Contains("requires free registers from rtde_first_int and rtde_first_double to 47"));
}

TEST_CASE("Each faulty field of a configuration gives exactly one message") {
  const std::vector<WrongLine> cases = {
      {"cell = \"cell.toml\"", "", "@1 cell: missing; expected a string in quotes"},
      {"state_directory = \"state\"", "state_directory = \"\"", "state_directory: \"\" is empty"},
      {"state_directory = \"state\"", "statedirectory = \"state\"",
       "statedirectory: unknown key; did you mean \"state_directory\"?"},
      // robot
      {"profile = \"profile.toml\"", "profile = \"no.toml\"",
       "robot.profile: \"no.toml\" cannot be read (cell/no.toml: No such file or directory; "
       "/share/no.toml: No such file or directory); check the name, or copy the file there"},
      {"profile = \"profile.toml\"", "", "@4 robot.profile: missing; expected a string in quotes"},
      {"transport = \"tcp\"", "transport = \"udp\"",
       "robot.transport: \"udp\" is not one of \"tcp\", \"rtu\", \"rtde\", \"replay\""},
      {"host = \"10.0.0.2\"", "", "@4 robot.host: missing; expected a string in quotes"},
      {"host = \"10.0.0.2\"", "host = \"10.0.0.256\"",
       "robot.host: \"10.0.0.256\" is not a host name or IP address"},
      {"host = \"10.0.0.2\"", "host = \"robot 1\"",
       "robot.host: \"robot 1\" is not a host name or IP address"},
      {"port = 503", "port = 0", "robot.port: 0 is outside 1..65535"},
      {"port = 503", "port = 70000", "robot.port: 70000 is outside 1..65535"},
      {"port = 503", "port = \"503\"", "robot.port: \"503\" is not an integer"},
      {"unit_id = 9", "unit_id = 256", "robot.unit_id: 256 is outside 0..255"},
      {"unit_id = 9", "unit_id = 248", "robot.unit_id: 248 is not 0..247 or 255"},
      {"unit_id = 9", "unit_id = 254", "robot.unit_id: 254 is not 0..247 or 255"},
      {"transport = \"tcp\"\nhost = \"10.0.0.2\"\nport = 503\nunit_id = 9",
       "transport = \"rtu\"\nhost = \"10.0.0.2\"\nport = 503\nunit_id = 255",
       "@9 robot.unit_id: 255 is outside 0..247, the ids of a serial line"},
      {"device = \"/dev/ttyS0\"", "device = \"COM1\"",
       "robot.device: \"COM1\" is not an absolute path such as /dev/ttyUSB0"},
      {"baud = 9600", "baud = 9700",
       "robot.baud: 9700 is not a standard baud rate (9600, 19200, 38400, 57600, 115200, ...)"},
      {"parity = \"N\"", "parity = \"none\"",
       "robot.parity: \"none\" is not one of \"N\", \"E\", \"O\""},
      {"stop_bits = 2", "stop_bits = 3", "robot.stop_bits: 3 is outside 1..2"},
      {"replay_file = \"run.csv\"", "replay_file = 7",
       "robot.replay_file: 7 is not a string in quotes"},
      {"replay_rows_per_s = 25.0", "replay_rows_per_s = 0",
       "robot.replay_rows_per_s: 0 is outside 0.001..1000"},
      {"replay_rows_per_s = 25.0", "replay_rows_per_s = 1001",
       "robot.replay_rows_per_s: 1001 is outside 0.001..1000"},
      {"replay_rows_per_s = 25.0", "replay_rows_per_s = nan",
       "robot.replay_rows_per_s: nan is not a finite number"},
      {"replay_rows_per_s = 25.0", "replay_rows_per_second = 25",
       "robot.replay_rows_per_second: unknown key; did you mean \"replay_rows_per_s\"?"},
      {"replay_loop = false", "replay_loop = 0", "robot.replay_loop: 0 is not true or false"},
      {"timeout_ms = 50", "timeout_ms = 1", "robot.timeout_ms: 1 is outside 5..10000"},
      {"stale_after_ms = 80", "stale_after_ms = 15",
       "robot.stale_after_ms: 15 is less than the cycle time of 20 ms: robot data would always be "
       "stale"},
      {"stale_after_ms = 80", "stale_after_s = 0.08",
       "robot.stale_after_s: unknown key; did you mean \"stale_after_ms\"?"},
      // payload
      {"source = \"fixed\"", "source = \"scale\"",
       "payload.source: \"scale\" is not one of \"robot\", \"table\", \"fixed\""},
      {"source = \"fixed\"", "source = \"table\"",
       "payload.source: \"table\" requires a tool number, which the profile test does not read"},
      {"mass_kg = 5.0", "", "@19 payload.mass_kg: missing; expected a number, 0..5000"},
      {"mass_kg = 5.0", "mass_kg = -5.0", "payload.mass_kg: -5 is outside 0..5000"},
      {"cog_mm = [1.0, 2.0, 3.0]", "cog_mm = [1.0, 2.0]",
       "payload.cog_mm: [1, 2] is not a list of 3 numbers"},
      {"number = 4", "number = 3", "payload.tool[2].number: 3 is used for two tools"},
      {"number = 4", "number = -1", "payload.tool[2].number: -1 is outside 0..65535"},
      {"mass_kg = 2.5", "", "@27 payload.tool[2].mass_kg: missing; expected a number, 0..5000"},
      // plc
      {"listen = \"127.0.0.1\"", "listen = \"localhost\"",
       "plc.listen: \"localhost\" is not an IP address; write one such as 192.168.0.10, or 0.0.0.0 "
       "for all networks"},
      {"port = 1503", "port = -1", "plc.port: -1 is outside 0..65535"},
      {"unit_id = 2", "unit_id = 0", "plc.unit_id: 0 is outside 1..247"},
      {"word_order = \"CDAB\"", "word_order = \"DCBA\"",
       "plc.word_order: \"DCBA\" is not one of \"ABCD\", \"CDAB\""},
      {"orientation = \"a_b_c\"", "orientation = \"abc\"",
       "plc.orientation: \"abc\" is not one of \"rotation_vector\", \"roll_pitch_yaw\", \"a_b_c\", "
       "\"quaternion\""},
      {"max_clients = 8", "max_clients = 0", "plc.max_clients: 0 is outside 1..256"},
      {"allow = [\"10.0.0.9\", \"::1\"]", "allow = [\"10.0.0\"]",
       "plc.allow: [\"10.0.0\"] contains \"10.0.0\", which is not an IP address"},
      {"device = \"/dev/ttyS1\"", "", "@38 plc.rtu.device: missing; expected a string in quotes"},
      {"baud = 38400", "baud = 100", "plc.rtu.baud: 100 is outside 1200..115200"},
      {"baud = 38400", "baud = 230400", "plc.rtu.baud: 230400 is outside 1200..115200"},
      {"parity = \"O\"", "parity = 1", "plc.rtu.parity: 1 is not one of \"N\", \"E\", \"O\""},
      {"stop_bits = 1", "stop_bits = 0", "plc.rtu.stop_bits: 0 is outside 1..2"},
      // correction, push, cycle
      {"max_translation_mm = 20.0", "max_translation_mm = 0",
       "correction.max_translation_mm: 0 is outside 0.01..1000"},
      {"max_rotation_deg = 1.0", "max_rotation_deg = 180",
       "correction.max_rotation_deg: 180 is outside 0.001..90"},
      {"min_singular_value = 0.05", "min_singular_value = 2",
       "correction.min_singular_value: 2 is outside 0..1"},
      {"deflection_sd = 0.2", "deflection_sd = 10", "correction.deflection_sd: 10 is outside 0..1"},
      {"enabled = true", "enabled = \"yes\"", "push.enabled: \"yes\" is not true or false"},
      {"point_ids = [7]", "",
       "@48 push.point_ids: missing; expected the ids of the points to push"},
      {"point_ids = [7]", "point_ids = [9]",
       "push.point_ids: [9] contains 9, which is not the id of any [[point]]"},
      {"point_ids = [7]", "point_ids = [7, 8]",
       "push.point_ids: [7, 8] has 2 ids; the profile test has 1 slots"},
      {"point_ids = [7]", "point_ids = [0]", "push.point_ids[1]: 0 is outside 1..65535"},
      {"max_step_mm = 2.0", "max_step_mm = 200", "push.max_step_mm: 200 is outside 0.001..100"},
      {"min_period_ms = 200", "min_period_ms = 1", "push.min_period_ms: 1 is outside 10..60000"},
      {"period_ms = 20", "period_ms = 0", "cycle.period_ms: 0 is outside 1..1000"},
      {"period_ms = 20", "periode_ms = 20",
       "cycle.periode_ms: unknown key; did you mean \"period_ms\"?"},
      // frames, points
      {"xyz_mm = [0.0, 2000.0, 0.0]", "",
       "@55 frame[1].xyz_mm: missing; expected 3 numbers, -100000..100000"},
      {"xyz_mm = [0.0, 2000.0, 0.0]", "xyz_mm = [0.0, 2000.0, nan]",
       "frame[1].xyz_mm[3]: nan is not a finite number"},
      {"rpy_deg = [0.0, 0.0, 90.0]", "rpy_deg = [0.0, 0.0, 900.0]",
       "frame[1].rpy_deg[3]: 900 is outside -360..360"},
      {"id = 8", "id = 7", "point[2].id: 7 is used for two points"},
      {"id = 8", "id = 70000", "point[2].id: 70000 is outside 1..65535"},
      {"id = 8", "", "@69 point[2].id: missing; expected an integer, 1..65535"},
      {"frame = \"base\"", "frame = \"fixtur\"",
       "point[2].frame: \"fixtur\" is not a declared frame; declared are base, fixture, "
       "measurement"},
      {"xyz_mm = [1.0, 0.0, 0.0]", "",
       "@69 point[2].xyz_mm: missing; expected 3 numbers, -100000..100000"},
      {"tool_point_mm = [0.0, 0.0, 10.0]", "tool_point_mm = [0.0, 0.0, 10000.0]",
       "point[1].tool_point_mm[3]: 10000 is outside -5000..5000"},
      {"near_deg = [45.0, 250.0]", "near_deg = [45.0]",
       "point[1].near_deg: [45] has 1 values; the cell has 2 joints"},
      {"near_deg = [45.0, 250.0]", "near_deg = [91.0, 250.0]",
       "point[1].near_deg: [91, 250] has joint 1 outside its limits -90..90"},
      {"orientation = \"free\"", "orientation = \"any\"",
       "point[1].orientation: \"any\" is not one of \"fixed\", \"free\""},
      {"payload_kg = 12.0", "payload_kg = -12.0", "point[1].payload_kg: -12 is outside 0..5000"},
  };
  ExpectOneFaultEach(kGood, "cell/plumbline.toml", cases, Reads);
}

TEST_CASE("Frames fitted for a session move points only if these are in the instrument's frame") {
  FileMap files = kFiles;
  const std::string sessions =
      "[[session]]\nid = \"1\"\nbase_xyz_mm = [5.0, 5.0, 5.0]\n"
      "[[session]]\nid = \"2\"\nbase_xyz_mm = [1003.0, -2.0, 0.0]\ntip_mm = [0, 0.5, 101]\n";
  Vec3 expected_W(1, 0, 0);
  SECTION("by default the base is the declared one") {
    files["cell/cell.toml"] += sessions;
  }
  SECTION("also with an unaligned instrument") {
    files["cell/cell.toml"] +=
        "[measurement]\nkind = \"position\"\nframe = \"unaligned\"\n" + sessions;
  }
  SECTION("points in the instrument's frame: the base of the last session") {
    files["cell/cell.toml"] +=
        "[measurement]\nkind = \"position\"\nframe = \"unaligned\"\npoints = \"instrument\"\n" +
        sessions;
    expected_W = Vec3(1.003, -0.002, 0);
  }
  FaultList faults;
  const auto config = ReadWith(files, kGood, faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(config);
  CHECK(config->machine.cell.robot.X_WB.p.isApprox(expected_W));
  CHECK(config->machine.cell.tool.tcp_F.isApprox(Vec3(0, 0, 0.1)));
  CHECK(config->machine.points[1].X_WP.p.isApprox(expected_W + Vec3(1e-3, 0, 0)));  // in the base
}

TEST_CASE("A frame must not have the name of another or of a built-in frame") {
  for (const char* name : {"base", "measurement", "fixture"}) {
    int line = 0;
    const std::string text = WithLine(kGood, "rpy_deg = [0.0, 0.0, 90.0]",
                                      "rpy_deg = [0.0, 0.0, 90.0]\n[[frame]]\nname = \"" +
                                          std::string(name) + "\"\nxyz_mm = [0, 0, 0]",
                                      line);
    FaultList faults;
    CHECK_FALSE(Reads(text, faults));
    CHECK(Texts(faults, Fault::Severity::kFault) ==
          std::vector<std::string>{
              fmt::format("cell/plumbline.toml:{} frame[2].name: \"{}\" is used for two frames "
                          "(\"measurement\" and \"base\" are built in)",
                          line + 2, name)});
  }
}

TEST_CASE("The faults of all three files are reported in one list") {
  FileMap files = kFiles;
  files["cell/cell.toml"].replace(kCell.find("a_mm = 500"), 10, "a_mm = nan");
  files["cell/profile.toml"].replace(kProfile.find("mrad"), 4, "foot");
  int line = 0;
  FaultList faults;
  CHECK_FALSE(ReadWith(files, WithLine(kGood, "port = 503", "port = 0", line), faults));
  const auto texts = Texts(faults, Fault::Severity::kFault);
  REQUIRE(texts.size() >= 3);
  CHECK(texts[0] == "cell/plumbline.toml:8 robot.port: 0 is outside 1..65535");
  CHECK(texts[1] == "cell/cell.toml:8 robot.joint[1].a_mm: nan is not a finite number");
  CHECK(texts[2].rfind("cell/profile.toml:14 ", 0) == 0);
}

TEST_CASE("A bare file name is resolved beside the configuration, then in the data directory") {
  FileMap files;
  files["cell/cells/arm.toml"] = kCell;
  files["/share/profiles/test.toml"] = kProfile;
  FaultList faults;
  const auto config = ReadWith(
      files, "cell = \"arm\"\n[robot]\nprofile = \"test\"\nhost = \"robot-1.local\"\n", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(config);
  CHECK(config->cell_file == "cell/cells/arm.toml");
  CHECK(config->robot.connection.tcp.port == 1502);  // the profile's
  CHECK(config->robot.connection.unit_id == 7);
  CHECK(config->state_directory == "/var/lib/plumbline");
  CHECK(Texts(faults, Fault::Severity::kWarning) ==
        std::vector<std::string>{
            "cell/plumbline.toml:1 point: warning: missing; no assembly point will be corrected"});
}

TEST_CASE("A point without near_deg causes a warning") {
  FaultList faults;
  REQUIRE(Reads(kGood, faults));
  const auto warnings = Texts(faults, Fault::Severity::kWarning);
  CAPTURE(FaultsText(faults));
  REQUIRE(warnings.size() == 3);  // the first point has one
  CHECK_THAT(warnings[0], Catch::Contains("point[1].xyz_mm: warning: ") &&
                              Catch::Contains("has no corrected point with 12 kg (out of reach)"));
  CHECK(warnings[1].rfind("cell/plumbline.toml:69 point[2].near_deg: warning: missing; ", 0) == 0);
  CHECK_THAT(warnings[2], Catch::Contains("point[2].xyz_mm: warning: [1, 0, 0] looks like metres"));
}

TEST_CASE("A cell in place of the configuration is recognised") {
  FaultList faults;
  CHECK_FALSE(Reads(kCell, faults));
  CHECK(FaultsText(faults) ==
        "cell/plumbline.toml:7: is recognised as a model of a cell (cell.toml) ([[robot.joint]]), "
        "but "
        "the daemon's configuration (plumbline.toml) is read here. Give the plumbline.toml that "
        "names it.\n");
}

TEST_CASE("Each transport requires its own keys") {
  auto fault = [](const std::string& robot) {
    FaultList faults;
    ReadWith(kFiles, "cell = \"cell.toml\"\n[robot]\nprofile = \"profile.toml\"\n" + robot, faults);
    const auto texts = Texts(faults, Fault::Severity::kFault);
    return texts.empty() ? "" : texts[0];
  };
  CHECK(fault("transport = \"rtu\"\n") ==
        "cell/plumbline.toml:2 robot.device: missing; expected a string in quotes");
  CHECK(fault("transport = \"rtu\"\ndevice = \"/dev/ttyS0\"\n").empty());
  CHECK(fault("transport = \"replay\"\n") ==
        "cell/plumbline.toml:2 robot.replay_file: missing; expected a string in quotes");
  CHECK(fault("transport = \"replay\"\nreplay_file = \"none.csv\"\n") ==
        "cell/plumbline.toml:5 robot.replay_file: \"none.csv\" cannot be read (cell/none.csv: No "
        "such file or directory; /share/none.csv: No such file or directory); check the name, or "
        "copy the file there");
}

TEST_CASE("corrections inside the motion need a control cycle that reports often enough") {
  const std::string motion =
      "[motion]\nenabled = true\nonly_taught_targets = true\nrobot = \"192.168.1.10\"\n"
      "timeout_ms = 120\n";
  const auto faults = [&](const std::string& period_ms) {
    FaultList found;
    ReadWith(kFiles,
             "cell = \"cell.toml\"\n[robot]\nprofile = \"profile.toml\"\nhost = \"r\"\n"
             "[cycle]\nperiod_ms = " +
                 period_ms + "\n" + motion,
             found);
    std::string all;
    for (const std::string& text : Texts(found, Fault::Severity::kFault)) all += text + "\n";
    return all;
  };
  CHECK(faults("101").find("cycle.period_ms: 101 must be at most 100") != std::string::npos);
  CHECK(faults("100").find("cycle.period_ms") == std::string::npos);
}

TEST_CASE("PLC server and page cannot share a port of the same address") {
  auto fault = [](const std::string& plc, const std::string& page) {
    FaultList faults;
    ReadWith(kFiles,
             "cell = \"cell.toml\"\n[robot]\nprofile = \"profile.toml\"\nhost = \"r\"\n"
             "[plc]\nport = 8080\nlisten = \"" +
                 plc + "\"\n[page]\nport = 8080\ntoken = \"0123456789abcdef\"\nlisten = \"" + page +
                 "\"\n",
             faults);
    const auto texts = Texts(faults, Fault::Severity::kFault);
    return texts.empty() ? "" : texts[0];
  };
  CHECK(fault("0.0.0.0", "127.0.0.1") ==
        "cell/plumbline.toml:9 page.port: 8080 is the same as [plc] port, and the addresses "
        "0.0.0.0 and 127.0.0.1 overlap; give the page another port");
  CHECK_FALSE(fault("10.0.0.1", "10.0.0.1").empty());
  CHECK(fault("10.0.0.1", "127.0.0.1").empty());
}

TEST_CASE("The profile must provide what the configuration needs") {
  auto fault = [](const std::string& profile, const std::string& rest) {
    FileMap files = kFiles;
    files["cell/profile.toml"] = profile;
    FaultList faults;
    ReadWith(files,
             "cell = \"cell.toml\"\n[robot]\nprofile = \"profile.toml\"\nhost = \"r\"\n" + rest,
             faults);
    const auto texts = Texts(faults, Fault::Severity::kFault);
    return texts.empty() ? "" : texts[0];
  };
  const std::string bare = kProfile.substr(0, kProfile.find("[payload_mass]"));
  std::string one_joint = kProfile;
  one_joint.replace(one_joint.find("[0, 1]"), 6, "[0]");
  CHECK(fault(one_joint, "") ==
        "cell/plumbline.toml:3 robot.profile: \"profile.toml\" has 1 joints; the cell has 2");
  CHECK(fault(bare, "").empty());  // said as a warning only
  CHECK(fault(bare, "[payload]\nsource = \"robot\"\n") ==
        "cell/plumbline.toml:6 payload.source: \"robot\" cannot be used: the profile test reads no "
        "payload mass; use \"table\" or \"fixed\"");
  CHECK(fault(bare,
              "[push]\nenabled = true\npoint_ids = [1]\n[[point]]\nid = 1\nxyz_mm = [0, 0, "
              "0]\n") ==
        "cell/plumbline.toml:6 push.enabled: true requires a [push] table in the profile test");
}

TEST_CASE("A profile whose responses a serial line cannot tell apart is refused on it only") {
  auto fault = [](const std::string& blocks, const std::string& transport) {
    FileMap files = kFiles;
    std::string& profile = files["cell/profile.toml"];
    const std::string block = "[[read]]\ntable = \"holding\"\nfirst = 0\ncount = 20\n";
    profile.replace(profile.find(block), block.size(), blocks);
    FaultList faults;
    ReadWith(files, "cell = \"cell.toml\"\n[robot]\nprofile = \"profile.toml\"\n" + transport,
             faults);
    const auto texts = Texts(faults, Fault::Severity::kFault);
    return texts.empty() ? "" : texts[0];
  };
  const std::string rtu = "transport = \"rtu\"\ndevice = \"/dev/ttyS0\"\n";
  const std::string tcp = "host = \"r\"\n";
  const auto block = [](int first, int count) {
    return fmt::format("[[read]]\ntable = \"holding\"\nfirst = {}\ncount = {}\n", first, count);
  };
  const std::string alike = block(0, 12) + block(100, 12);
  CHECK(fault(alike, tcp).empty());
  CHECK(fault(block(0, 12) + block(100, 11), rtu).empty());
  CHECK(fault(alike, rtu) ==
        "cell/plumbline.toml:3 robot.profile: \"profile.toml\" reads 12 registers from 100 and 12 "
        "from 0: on a serial line their responses cannot be told apart, so that one may be taken "
        "for the other; read one register more or less in one of the [[read]], or use one [[read]] "
        "for both");
}

TEST_CASE("Robot data that may be older than a second cause a warning") {
  const auto warned = [](const std::string& stale_after_ms) {
    std::string text = kGood;
    const std::string key = "stale_after_ms = ";
    text.replace(text.find(key + "80"), key.size() + 2, key + stale_after_ms);
    FaultList faults;
    REQUIRE(Reads(text, faults));
    return FaultsText(faults).find("stale_after_ms") != std::string::npos;
  };
  CHECK(warned("1001"));
  CHECK_FALSE(warned("1000"));
}

TEST_CASE("A cell with several tools or payload items needs their numbers from the profile") {
  FileMap files = kFiles;
  std::string& cell = files["cell/cell.toml"];
  cell.replace(cell.find("[tool]"), 6, "[[tool]]\nnumber = 1");
  cell.insert(cell.find("[payload]"),
              "[[tool]]\nnumber = 2\nmodel = \"rigid\"\ntcp_mm = [0, 0, 50]\n");
  cell += "[[payload.item]]\nnumber = 3\nmass_kg = 1\ncog_mm = [0, 0, 9]\n";
  FaultList faults;
  CHECK_FALSE(ReadWith(files, kGood, faults));
  CHECK_THAT(FaultsText(faults),
             Catch::Contains(
                 "robot.profile: \"profile.toml\" reads no tool number, but the cell declares 2") &&
                 Catch::Contains("reads no payload item, but the cell declares 1"));
  files["cell/profile.toml"] +=
      "[tool_number]\ntable = \"holding\"\naddress = [5]\ntype = \"uint16\"\n"
      "[payload_item]\ntable = \"holding\"\naddress = [6]\ntype = \"uint16\"\n";
  FaultList none;
  const auto config = ReadWith(files, kGood, none);
  INFO(FaultsText(none));
  REQUIRE(config);
  CHECK(config->machine.cell.ToolAt(1).number == 2);
  CHECK(config->robot.connection.profile.payload_item->address == 6);

  // Payloads by tool number are declared for tools 3 and 4.
  std::string by_tool = kGood;
  by_tool.replace(by_tool.find("source = \"fixed\""), 16, "source = \"table\"");
  FaultList undeclared;
  CHECK_FALSE(ReadWith(files, by_tool, undeclared));
  CHECK_THAT(FaultsText(undeclared),
             Catch::Contains("3 is not the number of a [[tool]] of the cell"));
}

TEST_CASE("a gauge takes the settings of its line from its format, unless they are given") {
  const std::string cell =
      "schema = 2\n[[artefact]]\nname = \"dial\"\nkind = \"gauge\"\n[[artefact]]\nname = "
      "\"ball\"\nkind = \"point\"\n[[artefact]]\nname = \"other\"\nkind = \"gauge\"\n";
  FaultList of_cell;
  TomlDocument cell_document(cell, "cell.toml", of_cell);
  model::CellModel model;
  model.artefacts = ArtefactsFromToml(cell_document.Root());
  REQUIRE(model.artefacts.size() == 3);
  FaultList faults;
  const auto read = [&](const std::string& text) {
    faults = {};
    TomlDocument document(text, "plumbline.toml", faults);
    return GaugesFromToml(document.Root(), &model);
  };
  const auto gauges = read(
      "[[gauge]]\nartefact = \"dial\"\ndevice = \"/dev/a\"\nformat = \"sylvac\"\nunit = "
      "\"inch\"\nsigma_mm = 0.002\n[[gauge]]\nartefact = \"other\"\ndevice = \"/dev/b\"\nbaud = "
      "1200\nparity = \"O\"\n");
  CHECK(FaultsText(faults).empty());
  REQUIRE(gauges.size() == 2);
  CHECK(os::SerialSettingsText(gauges[0].connection.line) == "4800 7E2");
  CHECK(gauges[0].connection.unit == gauge::GaugeUnit::kInch);
  CHECK(*gauges[0].sigma_m == Approx(2e-6));
  CHECK(gauges[1].connection.format->name == "mitutoyo");
  CHECK(os::SerialSettingsText(gauges[1].connection.line) == "1200 8O1");
  CHECK_FALSE(gauges[1].sigma_m);

  const auto fault = [&](const std::string& table) {
    read(table);
    return FaultsText(faults);
  };
  CHECK(fault("[[gauge]]\nartefact = \"dail\"\ndevice = \"/dev/a\"\n") ==
        "plumbline.toml:2 gauge[1].artefact: \"dail\" is not an [[artefact]] of the cell; did you "
        "mean dial?\n");
  CHECK(fault("[[gauge]]\nartefact = \"ball\"\ndevice = \"/dev/a\"\n")
            .find("is not of kind \"gauge\" in the cell") != std::string::npos);
  CHECK(fault("[[gauge]]\nartefact = \"dial\"\ndevice = \"/dev/a\"\nbaud = 9700\n")
            .find("baud 9700 is not one of 1200, 2400") != std::string::npos);
  CHECK(fault("[[gauge]]\nartefact = \"dial\"\ndevice = \"/dev/a\"\n[[gauge]]\nartefact = "
              "\"other\"\ndevice = \"/dev/a\"\n")
            .find("is used for two gauges") != std::string::npos);
  CHECK(fault("[[gauge]]\nartefact = \"dial\"\n").find("device: is missing") != std::string::npos);
}

TEST_CASE("a HID gauge is named by its USB ids, and types plain numbers unless configured") {
  FaultList faults;
  const auto read = [&](const std::string& keys) {
    faults = {};
    TomlDocument document(keys, "plumbline.toml", faults);
    return GaugesFromToml(document.Root(), nullptr);
  };
  const std::string dial = "[[gauge]]\nartefact = \"dial\"\nkind = \"hid\"\n";
  const auto gauges = read(dial + "usb_id = \"0fe7:4001\"\nserial = \"A1\"\n");
  REQUIRE(gauges.size() == 1);
  CHECK(gauges[0].connection.kind == gauge::GaugeKind::kHid);
  CHECK(gauges[0].connection.hid == hid::HidName{0x0FE7, 0x4001, "A1"});
  CHECK(gauges[0].connection.format->name == "plain");
  const auto fault = [&](const std::string& keys) {
    read(keys);
    return FaultsText(faults);
  };
  CHECK_THAT(fault(dial), Catch::Contains("usb_id: is missing; lsusb shows it"));
  CHECK_THAT(fault(dial + "usb_id = \"4001\"\n"), Catch::Contains("is not of the form 0fe7:4001"));
  CHECK_THAT(fault(dial + "usb_id = \"0fe7:4001\"\nbaud = 9600\n"),
             Catch::Contains("is for kind = \"serial\" only: remove it"));
  CHECK_THAT(fault(dial + "usb_id = \"0fe7:4001\"\n[[gauge]]\nartefact = \"other\"\nkind = "
                          "\"hid\"\nusb_id = \"0FE7:4001\"\n"),
             Catch::Contains("is used for two gauges; distinguish them by `serial`"));
}

TEST_CASE("The shipped plumbline.toml is valid, and its commented lines show the defaults") {
  const auto text = files::ReadTextFile("config/plumbline.toml");
  REQUIRE(text);
  FaultList faults;
  const auto shipped = DaemonConfigFromText(*text, "config/plumbline.toml", files::ReadTextFile,
                                            "/nonexistent", faults);
  CAPTURE(FaultsText(faults));
  REQUIRE(shipped);
  const DaemonConfig defaults;

  // Uncomment `# key = value` in the tables whose defaults do not depend on the other files.
  std::string open;
  std::string_view rest = *text;
  bool of_gauge = false;  // the shipped cell has no gauge
  while (!rest.empty()) {
    const std::size_t end = rest.find('\n');
    std::string line(rest.substr(0, end));
    rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
    const bool assignment = line.rfind("# ", 0) == 0 && line.find(" = ") != std::string::npos &&
                            line.find(' ', 2) == line.find(" = ");
    CHECK_FALSE(line.starts_with("# ["));  // a key below it would be read in another table
    if (line.starts_with("[")) of_gauge = line.starts_with("[[gauge]]");
    const bool skip = of_gauge || line.find("unit_id") != std::string::npos ||
                      line.find("replay_file =") != std::string::npos ||
                      line.find("near_deg") != std::string::npos;
    if (assignment && !skip) line.erase(0, 2);
    open += line + "\n";
  }
  FaultList open_faults;
  const auto config = DaemonConfigFromText(open, "config/plumbline.toml", files::ReadTextFile,
                                           "/nonexistent", open_faults);
  CAPTURE(FaultsText(open_faults), open);
  REQUIRE(config);
  // One value of each kind; the documents take the defaults from the structs.
  CHECK(config->robot.connection.timeout_s == Approx(defaults.robot.connection.timeout_s));
  CHECK(config->robot.connection.serial.parity == defaults.robot.connection.serial.parity);
  CHECK(config->plc.tcp.max_clients == defaults.plc.tcp.max_clients);
  CHECK(config->plc.convention.orientation == defaults.plc.convention.orientation);
  CHECK(config->machine.limits.max_rotation_rad ==
        Approx(defaults.machine.limits.max_rotation_rad));
  CHECK(config->monitoring.journal_bytes == defaults.monitoring.journal_bytes);
  REQUIRE(config->vision.cameras.size() == 1);
  CHECK(config->vision.board.board.family == BoardConfig{}.board.family);
  const lens::ZoomSupervisorSettings& zoom = config->vision.cameras[0].zoom.supervision;
  CHECK(zoom.settle_s == Approx(lens::ZoomSupervisorSettings{}.settle_s));
  CHECK(zoom.lost_after_s == Approx(lens::ZoomSupervisorSettings{}.lost_after_s));
  CHECK(zoom.zoom_band_counts == lens::ZoomSupervisorSettings{}.zoom_band_counts);
  CHECK(config->vision.cameras[0].zoom.period_s == Approx(zoom::kZoomPeriod_s));
  CHECK(config->overlay.background == defaults.overlay.background);
  REQUIRE(config->mqtt);
  CHECK(config->mqtt->port == MqttConfig{}.port);
  CHECK(config->state_directory == defaults.state_directory);
}

}  // namespace
}  // namespace plumbline::daemon_config_reader_test
