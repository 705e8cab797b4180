// The whole daemon from socket to socket, beside a virtual cell that shares no code with it.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <set>

#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/cli/shell.h"
#include "tests/virtual_cell/assembly_client.h"
#include "tests/virtual_cell/running_cell.h"

using namespace plumbline::test;
using virtual_cell::AssemblyClient;
using virtual_cell::AssemblyClientOptions;
using virtual_cell::DemoProgram;
using virtual_cell::Eventually;
using virtual_cell::Profile;
using virtual_cell::RegisterClient;
using virtual_cell::RunningCell;
using virtual_cell::VirtualCellOptions;

namespace {

VirtualCellOptions Idle(Profile profile) {
  return {.profile = profile, .idle = true, .time_scale = 4};
}

const char* MapOf(Profile profile) {
  return profile == Profile::kUr ? "universal-robots-fine" : "generic";
}

bool Valid(RegisterClient& plc) {
  return (plc.Read(2000, 20).Word(1) & 1) != 0;
}

/// The second point's branch has been found, too, behind the cycle.
bool SecondPointValid(RegisterClient& plc) {
  return (plc.Read(2020, 20).Word(1) & 1) != 0;
}

/// A cell with the payload attached, and a daemon whose points are valid.
struct Station {
  RunningCell cell;
  DaemonProcess daemon;
  RegisterClient plc;

  explicit Station(Profile profile = Profile::kGeneric)
      : cell(Idle(profile)),
        daemon(DemoConfig(cell.robot(), MapOf(profile))),
        plc("plumblined", daemon.Plc(), 1, 10) {
    REQUIRE(cell.Tell("payload 60") == "ok");
    INFO(daemon.Log());
    REQUIRE(Eventually([&] { return Valid(plc) && plc.Read(330, 2).Float(0) == 60; }));
  }
};

}  // namespace

TEST_CASE("the loaded tip reaches its target, with both profiles") {
  for (const Profile profile : {Profile::kUr, Profile::kGeneric}) {
    Station station(profile);
    AssemblyClientOptions options;
    options.robot = station.cell.robot();
    options.tracker = station.cell.tracker();
    options.daemon = station.daemon.Plc();
    options.profile = profile;
    AssemblyClient client(options, DemoProgram());
    client.AttachPayload();
    for (const int id : {1, 2}) {
      const auto program = DemoProgram();
      const auto point = std::find_if(program.points.begin(), program.points.end(),
                                      [&](const auto& p) { return p.id == id; });
      const virtual_cell::Landing landing = client.Visit(*point);
      CAPTURE(id);
      CHECK(landing.UncorrectedError() > 5);  // mm: otherwise there is nothing to correct
      CHECK(landing.CorrectedError() < 0.1);
    }
  }
}

TEST_CASE(
    "effects missing in the model remain as error: the virtual cell is independent of the "
    "product") {
  const virtual_cell::Effects effects({virtual_cell::EffectFromText("joint_compliance:q2=2e-6")});
  RunningCell cell(Idle(Profile::kGeneric), effects);
  DaemonProcess daemon(DemoConfig(cell.robot(), "generic"));
  AssemblyClientOptions options;
  options.robot = cell.robot();
  options.tracker = cell.tracker();
  options.daemon = daemon.Plc();
  options.profile = Profile::kGeneric;
  AssemblyClient client(options, DemoProgram());
  client.AttachPayload();
  CHECK(client.Visit(DemoProgram().points.front()).CorrectedError() > 1);
}

TEST_CASE("a command is answered once, with its echo, and the result does not change") {
  Station station;
  const auto command = [&](std::vector<std::uint16_t> head, std::uint16_t sequence) {
    head.resize(40);
    head[39] = sequence;
    station.plc.Write(1000, head);
    REQUIRE(Eventually([&] { return station.plc.Read(100, 40).Word(1) == sequence; }));
    return station.plc.Read(100, 40);
  };
  REQUIRE(Eventually([&] { return SecondPointValid(station.plc); }));
  auto result = command({1, 2}, 7);
  CHECK(result.Word(0) == 7);
  CHECK(result.Word(39) == 7);
  CHECK(result.Word(2) == 0);
  REQUIRE((result.Word(3) & 1) != 0);
  CHECK(result.Word(30) == 2);
  CHECK(result.Float(4) == Approx(station.plc.Read(2020, 20).Float(3)).margin(0.01));
  const float x = result.Float(4);

  station.cell.Tell("payload 5");
  REQUIRE(Eventually([&] { return station.plc.Read(330, 2).Float(0) == 5; }));
  result = station.plc.Read(100, 40);
  CHECK(result.Float(4) == x);
  CHECK((result.Word(3) & 1) != 0);

  CHECK(command({1, 99}, 8).Word(2) == 9);  // no such point
  CHECK(command({42}, 9).Word(2) == 10);    // no such command
  CHECK(command({1, 1}, 10).Word(2) == 0);
  CHECK((command({5}, 11).Word(3) & 1) == 0);  // acknowledged
  // A small controller reads the same as scaled integers.
  const auto scaled = station.plc.Read(200, 20);
  CHECK(scaled.Word(0) == 11);
  CHECK(scaled.Word(19) == 11);
}

