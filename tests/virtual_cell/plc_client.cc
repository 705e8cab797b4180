// plumbline-plc-client: visits assembly points uncorrected and corrected, prints both landings.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <exception>
#include <fstream>

#include "tests/virtual_cell/assembly_client.h"

namespace {

using namespace virtual_cell;  // NOLINT: a program of its own

void WriteOut(const std::string& path, const std::vector<Landing>& landings, double require_mm) {
  std::ofstream file(path);
  file << (path.ends_with(".csv") ? LandingCsv(landings) : LandingJson(landings, require_mm));
  if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Visits assembly points uncorrected and corrected. Exit code 0: every corrected error is "
      "below --require-mm; 1: not so; 2: the cell or the daemon did not answer.");
  AssemblyClientOptions options;
  std::string program_file, profile = "ur", out;
  std::vector<int> ids;
  double require_mm = 1.0;
  app.add_option("--robot", options.robot, "HOST:PORT of the robot controller")->required();
  app.add_option("--tracker", options.tracker, "HOST:PORT of the laser tracker")->required();
  app.add_option("--daemon", options.daemon, "HOST:PORT of plumblined")->required();
  app.add_option("--program", program_file, "file with the wanted points")->required();
  app.add_option("--robot-profile", profile)->check(CLI::IsMember({"ur", "generic"}));
  app.add_option("--unit", options.unit, "Modbus unit id");
  app.add_option("--point", ids, "ids to visit; all that the daemon knows where left out");
  app.add_option("--samples", options.samples, "tracker readings averaged")
      ->check(CLI::PositiveNumber);
  app.add_option("--settle-s", options.settle_s)->check(CLI::NonNegativeNumber);
  app.add_option("--timeout-s", options.patience_s)->check(CLI::PositiveNumber);
  app.add_option("--require-mm", require_mm, "largest corrected error")->check(CLI::PositiveNumber);
  app.add_option("--out", out, "result as .json or .csv");
  CLI11_PARSE(app, argc, argv);
  options.profile = profile == "ur" ? Profile::kUr : Profile::kGeneric;
  try {
    const MotionProgram program = ReadProgramFile(program_file);
    AssemblyClient client(options, program);
    client.AttachPayload();
    std::vector<Landing> landings;
    for (const TaughtPoint& point : program.points) {
      const bool asked = std::find(ids.begin(), ids.end(), point.id) != ids.end();
      if (ids.empty() ? client.HasPoint(point.id) : asked) landings.push_back(client.Visit(point));
    }
    client.ReleasePayload();
    if (landings.empty()) throw std::runtime_error("no point of the program was visited");
    fmt::print("{}", LandingTable(landings));
    if (!out.empty()) WriteOut(out, landings, require_mm);
    const bool passed = std::all_of(landings.begin(), landings.end(), [&](const Landing& landing) {
      return landing.CorrectedError() < require_mm;
    });
    fmt::print("Every corrected error is {} {} mm.\n", passed ? "below" : "NOT below", require_mm);
    return passed ? 0 : 1;
  } catch (const std::exception& error) {
    fmt::print(stderr, "plumbline-plc-client: {}\n", error.what());
    return 2;
  }
}
