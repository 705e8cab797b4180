// Codec of plumbline-mesh's response, complete and damaged.
#include <catch2/catch.hpp>
#include <cstring>

#include "app/cell/scene/mesh_format.h"
#include "tests/app/cell/scene/shapes.h"

namespace plumbline::mesh_message_test {

using namespace plumbline::cell;

TEST_CASE("a response is decoded as sent; an incomplete one is refused") {
  RawMesh raw;
  raw.mesh = test::Cuboid({1, 2, 3});
  raw.other_elements = 5;
  raw.outside = {"wood.png", "x.mtl"};
  raw.outside_count = 9;
  raw.largest_coordinate = 4700123.4;
  const auto bytes = EncodeMeshResponse(raw);
  CHECK(bytes.size() <= MaxMeshResponseBytes({.triangles = 12}));
  const auto answer = DecodeMeshResponse(bytes, {});
  REQUIRE(answer);
  REQUIRE(*answer);
  const RawMesh& back = answer->value();
  CHECK(back.mesh.vertices_O == raw.mesh.vertices_O);
  CHECK(back.mesh.triangles == raw.mesh.triangles);
  CHECK(back.outside == raw.outside);
  CHECK(back.outside_count == 9);
  CHECK(back.largest_coordinate == 4700123.4);
  CHECK(back.other_elements == 5);
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CHECK_FALSE(DecodeMeshResponse(std::span(bytes).first(size), {}));
  }
  auto longer = bytes;
  longer.push_back(0);
  CHECK_FALSE(DecodeMeshResponse(longer, {}));
  CHECK_FALSE(DecodeMeshResponse(bytes, {.triangles = 11}));
}

TEST_CASE("an error text is made printable and limited in length") {
  const auto told = [](const std::string& why) {
    const auto answer = DecodeMeshResponse(EncodeMeshResponse(Result<RawMesh>(Error{why})), {});
    REQUIRE(answer);
    REQUIRE_FALSE(*answer);
    return answer->error();
  };
  CHECK(told("no \x1b[31mSTL\n") == "no ?[31mSTL?");
  CHECK(told(std::string(100000, 'a')).size() == kLongestReason);
  CHECK_FALSE(DecodeMeshResponse(EncodeMeshResponse(Result<RawMesh>(Error{""})), {}));
}

TEST_CASE("implausible counts are refused") {
  RawMesh raw;
  raw.mesh = test::Cuboid({1, 2, 3});
  auto bytes = EncodeMeshResponse(raw);
  const std::uint64_t many = ~std::uint64_t{0} / 12 + 1;
  std::memcpy(bytes.data() + 24, &many, sizeof many);  // vertices
  CHECK_FALSE(DecodeMeshResponse(bytes, {.triangles = ~std::uint64_t{0} / 64}));
}

}  // namespace plumbline::mesh_message_test
