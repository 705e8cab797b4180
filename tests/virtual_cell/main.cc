// plumbline-virtual-cell: simulates a robot controller with a loaded arm, over Modbus TCP.
#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <exception>
#include <fstream>
#include <sstream>

#include "tests/virtual_cell/virtual_cell.h"

namespace {

using namespace virtual_cell;  // NOLINT: a program of its own

volatile std::sig_atomic_t g_stop = 0;

double WallSeconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// "0:22,600:35" -> knots of a curve; "25" -> one knot.
std::vector<std::pair<double, double>> TemperatureFromText(const std::string& text) {
  std::vector<std::pair<double, double>> curve;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const std::size_t colon = part.find(':');
    const bool timed = colon != std::string::npos;
    curve.emplace_back(timed ? std::stod(part.substr(0, colon)) : 0.0,
                       std::stod(timed ? part.substr(colon + 1) : part));
  }
  return curve;
}

/// A console line with an optional delay: "@5 fault stall 2" runs after five seconds.
struct TimedLine {
  double at_s;
  std::string line;
};
TimedLine TimedLineFromText(const std::string& text) {
  if (text.empty() || text[0] != '@') return {0, "fault " + text};
  const std::size_t space = text.find(' ');
  return {std::stod(text.substr(1, space - 1)), "fault " + text.substr(space + 1)};
}

/// Reads stdin and executes complete lines. @return false at the end of input
bool ExecuteConsole(VirtualCell& cell, std::string& unread) {
  char buffer[512];
  const ssize_t got = ::read(STDIN_FILENO, buffer, sizeof buffer);
  if (got <= 0) return false;
  unread.append(buffer, static_cast<std::size_t>(got));
  for (std::size_t end; (end = unread.find('\n')) != std::string::npos;) {
    fmt::print("{}\n", cell.Execute(unread.substr(0, end)));
    unread.erase(0, end + 1);
  }
  std::fflush(stdout);
  return true;
}

bool ConsoleReady() {
  fd_set readable;
  FD_ZERO(&readable);
  FD_SET(STDIN_FILENO, &readable);
  timeval now{0, 0};
  return ::select(STDIN_FILENO + 1, &readable, nullptr, nullptr, &now) == 1;
}

/// Writes "robot PORT" and "tracker PORT"; replaces the file at once.
void WritePorts(const VirtualCell& cell, const std::string& file) {
  const std::string unfinished = file + ".tmp";
  std::ofstream(unfinished) << fmt::format("robot {}\ntracker {}\n", cell.robot_port(),
                                           cell.tracker_port());
  if (std::rename(unfinished.c_str(), file.c_str()) != 0) {
    throw std::runtime_error(file + ": the ports cannot be written there");
  }
}