TEST_CASE("every link fault withdraws the points, is logged once, and recovers by itself") {
  struct Fault {
    const char* name;
    const char* begin;
    const char* end;
    const char* told;
  };
  const Fault faults[] = {
      {"a controller that stalls", "fault stall 1.5", nullptr, "robot link lost"},
      {"not a number", "fault nan on", "fault nan off", "not trusted"},
      {"the tool 10 m away", "fault jump on", "fault jump off", "not trusted"},
      {"a joint outside its limits", "fault joint 5 9.0", "fault joint off", "not trusted"},
      {"answers that come too late", "fault delay 0.4", "fault delay 0", "robot link lost"},
      {"every request refused", "fault exception on", "fault exception off", "robot link lost"},
  };
  for (const Fault& fault : faults) {
    CAPTURE(fault.name);
    Station station;
    REQUIRE(station.cell.Tell(fault.begin) == "ok");
    CHECK(Eventually([&] { return !Valid(station.plc); }));
    const auto block = station.plc.Read(2000, 20);
    CHECK(std::abs(block.Float(3)) > 100);  // the values stay
    CHECK(station.daemon.Awaits(fault.told));
    if (fault.end != nullptr) REQUIRE(station.cell.Tell(fault.end) == "ok");
    INFO(station.daemon.Log());
    CHECK(Eventually([&] { return Valid(station.plc); }));
    CHECK(station.daemon.Count(fault.told) == 1);
  }
}

TEST_CASE("untrusted readings are shown as they were read") {
  RunningCell cell(Idle(Profile::kGeneric));
  REQUIRE(cell.Tell("fault jump on") == "ok");
  DaemonProcess daemon(DemoConfig(cell.robot(), "generic"));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  CHECK(Eventually([&] { return std::abs(plc.Read(318, 2).Float(0)) > 5000; }));
  CHECK((plc.Read(300, 2).Word(0) & 1) == 0);
}

TEST_CASE("connections that are reset or half closed are re-established") {
  for (const char* fault : {"fault reset", "fault half-close"}) {
    CAPTURE(fault);
    Station station;
    REQUIRE(station.cell.Tell(fault) == "ok");
    CHECK(station.daemon.Awaits("restored"));
    CHECK(station.daemon.Count("robot link lost") == 1);
    CHECK(Eventually([&] { return Valid(station.plc); }));
  }
}

TEST_CASE("SIGHUP loads a valid configuration; a faulty one changes nothing") {
  Station station;
  const std::string good = DemoConfig(station.cell.robot(), "generic");
  station.daemon.Write(WithLine(good, "correction", "max_translation_mm", "-5.0"));
  station.daemon.Signal(SIGHUP);
  CHECK(station.daemon.Awaits("not reloaded"));
  CHECK(station.daemon.Says("correction.max_translation_mm"));
  CHECK(Valid(station.plc));

  station.daemon.Write(good +
                       "\n[[point]]\nid = 3\nname = \"third\"\nframe = \"body\"\n"
                       "xyz_mm = [400.0, 0.0, 0.0]\nrpy_deg = [0.0, 90.0, 0.0]\n");
  station.daemon.Signal(SIGHUP);
  REQUIRE(station.daemon.Awaits("reloaded"));
  CHECK(Eventually([&] {
    const auto third = station.plc.ReadIfThere(2040, 20);
    return third && third->Word(0) == 3 && (third->Word(1) & 1) != 0;
  }));
}

