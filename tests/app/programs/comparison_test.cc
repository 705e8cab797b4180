// Comparison of two versions of a program.
#include "app/programs/correction/comparison.h"

#include <catch2/catch.hpp>

#include "app/programs/correction/rewriting.h"
#include "tests/app/programs/toy_brand.h"

namespace plumbline::comparison_test {

using namespace plumbline::programs;

namespace {

ProgramComparison Compared(const std::string& before, const std::string& after) {
  const test::ToyBrand brand;
  return Compare(brand, brand.Read({{"a.toy", before}}).program,
                 brand.Read({{"a.toy", after}}).program);
}

}  // namespace

TEST_CASE("joints that differ are compared as joints") {
  const ProgramComparison comparison =
      Compared("joints a 1 2 3 4 5 6\n", "joints a 1 2.5 3 4 5 5.9\n");
  REQUIRE(comparison.points.size() == 1);
  CHECK(comparison.points.front().kind == PointKind::kJoints);
  CHECK(comparison.points.front().joint == Approx(0.5));
}

TEST_CASE("the line of a mark does not count, whatever ends it and whatever is before it") {
  const std::string mark = "# " + MarkText({"0.1.0", "2026-11-29", "0123456789ab", "0123456789ab"});
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    for (const std::string start : {"", "\xEF\xBB\xBF"}) {
      CAPTURE(end.size(), start.size());
      const std::string program = "# a" + end + "point p 1 2 3 0 0 0" + end;
      CHECK(Compared(start + program, start + mark + end + program).others.empty());
      CHECK_FALSE(Compared(start + program, start + "# b" + end + program).others.empty());
    }
  }
}

TEST_CASE("after insertions the old points are compared with their own") {
  const std::string head = "point p 0 0 0 0 0 0\nsub main starts\nJ p\n";
  const ProgramComparison comparison =
      Compared(head + "L p:100,0,0,0,0,0\nL p:100,50,0,0,0,0\nend\n",
               head +
                   "L p:50,0,0.1,0,0,0\nL p:100,0,0.2,0,0,0\nL p:100,25,0.1,0,0,0\n"
                   "L p:100,50,0.3,0,0,0\nend\n");
  CHECK(comparison.compared == 3);
  CHECK(comparison.inserted == 2);
  REQUIRE(comparison.points.size() == 2);
  CHECK(comparison.points[0].distance_m == Approx(2e-4));
  CHECK(comparison.points[1].distance_m == Approx(3e-4));
  CHECK_FALSE(comparison.others.empty());
}

}  // namespace plumbline::comparison_test
