#include "app/plant/commands/job_progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <iostream>

#include "app/base/text/text.h"
#include "app/plant/commands/plant_commands.h"
#include "app/plant/jobs/cell_work.h"
#include "drivers/clock.h"
#include "drivers/files/text_file.h"

namespace plumbline::plant {
namespace {

constexpr double kPeriod_s = 0.5;
constexpr double kUntaken_s = 10;  ///< after which a missing worker is mentioned

}  // namespace

int FailCommand(std::string_view reason) {
  std::cerr << reason << '\n';
  return kExitFault;
}

bool WriteCommandOutput(const std::string& path, std::string_view text, std::string_view option) {
  if (path == "-") {
    std::cout << text << std::flush;
    return static_cast<bool>(std::cout);
  }
  const auto written = files::WriteTextFile(path, text);
  if (written) return true;
  std::cerr << fmt::format("{}: cannot be written: {}; choose another {}\n", path, written.error(),
                           option);
  return false;
}

void AddUtcOption(CLI::App& command, const char* name, std::string& value, const char* help) {
  const auto completed = [](std::string& text) {
    constexpr std::size_t kDate = 10;
    const std::string time = text.size() == kDate ? text + "T00:00:00Z" : text;
    if (!text::UtcFromText(time)) {
      return text +
             " is neither a date such as 2026-11-21 nor a UTC time such as "
             "2026-11-21T07:30:00Z";
    }
    text = time;
    return std::string();
  };
  command.add_option(name, value, help)->transform(CLI::Validator(completed, "", "UTC"));
}

void PrintLeftOut(const std::vector<std::string>& left_out) {
  for (const std::string& one : left_out) std::cerr << "left out: " << one << '\n';
}

Result<void> AwaitJobs(Connection& connection, const std::vector<std::int64_t>& jobs,
                       const std::string& what) {
  const double start_s = MonotonicSeconds();
  std::string shown;
  bool hinted = false;
  for (;;) {
    const auto progress = ReadProgress(connection, jobs);
    if (!progress) {
      return Error{fmt::format(
          "the plant's database does not answer: {}. The jobs continue; the same command finds "
          "their results",
          progress.error())};
    }
    const std::string text =
        fmt::format("{}: {} of {} done, {} failed, {} running", what, progress->finished,
                    jobs.size(), progress->failed, progress->running);
    if (text != shown) std::cerr << text << '\n';
    shown = text;
    if (progress->Ended()) return {};
    if (!hinted && progress->running == 0 && MonotonicSeconds() - start_s > kUntaken_s) {
      hinted = true;
      std::cerr << "no worker takes these jobs; start one, on any machine, with `plumbline plant "
                   "worker`, and --program for each version to be compared\n";
    }
    SleepSeconds(kPeriod_s);
  }
}

}  // namespace plumbline::plant
