#include "firmware-like/motion_offset/packet_sequence.h"

#include <catch2/catch.hpp>
#include <vector>

namespace plumbline::packet_sequence_test {

using namespace plumbline::motion_offset;

namespace {

std::vector<PacketOrder> Orders(const std::vector<std::uint64_t>& numbers, int largest_gap = 5) {
  PacketSequence sequence(largest_gap);
  std::vector<PacketOrder> orders;
  for (const std::uint64_t number : numbers) orders.push_back(sequence.Next(number).order);
  return orders;
}

}  // namespace

TEST_CASE("repeated and earlier numbers are recognised, whatever the step") {
  using enum PacketOrder;
  CHECK(Orders({1, 2, 2, 3}) == std::vector{kNew, kNew, kDuplicate, kNew});
  CHECK(Orders({100, 112, 124, 112, 136}) == std::vector{kNew, kNew, kNew, kOld, kNew});
}

TEST_CASE("lost packets are counted in steps of the sequence") {
  PacketSequence sequence(5);
  for (const std::uint64_t number : {1000, 1004, 1008}) sequence.Next(number);
  CHECK(sequence.Next(1012).lost == 0);
  CHECK(sequence.Next(1024).lost == 2);
}

TEST_CASE("a number far ahead is ignored, and two of them are another sequence") {
  using enum PacketOrder;
  CHECK(Orders({4, 8, 900000, 12, 16}) == std::vector{kNew, kNew, kImplausible, kNew, kNew});
  CHECK(Orders({4, 8, 900000, 900004, 900008}) ==
        std::vector{kNew, kNew, kImplausible, kRenumbered, kNew});
}

TEST_CASE("a burst of old packets never becomes the sequence") {
  using enum PacketOrder;
  CHECK(Orders({400, 404, 200, 204, 208, 408}) == std::vector{kNew, kNew, kOld, kOld, kOld, kNew});
}

TEST_CASE("a number of 32 bits wraps") {
  using enum PacketOrder;
  CHECK(Orders({0xFFFFFFFE, 0xFFFFFFFF, 0, 1}) == std::vector{kNew, kNew, kNew, kNew});
}

}  // namespace plumbline::packet_sequence_test