TEST_CASE("settings that need a restart are reported at every SIGHUP, relative to the start") {
  Station station;
  const std::string good = DemoConfig(station.cell.robot(), "generic");
  struct Change {
    const char* name;
    std::string config;
    const char* told;  ///< nullptr: no restart needed
  };
  const Change changes[] = {
      {"clients", WithLine(good, "plc", "port", "0\nmax_clients = 5"), "plc.listen, port"},
      {"the same again", WithLine(good, "plc", "port", "0\nmax_clients = 5"), "plc.listen, port"},
      {"as it was started", good, nullptr},
      {"a serial line", good + "\n[plc.rtu]\ndevice = \"/dev/ttyS9\"\n", "[plc.rtu]"},
      {"state", WithLine(good, "", "state_directory", "\"elsewhere\""), "state_directory changed"},
  };
  int reloads = 0;
  for (const Change& change : changes) {
    CAPTURE(change.name);
    const int before = station.daemon.Count("needs a restart");
    const int told = change.told != nullptr ? station.daemon.Count(change.told) : 0;
    station.daemon.Write(change.config);
    station.daemon.Signal(SIGHUP);
    ++reloads;
    REQUIRE(Eventually([&] { return station.daemon.Count("reloaded") == reloads; }));
    CHECK(station.daemon.Count("needs a restart") == before + (change.told != nullptr ? 1 : 0));
    if (change.told != nullptr) CHECK(station.daemon.Count(change.told) == told + 1);
  }
}

TEST_CASE("values and the last result survive SIGHUP, and commands continue to work") {
  Station station;
  std::vector<std::uint16_t> command(40);
  command[0] = 1;
  command[1] = 2;
  // On a busy machine a cycle of the robot's may be late and a command refused: a PLC asks again.
  std::uint16_t sequence = 6;
  REQUIRE(Eventually([&] {
    command[39] = ++sequence;
    station.plc.Write(1000, command);
    return Eventually([&] { return station.plc.Read(200, 20).Word(0) == sequence; }) &&
           (station.plc.Read(200, 20).Word(2) & 1) != 0;
  }));
  const auto scaled = station.plc.Read(200, 20);
  REQUIRE(scaled.Word(4) != 0);

  // Without the controller nothing can be computed anew: what stands then was taken over.
  REQUIRE(station.cell.Tell("fault exception on") == "ok");
  REQUIRE(Eventually([&] { return !Valid(station.plc); }));
  const auto block = station.plc.Read(2000, 20);
  station.daemon.Signal(SIGHUP);
  REQUIRE(station.daemon.Awaits("reloaded"));
  const auto scaled_after = station.plc.Read(200, 20);
  for (const int k : {0, 3, 4, 5, 6, 18, 19}) CHECK(scaled_after.Word(k) == scaled.Word(k));
  CHECK((scaled_after.Word(2) & 1) == 0);
  const auto block_after = station.plc.Read(2000, 20);
  for (const int k : {3, 5, 7}) CHECK(block_after.Float(k) == block.Float(k));
  CHECK((block_after.Word(1) & ~0x30) == 4);  // valid once; the basis of the radius apart

  REQUIRE(station.cell.Tell("fault exception off") == "ok");
  REQUIRE(Eventually([&] { return Valid(station.plc); }));
  CHECK((station.plc.Read(200, 20).Word(2) & 1) == 0);  // a withdrawn result stays withdrawn
  CHECK(Eventually([&] {
    command[39] = ++sequence;
    station.plc.Write(1000, command);
    return Eventually([&] { return station.plc.Read(200, 20).Word(0) == sequence; }) &&
           (station.plc.Read(200, 20).Word(2) & 1) != 0;
  }));
}

TEST_CASE("every thread is named, so that top -H shows which one hangs") {
  const Station station;
  const std::string tasks = "/proc/" + std::to_string(station.daemon.pid()) + "/task";
  std::set<std::string> names;
  [[maybe_unused]] std::size_t threads = 0;
  const bool found = Eventually([&] {  // the thread "branches" ends by itself
    names.clear();
    threads = 0;
    for (const auto& task : std::filesystem::directory_iterator(tasks)) {
      const std::string name = FileText(task.path() / "comm");
      names.insert(name.substr(0, name.find('\n')));
      ++threads;
    }
    return names == std::set<std::string>{"plumblined", "cycle", "monitoring", "robot", "modbus"};
  });
  CAPTURE(names);
  CHECK(found);
#ifndef PLUMBLINE_SANITIZED  // ThreadSanitizer's own thread has the program's name
  CHECK(threads == names.size());
#endif
}

