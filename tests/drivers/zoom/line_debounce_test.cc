#include "drivers/zoom/line_debounce.h"

#include <catch2/catch.hpp>

namespace plumbline::line_debounce_test {

using namespace plumbline::zoom;

TEST_CASE("a spike is ignored, a pulse is a motion reported once") {
  LineDebounce line(0.005);
  line.Edge(true, 1.000);
  line.Edge(false, 1.004);
  CHECK_FALSE(line.TakeMoved(2));
  line.Edge(true, 3.000);
  line.Edge(false, 3.006);
  CHECK_FALSE(line.Moving(4));
  CHECK(line.TakeMoved(4));
  CHECK_FALSE(line.TakeMoved(4.1));
}

TEST_CASE("a constant active level is a continuing motion") {
  LineDebounce line(0.005);
  line.Edge(true, 1);
  CHECK_FALSE(line.Moving(1.004));
  CHECK_FALSE(line.TakeMoved(1.004));
  for (double now_s = 1.006; now_s < 2; now_s += 0.1) {
    CHECK(line.Moving(now_s));
    CHECK(line.TakeMoved(now_s));
  }
  line.Edge(false, 2);
  CHECK(line.TakeMoved(2.1));
  CHECK_FALSE(line.TakeMoved(2.2));
}

TEST_CASE("a bouncing contact and a pulsed motor count as one burst; spikes far apart do not") {
  LineDebounce bouncing(0.005), spikes(0.005);
  for (int i = 0; i < 10; ++i) {
    bouncing.Edge(true, 1 + 0.001 * i);
    bouncing.Edge(false, 1.0005 + 0.001 * i);
    spikes.Edge(true, 1 + 0.1 * i);
    spikes.Edge(false, 1.0005 + 0.1 * i);
  }
  CHECK(bouncing.TakeMoved(3));
  CHECK_FALSE(spikes.TakeMoved(3));
}

TEST_CASE("edges to the current level are ignored; with zero debounce every edge counts") {
  LineDebounce line(0.005);
  line.Edge(false, 0.9);
  line.Edge(true, 1);
  line.Edge(true, 1.003);
  CHECK(line.TakeMoved(1.006));
  LineDebounce immediate(0);
  immediate.Edge(true, 1);
  immediate.Edge(false, 1);
  CHECK(immediate.TakeMoved(1));
}

}  // namespace plumbline::line_debounce_test
