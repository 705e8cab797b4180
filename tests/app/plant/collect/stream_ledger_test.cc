#include "app/plant/collect/stream_ledger.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <set>
#include <vector>

#include "app/plant/collect/admission.h"

namespace plumbline::plant::stream_ledger_test {

TEST_CASE("a ledger agrees with the set of all numbers, in any order and with repetitions") {
  std::mt19937 random(7);
  for (int run = 0; run < 300; ++run) {
    const int from = std::uniform_int_distribution<int>(1, 20)(random);
    std::vector<std::int64_t> numbers;
    for (int k = from; k < from + 60; ++k) {
      const int times = std::uniform_int_distribution<int>(0, 2)(random);
      numbers.insert(numbers.end(), static_cast<std::size_t>(times), k);
    }
    if (numbers.empty()) continue;
    std::shuffle(numbers.begin(), numbers.end(), random);
    StreamLedger ledger(numbers.front());
    std::set<std::int64_t> arrived;
    for (const std::int64_t seq : numbers) {
      REQUIRE(ledger.Take(seq) == arrived.insert(seq).second);
      std::set<std::int64_t> missing;
      for (std::int64_t k = *arrived.begin(); k < *arrived.rbegin(); ++k) {
        if (!arrived.contains(k)) missing.insert(k);
      }
      std::set<std::int64_t> gaps;
      for (const auto& [first, last] : ledger.gaps()) {
        REQUIRE(first <= last);
        for (std::int64_t k = first; k <= last; ++k) REQUIRE(gaps.insert(k).second);
      }
      REQUIRE(gaps == missing);
      REQUIRE(ledger.first() == *arrived.begin());
      REQUIRE(ledger.next() == *arrived.rbegin() + 1);
    }
  }
}

TEST_CASE("a stream that must begin at 1 shows what is missing before its first arrival") {
  StreamLedger ledger(1);
  CHECK(ledger.Take(5));
  CHECK(ledger.gaps() == StreamLedger::Gaps{{1, 4}});
  CHECK(ledger.Take(2));
  CHECK(ledger.gaps() == StreamLedger::Gaps{{1, 1}, {3, 4}});
}

TEST_CASE("a backlog passes at any speed, a flood does not") {
  constexpr double kNow_s = 1.8e9;
  Admission admission(50, 5'000'000);
  int refused = 0;
  // A day at two messages a second, received at once.
  for (int k = 0; k < 2 * 86400; ++k) {
    const auto utc_ms = static_cast<std::int64_t>(1e3 * (kNow_s - 86400 + 0.5 * k));
    refused += admission.Refused(1, utc_ms, kNow_s) != nullptr;
  }
  CHECK(refused == 0);
  // Ten seconds at ten thousand a second, also with invented times in the future.
  for (const std::int64_t ahead_ms : {0, 50'000'000}) {
    int passed = 0;
    Admission other(50, 5'000'000);
    for (int k = 0; k < 100'000; ++k) {
      const double now_s = kNow_s + 1e-4 * k;
      const auto utc_ms = static_cast<std::int64_t>(1e3 * now_s) + ahead_ms;
      passed += other.Refused(1, utc_ms, now_s) == nullptr;
    }
    CHECK(passed <= Admission::kBurst + 50 * 10 + 1);
    CHECK(other.Refused(2, 1'800'000'000'000, kNow_s + 10) == nullptr);
  }
  // Times invented in the past pass for a backlog, until the day's number is reached.
  Admission daily(50, 1000);
  int passed = 0;
  for (int k = 0; k < 5000; ++k) {
    passed += daily.Refused(1, 1'700'000'000'000 + 1000 * k, kNow_s) == nullptr;
  }
  CHECK(passed == 1000);
  CHECK(daily.Refused(1, 1'800'000'000'000, kNow_s + 86400) == nullptr);
}

}  // namespace plumbline::plant::stream_ledger_test
