// Benchmark of the start-up time of the programs (--version), which is mostly the dynamic loader.
#include <fcntl.h>
#include <fmt/core.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <tuple>
#include <vector>

#include "tests/bench/rows.h"

namespace {

struct Times {
  double elapsed_ms = 0, cpu_ms = 0;
};

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return (values[(values.size() - 1) / 2] + values[values.size() / 2]) / 2;
}

double Milliseconds(const timeval& time) {
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_usec);
}

/// Starts a program once with its output discarded. Returns false if it fails.
bool Start(const std::string& program, const char* argument, Times& times) {
  posix_spawn_file_actions_t outputs;
  posix_spawn_file_actions_init(&outputs);
  for (const int output : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_addopen(&outputs, output, "/dev/null", O_WRONLY, 0);
  }
  std::string name = program, option = argument;
  char* words[] = {name.data(), argument[0] == '\0' ? nullptr : option.data(), nullptr};
  const auto began = std::chrono::steady_clock::now();
  pid_t child = 0;
  const int failed = posix_spawn(&child, program.c_str(), &outputs, nullptr, words, environ);
  posix_spawn_file_actions_destroy(&outputs);
  int status = 0;
  rusage used{};
  if (failed != 0 || wait4(child, &status, 0, &used) != child) return false;
  const std::chrono::duration<double, std::milli> elapsed =
      std::chrono::steady_clock::now() - began;
  times = {elapsed.count(), Milliseconds(used.ru_utime) + Milliseconds(used.ru_stime)};
  return WIFEXITED(status) && WEXITSTATUS(status) != 127;
}

/// Medians of so many starts, after one warm-up start that loads the files into the page cache.
bool Measure(const std::string& program, const char* argument, int runs, Times& medians) {
  std::vector<double> elapsed_ms, cpu_ms;
  for (int k = 0; k <= runs; ++k) {
    Times times;
    if (!Start(program, argument, times)) {
      fmt::print(stderr, "{} {} cannot be started\n", program, argument);
      return false;
    }
    if (k == 0) continue;
    elapsed_ms.push_back(times.elapsed_ms);
    cpu_ms.push_back(times.cpu_ms);
  }
  medians = {Median(elapsed_ms), Median(cpu_ms)};
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: start_bench PROGRAM_FOLDER [--smoke | --quick]\n");
    return 2;
  }
  const std::string folder = argv[1];
  Times peer, ours;
  const int runs = plumbline::bench::Choose(plumbline::bench::EffortFrom(argc, argv), 2, 21, 21);
  if (!Measure("/bin/true", "", runs, peer)) return 1;
  for (const auto& [program, argument, goal_ms] : {std::tuple("plumbline", "--version", 10.0),
                                                   {"plumblined", "--help", 10.0},
                                                   {"plumbline-view", "--version", 20.0},
                                                   {"plumbline-mesh", "--version", 20.0},
                                                   {"plumbline-dv", "--version", 20.0},
                                                   {"plumbline-fleet", "--version", 20.0}}) {
    if (!Measure(folder + "/" + program, argument, runs, ours)) return 1;
    fmt::print("{} {}: {:.1f} ms of CPU time\n", program, argument, ours.cpu_ms);
    plumbline::bench::Report(
        {.what = fmt::format("start of {} {}, median of {}", program, argument, runs),
         .ours = ours.elapsed_ms,
         .unit = "ms",
         .goal = plumbline::bench::AtMost(goal_ms),
         .peer = "/bin/true",
         .peers = peer.elapsed_ms});
  }
  return 0;
}
