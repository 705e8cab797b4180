#include "app/plant/publish/queue.h"

#include <sqlite3.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "tests/app/released.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::queue_test {

using namespace plumbline::plant;
using test::TemporaryFolder;

namespace {

constexpr std::int64_t kRoom = 1'000'000;

FleetQueue OpenedAt(const TemporaryFolder& folder, std::int64_t bound = kRoom) {
  auto queue = FleetQueue::Open(folder.path() + "/queue.sqlite", bound);
  REQUIRE(queue);
  return std::move(queue).value();
}

Message Of(MessageKind kind, int number) {
  return {kind, 1000 + number, "{\"n\":" + std::to_string(number) + "}"};
}

std::vector<std::int64_t> Seqs(FleetQueue& queue, std::int64_t after = 0) {
  std::vector<std::int64_t> seqs;
  for (const QueuedMessage& one : queue.Next(after, 100000).value()) seqs.push_back(one.seq);
  return seqs;
}

}  // namespace

TEST_CASE("messages are returned in order and survive closing the file") {
  const TemporaryFolder folder;
  std::string stream;
  {
    FleetQueue queue = OpenedAt(folder);
    stream = queue.stream();
    CHECK(stream.size() == 8);
    CHECK(queue.memory().empty());
    REQUIRE(queue.Append({Of(MessageKind::kProbe, 1), Of(MessageKind::kState, 2)}, "{\"x\":1}"));
    REQUIRE(queue.Append({Of(MessageKind::kAlarm, 3)}, "{\"x\":2}"));
  }
  FleetQueue queue = OpenedAt(folder);
  CHECK(queue.stream() == stream);
  CHECK(queue.memory() == "{\"x\":2}");
  CHECK(queue.size() == 3);
  const auto all = queue.Next(0, 10).value();
  REQUIRE(all.size() == 3);
  CHECK(all[0].seq == 1);
  CHECK(all[0].message.kind == MessageKind::kProbe);
  CHECK(all[1].message.body == "{\"n\":2}");
  CHECK(all[2].message.utc_ms == 1003);
  CHECK(Seqs(queue, 1) == std::vector<std::int64_t>{2, 3});
}

TEST_CASE("a number is never reused, even after the queue was empty") {
  const TemporaryFolder folder;
  {
    FleetQueue queue = OpenedAt(folder);
    REQUIRE(queue.Append({Of(MessageKind::kState, 1), Of(MessageKind::kState, 2)}, ""));
    const std::vector<std::int64_t> both = {2, 1};
    REQUIRE(queue.Remove(both));
    CHECK(queue.size() == 0);
    CHECK(queue.bytes() == 0);
    REQUIRE(queue.Remove(both));  // again: already removed
    CHECK(queue.size() == 0);
  }
  FleetQueue queue = OpenedAt(folder);
  REQUIRE(queue.Append({Of(MessageKind::kState, 3)}, ""));
  CHECK(Seqs(queue) == std::vector<std::int64_t>{3});
}

TEST_CASE(
    "beyond the bound states are dropped first, then changes, then events; the oldest first") {
  const TemporaryFolder folder;
  const std::int64_t row = FleetQueue::kRowBytes + 7;
  FleetQueue queue = OpenedAt(folder, 60 * (row + 1));
  for (int k = 0; k < 20; ++k) {
    REQUIRE(queue.Append(
        {Of(MessageKind::kState, k), Of(MessageKind::kPoint, k), Of(MessageKind::kProbe, k)}, ""));
  }
  CHECK(queue.size() == 60);
  CHECK(queue.dropped() == FleetQueue::Dropped{});
  REQUIRE(queue.Append({Of(MessageKind::kProbe, 20), Of(MessageKind::kProbe, 21)}, ""));
  CHECK(queue.dropped() == FleetQueue::Dropped{16, 0, 0});
  CHECK(queue.bytes() <= 60 * (row + 1));
  CHECK(Seqs(queue).front() == 2);  // the first state was dropped, the first point was not
  for (int k = 0; k < 100; ++k) REQUIRE(queue.Append({Of(MessageKind::kAlarm, k)}, ""));
  CHECK(queue.dropped()[0] == 20);
  CHECK(queue.dropped()[1] == 20);
  CHECK(queue.dropped()[2] > 0);
  CHECK(queue.size() <= 60);
  for (const QueuedMessage& one : queue.Next(0, 100).value()) {
    CHECK(ImportanceOf(one.message.kind) == 2);
  }
  CHECK(Seqs(queue).back() == 162);
  const auto dropped = queue.dropped();
  const auto size = queue.size();
  REQUIRE(queue.Append({Of(MessageKind::kState, 1)}, ""));  // the least important message itself
  CHECK(queue.size() >= size - 1);
  CHECK(queue.dropped()[0] + queue.dropped()[2] >= dropped[0] + dropped[2]);
}

