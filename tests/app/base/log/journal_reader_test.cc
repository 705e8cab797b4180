#include "app/base/log/journal_reader.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <sstream>

#include "tests/app/cli/shell.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::journal_reader_test {

using namespace plumbline::log;
using test::Answer;
using test::Shell;
using test::TemporaryFolder;

namespace {

/// Debian's systemd-journal-remote, which converts the export format to journal files.
constexpr const char* kJournalRemote = "/lib/systemd/systemd-journal-remote";

std::string Exported(double utc_s, const LogEntry& entry, const char* program) {
  std::ostringstream text;
  text << "__REALTIME_TIMESTAMP=" << static_cast<long long>(1e6 * utc_s) << '\n'
       << "__MONOTONIC_TIMESTAMP=" << static_cast<long long>(1e6 * (utc_s - 1.79e9)) << '\n'
       << "_BOOT_ID=4f0e7f4d1b0f4f4fa8a0b3a0d6f1c2e3\n";
  // The export format has the same entries as journald's native protocol.
  text << JournalDatagram(JournalFields(entry, {"ur10", 2}, program)) << '\n';
  return text.str();
}

/// Writes a journal with these entries into the folder. @return whether that succeeded
bool MakeJournal(const std::string& folder, const std::string& exported) {
  if (access(kJournalRemote, X_OK) != 0) return false;
  std::ofstream(folder + "/entries") << exported;
  const std::string command = std::string(kJournalRemote) + " --output=" + folder +
                              "/plumbline.journal " + folder + "/entries > /dev/null 2>&1";
  return std::system(command.c_str()) == 0;
}

const std::string kEntries =
    Exported(1790000000, {Event::kStarted, "plumblined 0.1.0 with ur10"}, "plumblined") +
    Exported(1790000010, {Event::kPointCorrected, "point 7 corrected", {{"POINT", "7"}}},
             "plumblined") +
    Exported(1790000020, {Event::kRobotLinkLost, "robot link lost:\nno answer"}, "plumblined") +
    Exported(1790000025, {Event::kRobotLinkLost, "robot link lost: someone else"}, "another") +
    Exported(1790000030, {Event::kInterferenceBegins, "interference begins"}, "plumbline-view");

std::vector<std::string> Texts(const JournalQuery& query) {
  auto reader = JournalReader::Open(query);
  REQUIRE(reader);
  std::vector<std::string> texts;
  while (const auto entry = reader.value().Next()) texts.push_back(entry->text);
  return texts;
}

}  // namespace

TEST_CASE("entries in the journal are read back, and can be filtered") {
  const TemporaryFolder folder;
  if (!MakeJournal(folder.path(), kEntries)) {
    std::cerr << "SKIPPED: " << kJournalRemote << " is not installed, or created no journal\n";
    return;
  }
  JournalQuery query;
  query.directory = folder.path();
  using Lines = std::vector<std::string>;
  CHECK(Texts(query) == Lines{"plumblined 0.1.0 with ur10", "point 7 corrected",
                              "robot link lost:\nno answer", "interference begins"});
  SECTION("the newest") {
    query.last = 2;
    CHECK(Texts(query) == Lines{"robot link lost:\nno answer", "interference begins"});
  }
  SECTION("since a time") {
    query.since_utc_s = 1790000015;
    CHECK(Texts(query) == Lines{"robot link lost:\nno answer", "interference begins"});
  }
  SECTION("severe ones, one of them with two lines") {
    query.level = LogLevel::kError;
    CHECK(Texts(query) == Lines{"robot link lost:\nno answer", "interference begins"});
  }
  SECTION("of one event, with its values") {
    query.event = "point-corrected";
    auto reader = JournalReader::Open(query);
    REQUIRE(reader);
    const auto entry = reader.value().Next();
    REQUIRE(entry);
    CHECK(entry->event == "point-corrected");
    CHECK(entry->component == "points");
    CHECK(entry->cell == "ur10");
    CHECK(entry->priority == 6);
    CHECK(entry->utc_s == Approx(1790000010).margin(1e-3));
    CHECK_FALSE(reader.value().Next());
  }
  SECTION("the command explains them") {
    const Answer answer = Shell("log --level error --explain --directory " + folder.path());
    CHECK(answer.exit_code == 0);
    CHECK_THAT(answer.output, Catch::Contains("error    robot link lost:"));
    CHECK_THAT(answer.output, Catch::Contains("do:  check cable, address and controller"));
  }
}

TEST_CASE("a missing folder is an error") {
  JournalQuery query;
  query.directory = "/nonexistent";
  const auto reader = JournalReader::Open(query);
  REQUIRE_FALSE(reader);
  CHECK(reader.error() == "/nonexistent: No such file or directory; check the name: ls /");
}

}  // namespace plumbline::journal_reader_test
