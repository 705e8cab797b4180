#include "app/daemon/lifeline.h"

#include <catch2/catch.hpp>

using plumbline::Lifeline;

TEST_CASE("a thread that comes round is alive, one that stands still is named after its patience") {
  std::uint64_t cycle = 0, images = 7;
  Lifeline lifeline;
  lifeline.Add("cycle", 2, [&] { return cycle; });
  lifeline.Add("images", 10, [&] { return images; });

  CHECK(lifeline.Look(100).thread.empty());  // counts from the first look
  CHECK(lifeline.Look(102).thread.empty());
  CHECK(lifeline.Look(102.1).thread == "cycle");
  CHECK(lifeline.Look(104).for_s == Approx(4));
  ++cycle;
  CHECK(lifeline.Look(104.5).thread.empty());
  CHECK(lifeline.Look(106).thread.empty());
  for (int k = 0; k < 10; ++k) {
    ++cycle;
    CHECK(lifeline.Look(106 + 0.4 * k).thread.empty());
  }
  ++cycle;
  CHECK(lifeline.Look(110.1).thread == "images");
}

TEST_CASE(
    "where several stand still the first one added is named: what others wait for comes first") {
  Lifeline lifeline;
  lifeline.Add("a", 3, [] { return 1; });
  lifeline.Add("b", 1, [] { return 1; });
  lifeline.Look(0);
  CHECK(lifeline.Look(2).thread == "b");
  CHECK(lifeline.Look(4).thread == "a");
}