TEST_CASE("the file size stays near the bound, however long the broker is away") {
  const TemporaryFolder folder;
  FleetQueue queue = OpenedAt(folder, kRoom);
  const std::string body = "{\"x\":\"" + std::string(900, 'x') + "\"}";
  for (int k = 0; k < 6000; ++k) {
    REQUIRE(queue.Append({{k % 3 == 0 ? MessageKind::kProbe : MessageKind::kState, k, body}}, ""));
  }
  std::uintmax_t bytes = 0;
  for (const auto& file : std::filesystem::directory_iterator(folder.path())) {
    bytes += file.file_size();
  }
  INFO(bytes);
  CHECK(bytes < 3 * kRoom);
  CHECK(queue.bytes() <= kRoom);
  CHECK(queue.size() + queue.dropped()[0] + queue.dropped()[2] == 6000);
}

TEST_CASE("a file that is not a queue is refused and left unchanged") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/queue.sqlite";
  CHECK_FALSE(FleetQueue::Open("/no/such/folder/queue.sqlite", kRoom));
  std::ofstream(path) << "this is a letter and no database, of more than sixteen bytes";
  CHECK_FALSE(FleetQueue::Open(path, kRoom));
  std::filesystem::remove(path);
  sqlite3* other = nullptr;
  sqlite3_open(path.c_str(), &other);
  sqlite3_exec(other, "CREATE TABLE a (b)", nullptr, nullptr, nullptr);
  sqlite3_close(other);
  const auto refused = FleetQueue::Open(path, kRoom);
  REQUIRE_FALSE(refused);
  CHECK_THAT(refused.error(), Catch::Contains("not a queue of plumbline-fleet"));
}

TEST_CASE("a second publisher cannot open the queue") {
  const TemporaryFolder folder;
  const FleetQueue first = OpenedAt(folder);
  const auto second = FleetQueue::Open(folder.path() + "/queue.sqlite", kRoom);
  REQUIRE_FALSE(second);
  CHECK_THAT(second.error(), Catch::Contains("another plumbline-fleet"));
}

TEST_CASE("an acknowledged message is kept for repetition until it is removed") {
  const TemporaryFolder folder;
  const std::vector<std::int64_t> first = {1, 2}, second = {2, 99};
  {
    FleetQueue queue = OpenedAt(folder);
    for (int k = 0; k < 4; ++k) REQUIRE(queue.Append({Of(MessageKind::kProbe, k)}, ""));
    REQUIRE(queue.Acknowledge(first));
    REQUIRE(queue.RecordRepetition(1234));
  }
  FleetQueue queue = OpenedAt(folder);
  CHECK(queue.repeated_ms() == 1234);
  CHECK(queue.size() == 2);
  CHECK(queue.kept() == 2);
  CHECK(Seqs(queue) == std::vector<std::int64_t>{1, 2, 3, 4});
  const auto fresh = queue.Next(0, 10, FleetQueue::Rows::kUnacknowledged).value();
  REQUIRE(fresh.size() == 2);
  CHECK(fresh[0].seq == 3);
  REQUIRE(queue.Acknowledge(second));
  CHECK(queue.kept() == 2);
  REQUIRE(queue.Remove(first));
  CHECK(queue.kept() == 0);
  CHECK(Seqs(queue) == std::vector<std::int64_t>{3, 4});
  CHECK(queue.dropped() == FleetQueue::Dropped{});
}

