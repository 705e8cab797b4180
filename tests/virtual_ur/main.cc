// plumbline-virtual-ur: simulates a Universal Robots controller with a loaded arm, over RTDE.
#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <exception>
#include <fstream>
#include <sstream>

#include "tests/virtual_ur/script.h"
#include "tests/virtual_ur/virtual_ur.h"

namespace {

using namespace virtual_ur;  // NOLINT: a program of its own

volatile std::sig_atomic_t g_stop = 0;

struct Ended {};

/// A console line with an optional delay: "@5 close" is a fault after five seconds.
struct TimedLine {
  double at_s;
  std::string line;
};
TimedLine TimedLineFromText(const std::string& text) {
  if (text.empty() || text[0] != '@') return {0, "fault " + text};
  const std::size_t space = text.find(' ');
  return {std::stod(text.substr(1, space - 1)), "fault " + text.substr(space + 1)};
}

bool ConsoleReady() {
  fd_set readable;
  FD_ZERO(&readable);
  FD_SET(STDIN_FILENO, &readable);
  timeval now{0, 0};
  return ::select(STDIN_FILENO + 1, &readable, nullptr, nullptr, &now) == 1;
}

/// The program around the controller: console and timed faults, one call per cycle.
class Session {
 public:
  Session(VirtualUr& ur, std::vector<TimedLine> later)
      : ur_(ur), later_(std::move(later)), start_s_(MonotonicNow()) {}

  /// @throws Ended
  void Step() {
    ur_.Step();
    std::erase_if(later_, [&](const TimedLine& timed) {
      const bool due = MonotonicNow() - start_s_ >= timed.at_s;
      if (due) fmt::print("{}\n", ur_.Execute(timed.line));
      return due;
    });
    if (console_ && ConsoleReady()) console_ = ExecuteConsole();
    if (g_stop != 0 || ur_.cell().QuitRequested()) throw Ended{};
  }

 private:
  bool ExecuteConsole() {
    char buffer[512];
    const ssize_t got = ::read(STDIN_FILENO, buffer, sizeof buffer);
    if (got <= 0) return false;
    unread_.append(buffer, static_cast<std::size_t>(got));
    for (std::size_t end; (end = unread_.find('\n')) != std::string::npos;) {
      fmt::print("{}\n", Answer(unread_.substr(0, end)));
      unread_.erase(0, end + 1);
    }
    std::fflush(stdout);
    return true;
  }

  /// "registers": the input registers that a client may write; else a line of the robot.
  std::string Answer(const std::string& line) {
    if (line != "registers") return ur_.Execute(line);
    std::string text;
    for (std::size_t k = 24; k < 48; ++k)
      text += fmt::format("{} ", ur_.rtde().state().input_int[k]);
    for (std::size_t k = 24; k < 48; ++k)
      text += fmt::format("{:.9f} ", ur_.rtde().state().input_double[k]);
    return text;
  }

  VirtualUr& ur_;
  std::vector<TimedLine> later_;
  double start_s_;
  bool console_ = true;
  std::string unread_;
};

void WritePorts(VirtualUr& ur, const std::string& file) {
  const std::string unfinished = file + ".tmp";
  std::ofstream(unfinished) << fmt::format("robot {}\ntracker {}\nrtde {}\n",
                                           ur.cell().robot_port(), ur.cell().tracker_port(),
                                           ur.rtde().port());
  if (std::rename(unfinished.c_str(), file.c_str()) != 0)
    throw std::runtime_error(file + ": the ports cannot be written there");
}

std::string TextOf(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file + " cannot be read");
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

void Run(VirtualUr& ur, const std::vector<TimedLine>& later, const std::string& script_file) {
  fmt::print("RTDE on 127.0.0.1:{}\n", ur.rtde().port());
  std::fflush(stdout);
  Session session(ur, later);
  try {
    if (script_file.empty()) {
      while (true) session.Step();
    }
    Script script(TextOf(script_file), ur.rtde().state());
    script.RunThread("plumbline_watch", [&session] { session.Step(); });
  } catch (const Ended&) {
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Simulates a Universal Robots controller with a loaded arm, over RTDE");
  app.footer(
      "Lines on standard input are executed: those of plumbline-virtual-cell, `fault WORDS`, and "
      "`registers`, which prints the input registers 24..47.");
  virtual_cell::VirtualCellOptions options;
  std::string cell_file, program = "builtin", port_file, script;
  int rtde_port = 0;
  std::vector<std::string> effect_texts, fault_texts;
  app.add_option("--cell", cell_file, "cell file of the world")->required();
  app.add_option("--program", program, "program file, or builtin");
  app.add_option("--hold-at", options.hold_at, "hold at this point, then execute commands");
  app.add_flag("--idle", options.idle, "no program: only execute commands");
  app.add_option("--address", options.address, "address to listen on");
  app.add_option("--rtde-port", rtde_port, "RTDE port; 0: chosen by the kernel");
  app.add_option("--port", options.port, "Modbus port, for commands");
  app.add_option("--tracker-port", options.tracker_port, "Modbus port of the tracker");
  app.add_option("--port-file", port_file, "file that receives the ports");
  app.add_option("--effect", effect_texts, "an effect that the cell file does not declare");
  app.add_option("--time-scale", options.time_scale, "simulated seconds per second");
  app.add_option("--tracker-noise-mm", options.tracker_noise_mm, "noise of the tracker");
  app.add_option("--fault", fault_texts, "a fault of the link, \"@5 WORDS\" after 5 s");
  app.add_option("--script", script, "robot program whose plumbline_watch runs");
  CLI11_PARSE(app, argc, argv);
  std::signal(SIGINT, [](int) { g_stop = 1; });
  std::signal(SIGTERM, [](int) { g_stop = 1; });
  std::signal(SIGPIPE, SIG_IGN);
  try {
    const virtual_cell::CellDescription cell = virtual_cell::ReadCellFile(cell_file);
    virtual_cell::Effects effects(virtual_cell::EffectsFromTexts(effect_texts));
    const auto motion = program == "builtin" ? virtual_cell::BuiltinProgram(cell)
                                             : virtual_cell::ReadProgramFile(program);
    VirtualUr ur(virtual_cell::World(cell, effects), motion, options, rtde_port);
    if (!port_file.empty()) WritePorts(ur, port_file);
    std::vector<TimedLine> later;
    for (const std::string& text : fault_texts) {
      const TimedLine timed = TimedLineFromText(text);
      if (timed.at_s > 0) {
        later.push_back(timed);
      } else if (const std::string answer = ur.Execute(timed.line); answer != "ok") {
        throw std::runtime_error(answer);
      }
    }
    Run(ur, later, script);
  } catch (const std::exception& fault) {
    fmt::print(stderr, "{}\n", fault.what());
    return 2;
  }
  return 0;
}