TEST_CASE("interference is measured without a viewer, and follows the object table") {
  Station station;
  CHECK(station.plc.Read(640, 10).Word(0) == 0);
  CHECK(station.plc.Read(640, 10).Word(7) == 65535);  // never measured
  const std::string folder = station.daemon.folder();
  std::ofstream(folder + "/box.obj")
      << "v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 100\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
  const auto write_table = [&](double x_mm) {
    std::string table = "schema = 1\n[[pair]]\nobjects = [\"wall\", \"post\"]\n";
    const auto add = [&](const char* name, int number, double at_mm) {
      table += fmt::format(
          "[[object]]\nname = \"{}\"\nnumber = {}\nfile = \"box.obj\"\nunit = \"mm\"\n"
          "on = {{ frame = \"world\" }}\nxyz_mm = [{:.1f}, 0.0, 0.0]\n",
          name, number, at_mm);
    };
    add("wall", 3, 0);
    add("post", 17, x_mm);
    std::ofstream(folder + "/objects.toml") << table;
  };
  write_table(300);
  station.daemon.Write(DemoConfig(station.cell.robot(), "generic") + "\n[overlay]\nobjects = \"" +
                       folder + "/objects.toml\"\n");
  station.daemon.Signal(SIGHUP);
  const auto state_is = [&](int state) {
    return Eventually([&] { return station.plc.Read(640, 10).Word(0) == state; });
  };
  INFO(station.daemon.Log());
  REQUIRE(state_is(1));
  CHECK(station.plc.Read(640, 10).Word(2) == 3);
  CHECK(station.plc.Read(640, 10).Word(3) == 17);
  CHECK(station.plc.Read(640, 10).Float(4) == Approx(200));
  write_table(50);
  REQUIRE(state_is(2));
  CHECK(station.plc.Read(640, 10).Word(1) == 1);
  CHECK(station.daemon.Awaits("interference of wall and post begins"));
  // Without the table nothing is monitored, which is no loss.
  station.daemon.Write(DemoConfig(station.cell.robot(), "generic"));
  station.daemon.Signal(SIGHUP);
  CHECK(state_is(0));
  CHECK(station.plc.Read(640, 10).Word(7) == 65535);
}

TEST_CASE("SIGTERM stops it cleanly") {
  Station station;
  station.daemon.Signal(SIGTERM);
  CHECK(station.daemon.Wait() == 0);
  CHECK(station.daemon.Says("stopping on SIGTERM"));
}

TEST_CASE("a replay plays its rows at their rate, then holds the last one or repeats") {
  for (const bool loop : {false, true}) {
    CAPTURE(loop);
    const TemporaryFolder folder;
    std::ofstream(folder.path() + "/run.csv")
        << "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n"
           "1,-60,60,0,30,0\n2,-60,60,0,30,0\n3,-60,60,0,30,0\n";
    const std::string config = WithLine(
        DemoConfig("127.0.0.1:1", "generic"), "robot", "transport",
        "\"replay\"\nreplay_file = \"" + folder.path() +
            "/run.csv\"\nreplay_rows_per_s = 20\nreplay_loop = " + (loop ? "true" : "false"));
    DaemonProcess daemon(config);
    RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
    const auto q1_deg = [&] { return plc.Read(304, 2).Float(0); };
    REQUIRE(Eventually([&] { return q1_deg() == Approx(3); }));
    if (loop) {
      CHECK(Eventually([&] { return q1_deg() == Approx(1); }));
    } else {
      CHECK(Eventually([&] { return (plc.Read(300, 1).Word(0) & 1) != 0; }));
      for (int row = 0; row < 10; ++row) {
        CHECK(q1_deg() == Approx(3));
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
      }
    }
  }
}

TEST_CASE("the daemon survives the reader of its log") {
  int ends[2];
  REQUIRE(pipe2(ends, O_CLOEXEC) == 0);  // the daemon gets its copy of one end only
  DaemonProcess daemon(DemoConfig("127.0.0.1:1", "generic"), ends[1]);
  close(ends[1]);
  char first = 0;
  CHECK(read(ends[0], &first, 1) == 1);
  close(ends[0]);
  daemon.Signal(SIGHUP);  // writes to the log
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  daemon.Signal(SIGTERM);
  CHECK(daemon.Wait() == 0);
}

