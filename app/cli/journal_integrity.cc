#include "app/cli/journal_integrity.h"

#include <fmt/format.h>

#include <chrono>
#include <filesystem>
#include <iostream>

#include "app/base/terminal/terminal_output.h"
#include "app/base/text/json_text.h"
#include "app/cell/journal/journal.h"
#include "app/cell/journal/salvage.h"
#include "app/cli/exit_codes.h"
#include "app/cli/failure.h"

namespace plumbline::cli {
namespace {

nlohmann::json RangesJson(const std::vector<cell::RowRange>& ranges) {
  nlohmann::json list = nlohmann::json::array();
  for (const cell::RowRange& range : ranges) list.push_back({range.first, range.last});
  return list;
}

void PrintRanges(const std::vector<cell::RowRange>& ranges, const char* what) {
  if (!ranges.empty()) std::cout << RowRangesText(ranges) << ' ' << what << '\n';
}

}  // namespace

int CheckJournalFile(const std::string& file, bool json) {
  Result<cell::Journal> journal = cell::Journal::OpenForReading(file);
  if (!journal) return Fail(journal.error(), kExitFault);
  const cell::IntegrityReport report = journal.value().Check();
  const int code = report.intact() ? kExitOk : kExitFault;
  if (json) {
    std::cout << text::JsonText(nlohmann::json{{"intact", report.intact()},
                                               {"rows", report.rows},
                                               {"unchecked", report.unchecked},
                                               {"damaged", RangesJson(report.damaged)},
                                               {"missing", RangesJson(report.missing)},
                                               {"lost_earlier", RangesJson(report.lost)},
                                               {"other", report.other}},
                                1)
              << '\n';
    return code;
  }
  std::cout << terminal::ForReading << fmt::format("{}: {} rows intact", file, report.rows);
  if (report.unchecked > 0) {
    std::cout << fmt::format(", {} of them unchecked: written before rows had checksums",
                             report.unchecked);
  }
  std::cout << '\n';
  PrintRanges(report.lost, "lost earlier, as a salvage recorded");
  PrintRanges(report.damaged, "DAMAGED: changed since written, or unreadable");
  PrintRanges(report.missing, "MISSING");
  for (const std::string& one : report.other) std::cout << "DAMAGED: " << one << '\n';
  if (!report.intact()) {
    std::cout << "No probe is recorded in this file. `plumbline journal salvage` saves the intact "
                 "rows in a new journal and keeps this file; or restore the backup.\n";
  }
  return code;
}

int SalvageJournalFile(const std::string& file) {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  const Result<cell::Salvage> salvage = cell::SalvageJournal(
      file, std::chrono::duration_cast<std::chrono::milliseconds>(now).count());
  if (!salvage) return Fail(salvage.error(), kExitFault);
  std::cout << terminal::ForReading
            << fmt::format("{}: {} rows saved; the damaged file is now {}\n", file, salvage->saved,
                           salvage->damaged_file);
  PrintRanges(salvage->found.damaged, "lost: changed since written, or unreadable");
  PrintRanges(salvage->found.missing, "lost: missing");
  for (const std::string& one : salvage->found.other) std::cout << "damaged: " << one << '\n';
  for (const std::string& note : salvage->notes) std::cout << note << '\n';
  std::cout << "The new journal records which rows are lost. A running daemon uses it within a few "
               "seconds; take a new drift reference with command 8 if reference rows are lost.\n";
  return kExitOk;
}

}  // namespace plumbline::cli
