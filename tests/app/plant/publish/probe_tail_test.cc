#include "app/plant/publish/probe_tail.h"

#include <catch2/catch.hpp>
#include <filesystem>

#include "app/cell/journal/journal.h"
#include "tests/app/temporary_folder.h"
#include "tests/firmware-like/test_cell.h"

namespace plumbline::probe_tail_test {

using namespace plumbline::plant;
using test::TemporaryFolder;

namespace {

struct Written {
  TemporaryFolder folder;
  std::string path = folder.path() + "/journal.sqlite";
  const std::vector<model::Joint> joints = test::HeavyArm().robot.joints;
  int number = 0;

  void Add(int count, cell::JournalRow::Source source = cell::JournalRow::Source::kPlc) {
    auto journal = cell::Journal::Open(path);
    REQUIRE(journal);
    for (int k = 0; k < count; ++k) {
      cell::JournalRow row;
      row.source = source;
      row.unix_ms = ++number;
      row.q = model::JointVector::Zero(6);
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

TEST_CASE("the first read returns nothing, then each row that existed at the previous read, once") {
  Written written;
  written.Add(3);
  ProbeTail tail(written.path, written.joints);
  auto taken = tail.ReadNew(std::nullopt).value();
  CHECK(taken.probes.empty());
  CHECK(taken.mark.id == 3);
  written.Add(2);
  taken = tail.ReadNew(taken.mark).value();
  CHECK(taken.probes.empty());  // the drift monitor may not have marked them yet
  taken = tail.ReadNew(taken.mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{4, 5});
  CHECK(taken.probes[0].model_version == 4);
  CHECK((*taken.probes[0].measured_W - *taken.probes[0].predicted_W).norm() == Approx(1e-3));
  taken = tail.ReadNew(taken.mark).value();
  CHECK(taken.probes.empty());
}

TEST_CASE("a restart continues after its mark; a journal created later is read completely") {
  Written written;
  ProbeTail early(written.path, written.joints);
  auto taken = early.ReadNew(std::nullopt).value();
  written.Add(2);
  taken = early.ReadNew(taken.mark).value();
  taken = early.ReadNew(taken.mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{1, 2});
  written.Add(1);
  ProbeTail restarted(written.path, written.joints);
  taken = restarted.ReadNew(taken.mark).value();
  taken = restarted.ReadNew(taken.mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{3});
}

TEST_CASE("imported rows are skipped, and a large backlog is read in parts") {
  Written written;
  written.Add(1);
  ProbeTail tail(written.path, written.joints);
  auto taken = tail.ReadNew(std::nullopt).value();
  written.Add(2, cell::JournalRow::Source::kImport);
  written.Add(ProbeTail::kMaxRows + 10);
  std::size_t probes = 0;
  for (int look = 0; look < 4; ++look) {
    taken = tail.ReadNew(taken.mark).value();
    probes += taken.probes.size();
  }
  CHECK(probes == ProbeTail::kMaxRows + 10);
}

TEST_CASE("rows with another number of joints are skipped and counted") {
  Written written;
  written.Add(1);
  ProbeTail tail(written.path, std::vector<model::Joint>(5));
  auto taken = tail.ReadNew(std::nullopt).value();
  written.Add(2);
  taken = tail.ReadNew(taken.mark).value();
  taken = tail.ReadNew(taken.mark).value();
  CHECK(taken.probes.empty());
  CHECK(taken.skipped == 2);
  CHECK(taken.mark.id == 3);
}

TEST_CASE("a replaced journal is read from its start; an invalid one is reported") {
  Written written;
  written.Add(5);
  ProbeTail tail(written.path, written.joints);
  // A journal created at another time.
  ProbeMark mark{tail.ReadNew(std::nullopt).value().mark.journal - 1000, 77};
  auto taken = tail.ReadNew(mark).value();
  CHECK(Ids(taken) == std::vector<std::int64_t>{1, 2, 3, 4, 5});
  const TemporaryFolder folder;
  CHECK_FALSE(ProbeTail(folder.path(), written.joints).ReadNew(mark));
}

}  // namespace plumbline::probe_tail_test
