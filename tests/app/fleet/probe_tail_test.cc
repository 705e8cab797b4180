#include "app/fleet/probe_tail.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "app/journal/journal.h"
#include "tests/app/temporary_folder.h"
#include "tests/firmware-like/test_cell.h"

using namespace plumbline;
using test::TemporaryFolder;

namespace {

struct Written {
  TemporaryFolder folder;
  std::string path = folder.path() + "/journal.sqlite";
  const std::vector<Joint> joints = test::HeavyArm().robot.joints;
  int number = 0;

  void Add(int count, JournalRow::Source source = JournalRow::Source::kPlc) {
    auto journal = Journal::Open(path);
    REQUIRE(journal);
    for (int k = 0; k < count; ++k) {
      JournalRow row;
      row.source = source;
      row.unix_ms = ++number;
      row.q = JointVector::Zero(6);
      row.measured_W = Vec3(1, 2, 3.001);
      row.predicted_W = Vec3(1, 2, 3);
      row.model_version = 4;
      REQUIRE(journal.value().Append({row}, joints));
    }
  }
};

std::vector<std::int64_t> Ids(const ProbeTail::Taken& taken) {
  std::vector<std::int64_t> ids;
  for (const ProbeRow& probe : taken.probes) ids.push_back(probe.id);
  return ids;
}

}  // namespace

TEST_CASE("the first look takes nothing; then what was there at the look before, each row once") {
  Written written;
  written.Add(3);
  ProbeTail tail(written.path);
  auto taken = tail.Look(std::nullopt).value();
  CHECK(taken.probes.empty());
  CHECK(taken.mark.id == 3);
  written.Add(2);
  taken = tail.Look(taken.mark).value();
  CHECK(taken.probes.empty());  // the monitor may not have marked them yet
  taken = tail.Look(taken.mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{4, 5});
  CHECK(taken.probes[0].model_version == 4);
  CHECK((*taken.probes[0].measured_W - *taken.probes[0].predicted_W).norm() == Approx(1e-3));
  taken = tail.Look(taken.mark).value();
  CHECK(taken.probes.empty());
}

TEST_CASE("a restart goes on behind its mark; a journal that comes later counts whole") {
  Written written;
  ProbeTail early(written.path);
  auto taken = early.Look(std::nullopt).value();
  written.Add(2);
  taken = early.Look(taken.mark).value();
  taken = early.Look(taken.mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{1, 2});
  written.Add(1);
  ProbeTail restarted(written.path);
  taken = restarted.Look(taken.mark).value();
  taken = restarted.Look(taken.mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{3});
}

TEST_CASE("imported rows are no probes, and a large backlog comes in parts") {
  Written written;
  written.Add(1);
  ProbeTail tail(written.path);
  auto taken = tail.Look(std::nullopt).value();
  written.Add(2, JournalRow::Source::kImport);
  written.Add(ProbeTail::kMostAtOnce + 10);
  std::size_t probes = 0;
  for (int look = 0; look < 4; ++look) {
    taken = tail.Look(taken.mark).value();
    probes += taken.probes.size();
  }
  CHECK(probes == ProbeTail::kMostAtOnce + 10);
}

TEST_CASE("another journal in its place begins anew; what is none is told") {
  Written written;
  written.Add(5);
  ProbeTail tail(written.path);
  // Of a journal that was made at another time.
  ProbeMark mark{tail.Look(std::nullopt).value().mark.journal - 1000, 77};
  auto taken = tail.Look(mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{1, 2, 3, 4, 5});
  const TemporaryFolder folder;
  CHECK_FALSE(ProbeTail(folder.path()).Look(mark));
}
