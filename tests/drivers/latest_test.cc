#include "drivers/latest.h"

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <cstdint>
#include <thread>
#include <vector>

namespace plumbline::latest_test {

using plumbline::Latest;

namespace {

using Block = std::array<std::uint32_t, 64>;

void Fill(Block& block, std::uint32_t number) {
  for (std::uint32_t i = 0; i < block.size(); ++i) block[i] = number + i;
}

bool IsWhole(const Block& block) {
  for (std::uint32_t i = 0; i < block.size(); ++i) {
    if (block[i] != block[0] + i) return false;
  }
  return true;
}

}  // namespace

TEST_CASE("Latest: readers get the newest value, and a guard preserves its own", "[latest]") {
  Latest<int> latest(1, 7);
  CHECK(*latest.Read() == 7);
  {
    const auto guard = latest.Read();
    for (int i = 8; i < 20; ++i) {
      latest.Begin() = i;
      latest.Publish();
    }
    CHECK(*guard == 7);
  }
  CHECK(*latest.Read() == 19);
}

TEST_CASE("Latest: a value is not visible before it is published", "[latest]") {
  Latest<int> latest(1, 1);
  latest.Begin() = 2;
  CHECK(*latest.Read() == 1);
  latest.Publish();
  CHECK(*latest.Read() == 2);
}

TEST_CASE("Latest: buffers are allocated from the start and do not move", "[latest]") {
  Latest<std::vector<int>> latest(1, std::vector<int>(100, 3));
  for (int i = 0; i < 5; ++i) {
    REQUIRE(latest.Begin().size() == 100);
    latest.Publish();
  }
}

TEST_CASE("Latest: a million concurrent reads, none torn, none older than the previous one",
          "[latest]") {
  constexpr int kReaders = 3;
  constexpr int kReads = 1'000'000 / kReaders + 1;
  Block first;
  Fill(first, 0);
  Latest<Block> latest(kReaders, first);
  std::atomic<int> torn{0}, backwards{0}, running{kReaders};
  std::vector<std::thread> readers;
  readers.reserve(kReaders);
  for (int r = 0; r < kReaders; ++r) {
    readers.emplace_back([&] {
      std::uint32_t last = 0;
      for (int i = 0; i < kReads; ++i) {
        const auto guard = latest.Read();
        if (!IsWhole(*guard)) ++torn;
        if ((*guard)[0] < last) ++backwards;
        last = (*guard)[0];
      }
      --running;
    });
  }
  for (std::uint32_t number = 1; running > 0; ++number) {
    Fill(latest.Begin(), number);
    latest.Publish();
  }
  for (std::thread& reader : readers) reader.join();
  CHECK(torn == 0);
  CHECK(backwards == 0);
  CHECK(IsWhole(*latest.Read()));
}

}  // namespace plumbline::latest_test