void Run(VirtualCell& cell, std::vector<TimedLine> later, double period_s) {
  fmt::print("listening on 127.0.0.1:{}\ntracker on 127.0.0.1:{}\n", cell.robot_port(),
             cell.tracker_port());
  std::fflush(stdout);
  const double start = WallSeconds();
  bool console = true;
  std::string unread;
  while (g_stop == 0 && !cell.QuitRequested()) {
    cell.Step(WallSeconds(), period_s, console ? STDIN_FILENO : -1);
    if (console && ConsoleReady()) console = ExecuteConsole(cell, unread);
    std::erase_if(later, [&](const TimedLine& timed) {
      const bool due = WallSeconds() - start >= timed.at_s;
      if (due) cell.Execute(timed.line);
      return due;
    });
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulates a robot controller with a loaded arm, over Modbus TCP");
  app.footer(
      "Lines on standard input are executed; at the end of input the cell keeps running until "
      "SIGINT or "
      "SIGTERM.\n\nEffects, --effect NAME:key=value,..\n" +
      EffectCatalogue());
  VirtualCellOptions options;
  std::string cell_file, program = "builtin", profile = "ur", temperature, rows_file, port_file;
  std::vector<std::string> effect_texts, fault_texts, reflectors;
  app.add_option("--cell", cell_file, "cell file of the world")->required();
  app.add_option("--program", program, "program file, or builtin");
  app.add_option("--hold-at", options.hold_at, "hold at this point, then execute commands");
  app.add_flag("--idle", options.idle, "no program: only execute commands");
  app.add_option("--profile", profile,
                 "registers served: \"ur\" as profiles universal-robots and universal-robots-fine "
                 "read them, \"generic\" as profile generic does")
      ->check(CLI::IsMember({"ur", "generic"}))
      ->capture_default_str();
  app.add_option("--address", options.address, "address to listen on");
  app.add_option("--port", options.port, "Modbus port of the robot; 0: chosen by the kernel")
      ->check(CLI::Range(0, 65535));
  app.add_option("--tracker-port", options.tracker_port,
                 "Modbus port of the tracker; 0: chosen by the kernel")
      ->check(CLI::Range(0, 65535));
  app.add_option("--port-file", port_file,
                 "write \"robot PORT\" and \"tracker PORT\" into this file once they are served");
  app.add_option("--tracker-noise-mm", options.tracker_noise_mm)->check(CLI::NonNegativeNumber);
  app.add_option("--reflector", reflectors, "x,y,z of a reflector in the tip frame [mm]");
  app.add_option("--effect", effect_texts, "an effect of the world, see below");
  app.add_option("--fault", fault_texts, "a fault of the link; '@SECONDS fault..' delays it");
  app.add_option("--temperature", temperature, "in C, or a curve 0:22,600:35 (s:C)");
  app.add_option("--real-joints", rows_file, "CSV of joint rows to replay");
  app.add_option("--row-rate", options.row_rate_hz, "rows per second")->check(CLI::PositiveNumber);
  app.add_option("--time-scale", options.time_scale)->check(CLI::PositiveNumber);
  double period_ms = 4;
  app.add_option("--period-ms", period_ms, "controller cycle in ms")->check(CLI::Range(1, 100));
  app.add_option("--max-speed", options.limits.speed, "maximum joint speed [rad/s]")
      ->check(CLI::PositiveNumber);
  CLI11_PARSE(app, argc, argv);
  try {
    CellDescription cell = ReadCellFile(cell_file);
    std::vector<TimedLine> later;
    later.reserve(fault_texts.size());
    for (const std::string& text : fault_texts) later.push_back(TimedLineFromText(text));
    for (const std::string& text : reflectors) {
      Vec3 p_mm;
      char comma = 0;
      std::istringstream(text) >> p_mm.x() >> comma >> p_mm.y() >> comma >> p_mm.z();
      options.reflectors_T.emplace_back(p_mm * 1e-3);
    }
    options.profile = profile == "ur" ? Profile::kUr : Profile::kGeneric;
    options.temperature = TemperatureFromText(temperature);
    if (!rows_file.empty()) options.replay = ReadJointRows(rows_file, cell.size());
    MotionProgram motion = program == "builtin" ? BuiltinProgram(cell) : ReadProgramFile(program);
    if (motion.home.size() != cell.size()) {
      throw std::runtime_error(fmt::format("{}: home_deg has {} joints, the cell has {}", program,
                                           motion.home.size(), cell.size()));
    }
    std::signal(SIGTERM, [](int) { g_stop = 1; });
    std::signal(SIGINT, [](int) { g_stop = 1; });
    std::signal(SIGPIPE, SIG_IGN);
    VirtualCell virtual_cell(World(std::move(cell), Effects(EffectsFromTexts(effect_texts))),
                             std::move(motion), options);
    if (!port_file.empty()) WritePorts(virtual_cell, port_file);
    Run(virtual_cell, std::move(later), 1e-3 * period_ms);
  } catch (const std::exception& error) {
    fmt::print(stderr, "plumbline-virtual-cell: {}\n", error.what());
    return 1;
  }
  return 0;
}
