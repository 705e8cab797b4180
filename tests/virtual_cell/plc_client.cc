// plumbline-plc-client: the PLC of the demo. Visits assembly points or measures probes.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <fstream>
#include <sstream>

#include "tests/virtual_cell/assembly_client.h"

namespace {

using namespace virtual_cell;  // NOLINT: a program of its own

struct Arguments {
  AssemblyClientOptions client;
  std::string program, profile = "ur";
  // visit
  std::vector<int> ids;
  double require_mm = 1.0;
  std::optional<double> expect_miss_mm;
  std::string before, out;
  bool require_radius = false;
  // probe
  bool with_only = false;
  std::optional<std::size_t> most;
  std::string expect;
  std::optional<double> await_proposal_s;
};

std::string TextOf(const std::string& path) {
  std::ifstream file(path);
  std::ostringstream text;
  if (!(text << file.rdbuf())) throw std::runtime_error(path + ": cannot be read");
  return text.str();
}

void WriteOut(const std::string& path, const std::vector<Landing>& landings, double require_mm) {
  std::ofstream file(path);
  file << (path.ends_with(".csv") ? LandingCsv(landings) : LandingJson(landings, require_mm));
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

/// @return true if the landings are as expected
bool Visit(const Arguments& arguments, AssemblyClient& client, const MotionProgram& program) {
  client.AttachPayload();
  std::vector<Landing> landings;
  const std::vector<int>& ids = arguments.ids;
  for (const TaughtPoint& point : program.points) {
    const bool asked = std::find(ids.begin(), ids.end(), point.id) != ids.end();
    if (ids.empty() ? client.HasPoint(point.id) : asked) landings.push_back(client.Visit(point));
  }
  client.ReleasePayload();
  if (landings.empty()) throw std::runtime_error("no point of the program was visited");
  if (!arguments.before.empty()) AddDeclared(TextOf(arguments.before), landings);
  if (!arguments.out.empty()) WriteOut(arguments.out, landings, arguments.require_mm);
  if (arguments.expect_miss_mm) {
    bool all = true;
    for (const Landing& landing : landings) {
      fmt::print("  {}: error {:.2f} mm as taught, {:.2f} mm corrected\n", landing.name,
                 landing.UncorrectedError(), landing.CorrectedError());
      all = all && landing.CorrectedError() > *arguments.expect_miss_mm;
    }
    if (!all)
      fmt::print("Expected an error above {} mm at every point.\n", *arguments.expect_miss_mm);
    return all;
  }
  fmt::print("{}", LandingTable(landings));
  const bool passed = std::all_of(landings.begin(), landings.end(), [&](const Landing& landing) {
    return landing.CorrectedError() < arguments.require_mm;
  });
  fmt::print("{}", RadiusLines(landings));
  fmt::print("Every corrected error is {} {} mm.\n", passed ? "below" : "NOT below",
             arguments.require_mm);
  if (!arguments.require_radius) return passed;
  const bool holds = RadiiHold(landings);
  if (!holds) fmt::print("Expected every landing within a radius whose basis is measured.\n");
  return passed && holds;
}

/// @return true if the alarm is as expected
bool Probe(const Arguments& arguments, AssemblyClient& client, const MotionProgram& program) {
  constexpr int kInRow = 8;
  int probes = 0, first_alarm = 0;
  for (const bool loaded : {true, false}) {
    if (!loaded && arguments.with_only) continue;
    if (loaded) client.AttachPayload();
    if (!loaded) client.ReleasePayload();
    int in_row = 0;
    const std::size_t all = program.points.size();
    for (std::size_t i = 0; i < std::min(arguments.most.value_or(all), all); ++i) {
      const char* title = in_row > 0 ? "" : loaded ? "with the module" : "without it";
      if (in_row % kInRow == 0) fmt::print("{}  {:<15}", in_row > 0 ? "\n" : "", title);
      ++in_row;
      const ProbeAnswer answer = client.Probe(program.points[i]);
      ++probes;
      const bool raised = answer.alarm && first_alarm == 0;
      if (raised) first_alarm = probes;
      fmt::print("{:>7}", fmt::format("{}{:.2f}", raised ? "!" : "", answer.residual_W_mm.norm()));
      std::fflush(stdout);
    }
    fmt::print("\n");
  }
  client.ReleasePayload();
  if (first_alarm > 0) {
    fmt::print("  ! Drift alarm raised by probe {} of {}.\n", first_alarm, probes);
  } else {
    fmt::print("  No drift alarm after {} probes.\n", probes);
  }
  if (arguments.await_proposal_s) {
    fmt::print("  Reported to the PLC: model version {} awaits approval.\n",
               client.AwaitProposal(*arguments.await_proposal_s));
  }
  return arguments.expect.empty() || (arguments.expect == "alarm") == (first_alarm > 0);
}

void AddOptions(CLI::App& app, Arguments& arguments) {
  AssemblyClientOptions& client = arguments.client;
  app.add_option("--robot", client.robot, "HOST:PORT of the robot controller")->required();
  app.add_option("--tracker", client.tracker, "HOST:PORT of the laser tracker")->required();
  app.add_option("--daemon", client.daemon, "HOST:PORT of plumblined")->required();
  app.add_option("--program", arguments.program, "program file with the target points")->required();
  app.add_option("--robot-profile", arguments.profile)->check(CLI::IsMember({"ur", "generic"}));
  app.add_option("--unit", client.unit, "Modbus unit id");
  app.add_option("--settle-s", client.settle_s)->check(CLI::NonNegativeNumber);
  app.add_option("--timeout-s", client.patience_s)->check(CLI::PositiveNumber);
}

void AddVisit(CLI::App& visit, Arguments& arguments) {
  visit.add_option("--point", arguments.ids, "ids to visit; default: all that the daemon knows");
  visit.add_option("--samples", arguments.client.samples, "number of tracker readings to average")
      ->check(CLI::PositiveNumber);
  visit.add_option("--require-mm", arguments.require_mm, "largest corrected error")
      ->check(CLI::PositiveNumber);
  visit.add_flag("--require-radius", arguments.require_radius,
                 "require every landing within its 95 % radius, and the basis measured");
  visit.add_option("--expect-miss-mm", arguments.expect_miss_mm,
                   "instead: require a larger corrected error at every point");
  visit.add_option("--before", arguments.before,
                   "earlier result with the declared model, for the table");
  visit.add_option("--out", arguments.out, "result as .json or .csv");
}

void AddProbe(CLI::App& probe, Arguments& arguments) {
  probe.add_flag("--with-only", arguments.with_only, "only with payload");
  probe.add_option("--most", arguments.most, "maximum number of points");
  probe.add_option("--expect", arguments.expect, "alarm or quiet")
      ->check(CLI::IsMember({"alarm", "quiet"}));
  probe.add_option("--await-proposal-s", arguments.await_proposal_s,
                   "wait this long for a corrected model");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "visit: moves to assembly points as taught and as corrected. probe: measures the tip with "
      "and without payload and sends probes to the daemon. Exit code 0: as expected; 1: not; 2: "
      "the cell "
      "or the daemon did not respond.");
  Arguments arguments;
  AddOptions(app, arguments);
  app.require_subcommand(1);
  app.fallthrough();
  AddVisit(*app.add_subcommand("visit", "Assembly points"), arguments);
  AddProbe(*app.add_subcommand("probe", "Probing poses"), arguments);
  CLI11_PARSE(app, argc, argv);
  arguments.client.profile = arguments.profile == "ur" ? Profile::kUr : Profile::kGeneric;
  try {
    const MotionProgram program = ReadProgramFile(arguments.program);
    AssemblyClient client(arguments.client, program);
    const auto run = app.got_subcommand("visit") ? Visit : Probe;
    return run(arguments, client, program) ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "plumbline-plc-client: {}\n", error.what());
    return 2;
  }
}