TEST_CASE("a log that nobody reads blocks nothing") {
  int ends[2];
  REQUIRE(pipe2(ends, O_CLOEXEC) == 0);
  DaemonProcess daemon(DemoConfig("127.0.0.1:1", "generic"), ends[1]);
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  fcntl(ends[1], F_SETFL, O_NONBLOCK);
  while (write(ends[1], "x", 1) == 1) {
  }
  fcntl(ends[1], F_SETFL, 0);

  daemon.Signal(SIGHUP);  // writes to the log
  const auto beats = [&plc] { return plc.Read(10, 1).Word(0); };
  const std::uint16_t before = beats();
  CHECK(Eventually([&] { return beats() > before + 5; }));
  daemon.Signal(SIGTERM);  // handled by the thread that writes the log
  CHECK(daemon.Wait() == 0);
  close(ends[0]);
  close(ends[1]);
}

TEST_CASE("all faults of a configuration are reported, and nothing starts") {
  std::string config = DemoConfig("127.0.0.1:1", "generic");
  config = WithLine(config, "robot", "timeout_ms", "-3");
  config = WithLine(config, "plc", "orientation", "\"upside_down\"");
  DaemonProcess daemon(config + "\nsurprise = 1\n");
  CHECK(daemon.Wait() == 1);
  CHECK(daemon.Says("robot.timeout_ms"));
  CHECK(daemon.Says("plc.orientation"));
  CHECK(daemon.Says("surprise"));
  CHECK(daemon.Says("not started"));
}

TEST_CASE("a failed start does not count; a missing serial line is logged once") {
  const std::string config =
      WithLine(DemoConfig("127.0.0.1:1", "generic"), "", "state_directory", "\"state\"") +
      "\n[plc.rtu]\ndevice = \"/dev/no-such-line\"\n";
  DaemonProcess first(config);
  RegisterClient plc("plumblined", first.Plc(), 1, 10);
  CHECK(
      first.Awaits("serial line /dev/no-such-line: cannot be opened: No such file or directory; "
                   "is the adapter plugged in"));
  CHECK(first.Count("/dev/no-such-line") == 1);
  CHECK(plc.Read(19, 1).Word(0) == 1);

  const std::string state = first.folder() + "/state";
  const std::string port = first.Plc().substr(first.Plc().find(':') + 1);
  DaemonProcess second(
      WithLine(WithLine(config, "plc", "port", port), "", "state_directory", "\"" + state + "\""));
  CHECK(second.Wait() == 2);  // the port is in use
  CHECK(second.Says("PLC server: "));
  std::ifstream count(state + "/boot_count");
  int starts = 0;
  CHECK(count >> starts);
  CHECK(starts == 1);
}

TEST_CASE("the posture of each point is in its block, in the status and in its JSON") {
  Station station;
  const auto posture = station.plc.Read(22000, 32);
  CHECK((posture.Word(24) & 3) == 3);
  CHECK(posture.Word(25) >= 1);
  CHECK(posture.Float(26) > 0);
  CHECK(posture.Float(28) > 0.02);
  CHECK(station.plc.Read(22032, 32).Word(24) != 0);

  const std::string plc = station.daemon.Plc(), port = plc.substr(plc.find(':') + 1);
  const Answer status = Shell("status --port " + port);
  const std::string q1 = fmt::format("posture {:.1f} ", posture.Float(0));
  CHECK_THAT(status.output, Catch::Contains(q1) && Catch::Contains(" from the limit of q"));
  const Answer json = Shell("status --json --port " + port);
  CHECK_THAT(json.output, Catch::Contains("\"posture_q6\": ") &&
                              Catch::Contains("\"posture_singular_value\": "));
}

