#include <catch2/catch.hpp>

#include "drivers/robot/codec.h"
#include "tests/drivers/robot/small_profile.h"

namespace plumbline::read_plan_test {

using namespace plumbline::robot;

namespace {

constexpr RegisterTable kHolding = RegisterTable::kHolding, kCoil = RegisterTable::kCoil;

/// Joints in a block of 12 at 0; payload and refresh counter in one of 10 at 100.
RobotProfile SplitProfile() {
  RobotProfile profile = SmallProfile();
  profile.blocks = {{kHolding, 0, 12}, {kHolding, 100, 10}};
  profile.payload_mass = ValueAt(100, RegisterType::kUint16, 1);
  profile.sequence = ValueAt(104, RegisterType::kUint32, 1);
  return profile;
}

}  // namespace

TEST_CASE("joints and load in one block need no closing over TCP") {
  RobotProfile profile = SmallProfile();
  profile.sequence = ValueAt(3, RegisterType::kUint16, 1);
  const ReadPlan plan = PlanReading(profile, false, true);
  CHECK(plan.steps.size() == 1);
  CHECK(plan.markers.empty());
  CHECK_FALSE(plan.compares_refresh);
}

TEST_CASE("a refresh counter is read first and last if joints and load lie in two blocks") {
  const ReadPlan plan = PlanReading(SplitProfile(), false, false);
  CHECK(plan.compares_refresh);
  REQUIRE(plan.steps.size() == 2);
  CHECK(plan.steps[0].block.first == 100);
  CHECK(plan.steps[0].place == 12);
  CHECK(plan.steps[1].place == 0);
  CHECK(plan.markers == std::vector<RegisterBlock>{{kHolding, 104, 2}});
}

TEST_CASE("on a serial line the markers contain the counter and look like nothing else") {
  const ReadPlan plan = PlanReading(SplitProfile(), true, true);
  REQUIRE(plan.markers.size() >= 4);
  for (std::size_t k = 0; k < plan.markers.size(); ++k) {
    const RegisterBlock& marker = plan.markers[k];
    INFO("marker of " << marker.count << " from " << marker.first);
    CHECK(marker.first >= 100);
    CHECK(marker.first <= 104);
    CHECK(marker.first + marker.count >= 106);
    CHECK(marker.first + marker.count <= 110);
    CHECK(marker.count != 8);  // a push slot
    for (std::size_t other = 0; other < k; ++other)
      CHECK(marker.count != plan.markers[other].count);
  }
  CHECK(plan.markers[0].count % 2 == 0);
}

TEST_CASE("a profile whose responses a serial line cannot tell apart is refused with the remedy") {
  struct Row {
    const char* what;
    std::vector<RegisterBlock> blocks;
    bool push;
    const char* message;  ///< empty: accepted
  };
  const Row rows[] = {
      {"one block", {{kHolding, 0, 4}}, true, ""},
      {"other counts", {{kHolding, 0, 12}, {kHolding, 100, 11}}, true, ""},
      {"other tables", {{kHolding, 0, 12}, {RegisterTable::kInput, 100, 12}}, true, ""},
      {"same counts",
       {{kHolding, 0, 12}, {kHolding, 100, 12}},
       true,
       "reads 12 registers from 100 and 12 from 0: on a serial line"},
      {"coils in as many bytes",
       {{kHolding, 0, 4}, {kCoil, 0, 9}, {kCoil, 100, 16}},
       true,
       "read 8 coils more"},
      {"a push slot", {{kHolding, 0, 8}}, true, "8 from 100 (a push slot)"},
      {"no push", {{kHolding, 0, 8}}, false, ""},
      {"nothing shorter", {{kHolding, 0, 1}}, true, "read at least 2 registers more in a [[read]]"},
  };
  for (const Row& row : rows) {
    INFO(row.what);
    RobotProfile profile = SmallProfile();
    profile.blocks = row.blocks;
    const auto fault = SerialFault(profile, row.push);
    CHECK(fault.has_value() == (*row.message != 0));
    if (fault) CHECK_THAT(*fault, Catch::Contains(row.message));
  }
}

}  // namespace plumbline::read_plan_test
