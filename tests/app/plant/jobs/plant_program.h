// plumbline-plant as a child process, and a script in place of the diagnosis.
#pragma once

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <fstream>
#include <string>
#include <vector>

#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::test {

/// A running program; killed with its owner.
class PlantProgram {
 public:
  /// @param output  receives standard output and error
  PlantProgram(std::vector<std::string> words, const std::string& output) {
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    pid_ = fork();
    if (pid_ == 0) {
      const int out = open(output.c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      dup2(out, STDOUT_FILENO);
      dup2(out, STDERR_FILENO);
      execv(arguments.front(), arguments.data());
      _exit(127);
    }
  }
  ~PlantProgram() { End(SIGKILL); }
  PlantProgram(const PlantProgram&) = delete;
  PlantProgram& operator=(const PlantProgram&) = delete;

  /// @param signal  0: waits for its end
  /// @return        exit code; -1 if killed by a signal
  int End(int signal = 0) {
    if (pid_ <= 0) return -1;
    if (signal != 0) kill(pid_, signal);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t pid_ = -1;
};

/// Answers at once, unless the file `hold` exists in its folder; crashes or refuses its input if
/// `fail` or `refuse` exists. Knows diagnose and the steps of a prior: their files state the step,
/// and how many files it was given; a diagnosis states whether it may use a prior.
class StubDiagnosis {
 public:
  explicit StubDiagnosis(const std::string& version = "stub 1",
                         const std::string& help = "--no-prior  Use no prior") {
    std::ofstream(path()) << fmt::format(
        R"sh(#!/bin/sh
if [ "$1" = --version ]; then echo '{1}'; exit 0; fi
if [ "$2" = --help ]; then echo '{2}'; exit 0; fi
echo run >> {0}/runs
while [ -e {0}/hold ]; do sleep 0.05; done
if [ -e {0}/fail ]; then echo 'it "broke"' >&2; kill -SEGV $$; fi
if [ -e {0}/refuse ]; then echo 'no use' >&2; exit 1; fi
step=$1
[ "$1" = prior ] && step=$2
files=0
prior=true
while [ $# -gt 0 ]; do
  [ -f "$1" ] && files=$((files + 1))
  [ "$1" = --no-prior ] && prior=false
  case "$1" in --json | --out | --arm-out) out=$2; [ "$1" = --arm-out ] && step=arm ;; esac
  shift
done
cat > $out <<END
{{"step": "$step", "arms": ["a", "b", "c"], "left_out": [], "files": $files, "may_use_prior": $prior, "verdict": "explained", "effects": [], "limit_kb": "$(ulimit -d)",
 "held_out": [{{"by": "rows", "after_mm": 1, "after_low_mm": 0.9, "after_high_mm": 1.1}}]}}
END
)sh",
        folder_.path(), version, help);
    chmod(path().c_str(), 0755);
  }
  std::string path() const { return folder_.path() + "/plumbline"; }
  void Set(const std::string& file) const { std::ofstream(folder_.path() + "/" + file) << "x"; }
  void Clear(const std::string& file) const { unlink((folder_.path() + "/" + file).c_str()); }
  /// How often it was started.
  std::size_t Runs() const { return FileText(folder_.path() + "/runs").size() / 4; }

 private:
  const TemporaryFolder folder_;
};

}  // namespace plumbline::test