TEST_CASE("a message that was acknowledged many times is not kept any longer") {
  const TemporaryFolder folder;
  FleetQueue queue = OpenedAt(folder);
  REQUIRE(queue.Append({Of(MessageKind::kProbe, 1), Of(MessageKind::kProbe, 2)}, ""));
  const std::vector<std::int64_t> one = {1};
  for (int k = 0; k < FleetQueue::kMaxAcknowledgements; ++k) {
    CHECK(Seqs(queue) == std::vector<std::int64_t>{1, 2});
    REQUIRE(queue.Acknowledge(one));
  }
  CHECK(Seqs(queue) == std::vector<std::int64_t>{2});
  CHECK(queue.kept() == 0);
  CHECK(queue.dropped() == FleetQueue::Dropped{});
}

TEST_CASE("beyond the bound acknowledged messages go first, and do not count as dropped") {
  const TemporaryFolder folder;
  const std::int64_t row = FleetQueue::kRowBytes + 7;
  FleetQueue queue = OpenedAt(folder, 60 * (row + 1));
  std::vector<std::int64_t> acknowledged;
  for (int k = 0; k < 60; ++k) {
    REQUIRE(queue.Append({Of(k % 2 == 0 ? MessageKind::kProbe : MessageKind::kState, k)}, ""));
    if (k % 2 == 0) acknowledged.push_back(k + 1);
  }
  REQUIRE(queue.Acknowledge(acknowledged));
  for (int k = 0; k < 14; ++k) REQUIRE(queue.Append({Of(MessageKind::kProbe, 60 + k)}, ""));
  CHECK(queue.dropped() == FleetQueue::Dropped{});
  CHECK(queue.kept() == 14);
  CHECK(queue.size() == 44);
  CHECK(Seqs(queue).front() == 2);
  for (int k = 0; k < 40; ++k) REQUIRE(queue.Append({Of(MessageKind::kProbe, 80 + k)}, ""));
  CHECK(queue.kept() == 0);
  CHECK(queue.dropped()[0] > 0);
  CHECK(queue.dropped()[2] == 0);
  CHECK(queue.bytes() <= 60 * (row + 1));
}

TEST_CASE(
    "a queue of every released schema opens with all its messages and continues its numbers") {
  for (const int schema : {1, 2}) {
    const TemporaryFolder folder;
    test::WriteReleased("plant/publish", schema, folder.path() + "/queue.sqlite");
    FleetQueue queue = OpenedAt(folder);
    CHECK(queue.stream() == "1d532e05");
    CHECK(queue.memory() == "{\"journal\":1790000000,\"id\":120}");
    const auto waiting = queue.Next(0, 10, FleetQueue::Rows::kUnacknowledged);
    REQUIRE(waiting);
    REQUIRE(waiting->size() == 2);
    CHECK((*waiting)[0].seq == 2);
    CHECK((*waiting)[0].message.kind == MessageKind::kAlarm);
    CHECK((*waiting)[1].message.utc_ms == 1795260031500);
    CHECK((*waiting)[1].message.body == "{\"n\":3}");
    CHECK(queue.kept() == schema - 1);
    CHECK(queue.repeated_ms() == (schema == 1 ? 0 : 1795260030000));
    REQUIRE(queue.Append({Of(MessageKind::kState, 4)}, ""));
    CHECK(Seqs(queue).back() == 4);
    const std::vector<std::int64_t> all = {1, 2, 3, 4};
    REQUIRE(queue.Acknowledge(all));
    CHECK(queue.size() == 0);
  }
}

TEST_CASE("a queue of a newer version is refused with a remedy and left unchanged") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/queue.sqlite";
  test::WriteReleased("plant/publish", 2, path);
  test::SetSchema(path, 3);
  const std::string before = test::FileText(path);
  const auto queue = FleetQueue::Open(path, kRoom);
  REQUIRE_FALSE(queue);
  CHECK_THAT(queue.error(), Catch::Contains("written by a newer plumbline") &&
                                Catch::Contains("install that version again"));
  CHECK(test::FileText(path) == before);
}

}  // namespace plumbline::queue_test