TEST_CASE("a posture other than the taught one: a warning at the start, bits at run time") {
  RunningCell cell(Idle(Profile::kGeneric));
  std::string config = DemoConfig(cell.robot(), "generic");
  const std::string taught = "near_deg = [18.5, ";
  REQUIRE(config.find(taught) != std::string::npos);
  config.replace(config.find(taught), taught.size(), "near_deg = [-71.5, ");
  DaemonProcess daemon(config);
  CHECK(daemon.Awaits("q1 is -71.5 in near_deg, but "));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  REQUIRE(cell.Tell("payload 60") == "ok");
  REQUIRE(Eventually([&] { return Valid(plc); }));
  CHECK((plc.Read(2000, 20).Word(1) & 1 << 6) != 0);
  CHECK((plc.Read(2020, 20).Word(1) & 1 << 6) == 0);
  CHECK((plc.Read(22024, 1).Word(0) & 4) != 0);
  CHECK((plc.Read(22056, 1).Word(0) & 4) == 0);
  const std::string port = daemon.Plc().substr(daemon.Plc().find(':') + 1);
  CHECK_THAT(Shell("status --port " + port).output, Catch::Contains("NOT near near_deg"));
}

TEST_CASE("without a robot the daemon serves the PLC, and reports what is missing") {
  DaemonProcess daemon(DemoConfig("127.0.0.1:1", "generic"));
  RegisterClient plc("plumblined", daemon.Plc(), 1, 10);
  CHECK(daemon.Awaits("robot link not established"));
  CHECK_FALSE(Valid(plc));
  CHECK((plc.Read(12, 1).Word(0) & 1) != 0);

  const std::string port = daemon.Plc().substr(daemon.Plc().find(':') + 1);
  const Answer status = Shell("status --port " + port);
  CHECK(status.exit_code == 1);
  CHECK_THAT(status.output,
             Catch::Contains("joints       none\n") &&
                 Catch::Contains("alarms       0x0001: nothing read from the robot"));
  const Answer json = Shell("status --json --port " + port);
  CHECK_THAT(json.output, Catch::Contains("\"alarms\": 1,") && Catch::Contains("\"points\": 2,"));
}

namespace {

/// A daemon that pushes both points into the controller's slots.
struct PushingStation {
  RunningCell cell{Idle(Profile::kGeneric)};
  std::string config = WithLine(DemoConfig(cell.robot(), "generic"), "push", "enabled", "true");
  DaemonProcess daemon{config};
  RegisterClient robot{"robot", cell.robot(), 1, 10};

  PushingStation() {
    REQUIRE(cell.Tell("payload 60") == "ok");
    INFO(daemon.Log());
    REQUIRE(Eventually([&] {
      const auto slots = robot.Read(300, 16);
      return slots.Word(0) == 1 && slots.Word(7) != 0 && slots.Word(8) == 2 && slots.Word(15) != 0;
    }));
  }
  /// Neither slot is valid.
  bool Withdrawn() {
    const auto slots = robot.Read(300, 16);
    return slots.Word(7) == 0 && slots.Word(15) == 0;
  }
};

}  // namespace

TEST_CASE("a stopping daemon withdraws all pushed points") {
  PushingStation station;
  station.daemon.Signal(SIGTERM);
  CHECK(station.daemon.Wait() == 0);
  CHECK(station.Withdrawn());
  CHECK_FALSE(station.daemon.Says("may still be marked valid"));
}

TEST_CASE("a silent controller does not prevent the daemon from stopping, and that is logged") {
  PushingStation station;
  REQUIRE(station.cell.Tell("fault stall 20") == "ok");
  station.daemon.Signal(SIGTERM);
  CHECK(station.daemon.Wait() == 0);
  CHECK(station.daemon.Says("pushed points may still be marked valid in the controller"));
}

TEST_CASE("points that a new configuration no longer pushes are withdrawn") {
  PushingStation station;
  station.daemon.Write(WithLine(station.config, "push", "enabled", "false"));
  station.daemon.Signal(SIGHUP);
  REQUIRE(station.daemon.Awaits("reloaded"));
  CHECK(station.Withdrawn());
}

TEST_CASE("pushed points are in the controller's registers, and it can move there") {
  PushingStation station;
  RegisterClient& robot = station.robot;
  RegisterClient plc("plumblined", station.daemon.Plc(), 1, 10);
  REQUIRE(Eventually([&] { return Valid(plc) && plc.Read(330, 2).Float(0) == 60; }));
  // Once the corrected point has settled the slot holds it to its rounding of 0.1 mm.
  CHECK(Eventually([&] {
    const auto slot = robot.Read(300, 8);
    const auto block = plc.Read(2000, 20);
    const double x_mm = 0.1 * static_cast<std::int16_t>(slot.Word(1));
    return slot.Word(7) != 0 && std::abs(x_mm - static_cast<double>(block.Float(3))) < 0.06;
  }));
}
