#include "app/plant/jobs/job_queue.h"

#include <catch2/catch.hpp>
#include <set>
#include <thread>

#include "tests/app/plant/database/postgres_process.h"

namespace plumbline::plant::job_queue_test {

constexpr double kLong_s = 600;
const JobResult kResult{"program", 1.5, "{\"verdict\": \"no_effect\"}"};

std::vector<NewJob> Jobs(int count, const std::string& version = "") {
  std::vector<NewJob> jobs;
  for (int k = 0; k < count; ++k)
    jobs.push_back({"diagnose", std::nullopt, std::nullopt, version, {{"rows", k}}});
  return jobs;
}

/// As if the time of the lease had passed.
void ExpireLeases(Connection& owner) {
  REQUIRE(owner
              .RunScript("UPDATE job SET lease_until = now() - interval '1 s'"
                         " WHERE lease_until IS NOT NULL")
              .ok());
}

std::int64_t Count(Connection& owner, const char* statement) {
  const auto rows = owner.Run(statement);
  REQUIRE(rows.ok());
  return rows->Integer(0, 0);
}

TEST_CASE("the queue") {
  if (test::PostgresPrograms().empty()) {
    WARN("SKIPPED: no PostgreSQL 15 here");
    return;
  }
  static const test::PostgresProcess server;  // one for all sections
  static Connection owner = server.ConnectToNewPlant();
  REQUIRE(owner.RunScript("TRUNCATE job CASCADE").ok());
  if (owner.Run("SELECT FROM pg_roles WHERE rolname = 'w'")->empty()) {
    REQUIRE(owner.RunScript("CREATE ROLE w LOGIN IN ROLE plumbline_worker").ok());
  }
  Connection connection = server.Connect("w");  // with a worker's rights only
  const JobQueue a("a", kLong_s, {"v1"}), b("b", kLong_s, {"v1", "v2"});

  SECTION("the same work is added once") {
    const auto first = AddJobs(connection, Jobs(3));
    REQUIRE(first.ok());
    const auto again = AddJobs(connection, Jobs(4));
    REQUIRE(again.ok());
    CHECK(std::vector(again->begin(), again->begin() + 3) == *first);
    CHECK(Count(owner, "SELECT count(*) FROM job") == 4);
  }

  SECTION("a job is finished by whoever holds it, once") {
    REQUIRE(AddJobs(connection, Jobs(1)).ok());
    const TakenJob job = **a.Take(connection);
    CHECK(job.input["rows"] == 0);
    CHECK_FALSE(b.Take(connection)->has_value());
    CHECK_FALSE(*b.Extend(connection, job));
    CHECK_FALSE(*b.Finish(connection, job, kResult));
    CHECK(*a.Extend(connection, job));
    CHECK(*a.Finish(connection, job, kResult));
    CHECK_FALSE(*a.Finish(connection, job, kResult));
    CHECK(Count(owner, "SELECT count(*) FROM result WHERE worker = 'a'") == 1);
    CHECK_FALSE(a.Take(connection)->has_value());
  }

  SECTION("an expired lease goes to another, and the first worker can do nothing more") {
    REQUIRE(AddJobs(connection, Jobs(1)).ok());
    const TakenJob lost = **a.Take(connection);
    ExpireLeases(owner);
    CHECK(*a.Extend(connection, lost));  // nobody has taken it
    ExpireLeases(owner);
    const TakenJob taken = **b.Take(connection);
    CHECK(taken.job == lost.job);
    CHECK(taken.attempt == 2);
    CHECK_FALSE(*a.Extend(connection, lost));
    CHECK_FALSE(*a.Fail(connection, lost, "late"));
    CHECK(a.HandBack(connection, lost).ok());
    CHECK_FALSE(*a.Finish(connection, lost, kResult));
    CHECK(*b.Finish(connection, taken, kResult));
    CHECK(Count(owner, "SELECT count(*) FROM result") == 1);
  }

  SECTION("a job that fails three times is named, and no more taken") {
    REQUIRE(AddJobs(connection, Jobs(2)).ok());
    const std::int64_t bad = (**a.Take(connection)).job;
    REQUIRE(a.Fail(connection, {bad, 1, "", "", {}, {}}, "signal 11").ok());
    const TakenJob other = **a.Take(connection);  // those tried before come last
    CHECK(other.job != bad);
    CHECK_FALSE(*a.Fail(connection, {bad, 1, "", "", {}, {}}, "twice"));
    const TakenJob second = **b.Take(connection);
    CHECK_FALSE(*b.Fail(connection, second, "signal 11"));
    CHECK(*a.Fail(connection, **a.Take(connection), "signal 6"));
    CHECK_FALSE(a.Take(connection)->has_value());
    CHECK(Count(owner,
                "SELECT count(*) FROM job WHERE finished IS NOT NULL AND failed ="
                " 'signal 6' AND attempts = 3") == 1);
  }

  SECTION("a job whose workers vanish is given up, too") {
    REQUIRE(AddJobs(connection, Jobs(1)).ok());
    for (int k = 0; k < kMaxAttempts; ++k) {
      REQUIRE(b.Take(connection)->has_value());
      ExpireLeases(owner);
    }
    CHECK_FALSE(a.Take(connection)->has_value());
    CHECK(Count(owner,
                "SELECT count(*) FROM job WHERE finished IS NOT NULL AND failed LIKE"
                " '%vanished'") == 1);
  }

  SECTION("handing back costs no attempt") {
    REQUIRE(AddJobs(connection, Jobs(1)).ok());
    for (int k = 0; k < 2 * kMaxAttempts; ++k)
      REQUIRE(a.HandBack(connection, **a.Take(connection)).ok());
    CHECK((**b.Take(connection)).attempt == 1);
  }

  SECTION("a worker takes jobs for versions that it has") {
    REQUIRE(AddJobs(connection, Jobs(1, "v2")).ok());
    CHECK_FALSE(a.Take(connection)->has_value());
    CHECK((**b.Take(connection)).version == "v2");
  }

  SECTION("workers at once never take the same job") {
    constexpr int kJobs = 200, kWorkers = 4;
    REQUIRE(AddJobs(connection, Jobs(kJobs)).ok());
    std::vector<std::vector<std::int64_t>> taken(kWorkers);
    std::vector<std::thread> workers;
    for (int k = 0; k < kWorkers; ++k) {
      workers.emplace_back([k, &taken] {
        auto own = Connection::Open(server.Settings("plumbline", "w"), "test");
        if (!own) return;
        const JobQueue queue("w" + std::to_string(k), kLong_s, {});
        for (;;) {
          const auto job = queue.Take(own.value());
          if (!job.ok() || !job->has_value()) return;
          taken[static_cast<std::size_t>(k)].push_back((**job).job);
        }
      });
    }
    for (std::thread& worker : workers) worker.join();
    std::set<std::int64_t> all;
    std::size_t count = 0;
    for (const auto& one : taken) {
      all.insert(one.begin(), one.end());
      count += one.size();
    }
    CHECK(count == kJobs);
    CHECK(all.size() == kJobs);
  }
}

}  // namespace plumbline::plant::job_queue_test
