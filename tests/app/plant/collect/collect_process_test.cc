// The real collector between Debian's broker and database, through what befalls both.
#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <utility>

#include "app/plant/broker/broker_link.h"
#include "tests/app/plant/broker/broker_process.h"
#include "tests/app/plant/collect/plant_messages.h"
#include "tests/app/plant/database/postgres_process.h"

namespace plumbline::plant::collect_process_test {

class CollectorProcess {
 public:
  explicit CollectorProcess(const std::string& config) : config_(config) { Start(); }
  ~CollectorProcess() { Stop(SIGKILL); }
  CollectorProcess(const CollectorProcess&) = delete;
  CollectorProcess& operator=(const CollectorProcess&) = delete;
  void Start() {
    pid_ = fork();
    if (pid_ == 0) {
      const int log = open((config_ + ".log").c_str(), O_WRONLY | O_CREAT | O_APPEND, 0644);
      dup2(log, STDERR_FILENO);
      dup2(log, STDOUT_FILENO);
      execl(PLUMBLINE_COLLECT, PLUMBLINE_COLLECT, config_.c_str(), nullptr);
      _exit(127);
    }
  }
  int Stop(int signal) {
    if (pid_ <= 0) return 0;
    kill(pid_, signal);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return status;
  }
  void Signal(int signal) const { kill(pid_, signal); }
  std::string Log() const { return test::FileText(config_ + ".log"); }

 private:
  const std::string config_;
  pid_t pid_ = -1;
};

class Publisher {
 public:
  explicit Publisher(int port) : link_(Config(port), {}) {}
  void Publish(const std::vector<Received>& messages) {
    std::int64_t connection = 0;
    REQUIRE(test::Soon([&] { return (connection = link_.TakeStatus().connection) != 0; }));
    std::vector<Outgoing> outgoing;
    for (const Received& one : messages) outgoing.push_back({++id_, one.topic, one.payload, false});
    link_.Publish(connection, outgoing);
    std::size_t acknowledged = 0;
    REQUIRE(test::Soon([&] {
      acknowledged += link_.TakeStatus().acknowledged.size();
      return acknowledged == messages.size();
    }));
  }

 private:
  static config::MqttConfig Config(int port) {
    config::MqttConfig config;
    config.host = "127.0.0.1";
    config.port = port;
    config.client_id = "writer";
    return config;
  }
  BrokerLink link_;
  std::int64_t id_ = 0;
};

void WriteConfig(const std::string& file, int port, const std::string& database) {
  std::ofstream(file) << fmt::format(
      "[broker]\nhost = \"127.0.0.1\"\nport = {}\n[database]\nconnection = \"{}\"\n", port,
      database);
}

TEST_CASE("the collector stores everything once, whatever stops meanwhile") {
  if (test::PostgresPrograms().empty() || test::MosquittoProgram().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 or mosquitto here");
    return;
  }
  test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  const test::BrokerProcess broker;
  const test::TemporaryFolder folder;
  const std::string config = folder.path() + "/plant.toml";
  WriteConfig(config, broker.port(), server.Settings());
  CollectorProcess collector(config);
  REQUIRE(
      test::Soon([&] { return collector.Log().find("broker 127.0.0.1") != std::string::npos; }));

  const test::PublishingCell cell;
  Publisher publisher(broker.port());
  int seq = 0;
  const auto publish = [&](int count) {
    std::vector<Received> messages;
    const auto now_ms = static_cast<std::int64_t>(time(nullptr)) * 1000;
    for (int k = 0; k < count; ++k) messages.push_back(cell.Probe(++seq, now_ms + k));
    publisher.Publish(messages);
  };
  const auto stored = [&] {
    auto connection = Connection::Open(server.Settings(), "test");
    if (!connection) return std::int64_t{-1};
    const auto rows = connection.value().Run("SELECT count(*) FROM probe");
    return rows ? rows->Integer(0, 0) : -1;
  };
  publish(100);
  CHECK(test::Soon([&] { return stored() == seq; }));

  server.Stop(SIGKILL);  // a crash; messages wait at the broker
  publish(100);
  CHECK(test::Soon(
      [&] { return collector.Log().find("messages stay at the broker") != std::string::npos; }));
  server.Start();
  CHECK(test::Soon([&] { return stored() == seq; }));

  collector.Signal(SIGHUP);
  publish(100);
  CHECK(test::Soon([&] { return stored() == seq; }));

  collector.Stop(SIGKILL);
  publish(100);
  collector.Start();
  publisher.Publish({{"plumblineV1/line-1/NPROBE/cell-1", "poison"}});
  publish(100);
  CHECK(test::Soon([&] { return stored() == seq; }));

  // A faulty configuration does not replace the one in force.
  std::ofstream(config, std::ios::app) << "[collect]\nnonsense = 1\n";
  collector.Signal(SIGHUP);
  CHECK(test::Soon([&] { return collector.Log().find("is not used") != std::string::npos; }));
  publish(100);
  CHECK(test::Soon([&] { return stored() == seq; }));
  CHECK(WEXITSTATUS(collector.Stop(SIGTERM)) == 0);
  auto after = server.Connect();
  CHECK(after.Run("SELECT missing FROM cell_now")->Integer(0, 0) == 0);
  CHECK(after.Run("SELECT sum(messages) FROM dead_letter")->Integer(0, 0) == 1);
}

TEST_CASE("a crash of the database during a backlog loses nothing and refuses nobody") {
  if (test::PostgresPrograms().empty() || test::MosquittoProgram().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 or mosquitto here");
    return;
  }
  test::PostgresProcess server;
  Connection database = server.ConnectToNewPlant();
  const test::BrokerProcess broker;
  const test::TemporaryFolder folder;
  const std::string config = folder.path() + "/plant.toml";
  WriteConfig(config, broker.port(), server.Settings());
  CollectorProcess collector(config);
  REQUIRE(
      test::Soon([&] { return collector.Log().find("broker 127.0.0.1") != std::string::npos; }));
  collector.Stop(SIGKILL);
  constexpr int kMessages = 60'000, kCells = 3, kChunk = 5000, kStep_ms = 100;
  const auto begin_ms =
      static_cast<std::int64_t>(time(nullptr)) * 1000 - kMessages / kCells * kStep_ms;
  Publisher publisher(broker.port());
  std::vector<Received> messages;
  for (int k = 0; k < kMessages; ++k) {
    test::PublishingCell cell;
    cell.node = fmt::format("cell-{}", k % kCells);
    messages.push_back(cell.Probe(k / kCells + 1, begin_ms + k / kCells * kStep_ms));
    if (messages.size() == kChunk) publisher.Publish(std::exchange(messages, {}));
  }
  const auto number = [&](const char* question) {
    auto connection = Connection::Open(server.Settings(), "test");
    const auto rows = connection ? connection.value().Run(question) : Result<Rows>(Error{""});
    return rows ? rows->Integer(0, 0) : -1;
  };
  collector.Start();
  for (const int crash_at : {1, 30'000}) {
    REQUIRE(test::Soon([&] { return number("SELECT count(*) FROM probe") >= crash_at; }));
    server.Stop(SIGKILL);
    server.Start();
  }
  REQUIRE(test::Soon([&] { return number("SELECT count(*) FROM probe") == kMessages; }));
  CHECK(number("SELECT sum(missing)::bigint FROM cell_now") == 0);
  CHECK(number("SELECT sum(limited)::bigint FROM cell") == 0);
  CHECK(number("SELECT sum(probes)::bigint FROM cell_day") == kMessages);
}

}  // namespace plumbline::plant::collect_process_test
