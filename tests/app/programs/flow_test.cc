// What holds at each motion, on all paths through a program.
#include "app/programs/flow/flow.h"

#include <catch2/catch.hpp>

#include "tests/app/programs/toy_brand.h"

namespace plumbline::flow_test {

using namespace plumbline::programs;
using Catch::Contains;

namespace {

struct Analysed {
  Program program;
  Flow flow;
};

Analysed Analyse(const std::string& text, const EntryState& entry = {}) {
  const test::ToyBrand brand;
  Analysed analysed{brand
                        .Read({{"a.toy",
                                "point p 1 2 3 0 0 0\npoint q 4 5 6 0 0 0\n"
                                "tool one 0 0 100 0 0 0\ntool other 0 0 200 0 0 0\n"
                                "tool same 0 0 100 0 0 0\n" +
                                    text}})
                        .program,
                    {}};
  analysed.flow = FlowOf(analysed.program, entry);
  return analysed;
}

/// The tool of motion k, or "?" and why it is not known.
std::string ToolAt(const Analysed& analysed, std::size_t k) {
  const SettingAt& tool = analysed.flow.motions.at(k)[Slot::kTool];
  return tool.known() ? tool.key : "?" + tool.unknown;
}

}  // namespace

TEST_CASE("a setting holds until the next one") {
  const Analysed a = Analyse("sub main starts\nuse one\nJ p\nuse other\nJ q\nJ p\nend\n");
  CHECK(ToolAt(a, 0) == "one");
  CHECK(ToolAt(a, 1) == "other");
  CHECK(ToolAt(a, 2) == "other");
}

TEST_CASE("nothing is known where a program is started, unless the user states it") {
  const std::string text = "sub main starts\nJ p\nuse one\nJ q\nend\n";
  CHECK_THAT(ToolAt(Analyse(text), 0), Contains("main may be started"));
  EntryState entry;
  entry.keys[0] = "other";
  CHECK(ToolAt(Analyse(text, entry), 0) == "other");
}

TEST_CASE("a motion knows after which others, and from the start of the program, it may begin") {
  const Analysed a = Analyse("sub main starts\nlabel again\nJ p\nJ q\nbranch again\nend\n");
  CHECK(a.flow.motions[0].at_start);
  CHECK(a.flow.motions[0].starts == std::vector<std::size_t>{1});
  CHECK_FALSE(a.flow.motions[0].previous);
  CHECK_FALSE(a.flow.motions[1].at_start);
  CHECK(a.flow.motions[1].previous == 0U);
}

TEST_CASE("a setting that no line makes has an empty key") {
  CHECK(ToolAt(Analyse("sub main starts\nJ p\nend\n"), 0).empty());
}

TEST_CASE("branches with different tools conflict, and both lines are named") {
  const Analysed a = Analyse(
      "sub main starts\nbranch x\nuse one\njump y\nlabel x\nuse other\nlabel y\nJ p\nend\n");
  CHECK_THAT(ToolAt(a, 0), Contains("one (a.toy:8)") && Contains("other (a.toy:11)"));
}

TEST_CASE("branches whose tools have equal values agree") {
  const Analysed a =
      Analyse("sub main starts\nbranch x\nuse one\njump y\nlabel x\nuse same\nlabel y\nJ p\nend\n");
  CHECK_FALSE(ToolAt(a, 0).starts_with("?"));
}

TEST_CASE("a loop that changes the tool conflicts at its start and nowhere else") {
  const Analysed a = Analyse(
      "sub main starts\nuse one\nlabel again\nJ p\nuse other\nJ q\nbranch again\nJ p\nend\n");
  CHECK_THAT(ToolAt(a, 0), Contains("depending on the path"));
  CHECK(ToolAt(a, 1) == "other");
  CHECK(ToolAt(a, 2) == "other");
}

TEST_CASE("a routine called with two tools has a conflict, its callers do not") {
  const Analysed a = Analyse(
      "sub main starts\nuse one\ncall weld\nJ p\nuse other\ncall weld\nJ q\nend\n"
      "sub weld\nJ p\nend\n");
  CHECK(ToolAt(a, 0) == "one");
  CHECK(ToolAt(a, 1) == "other");
  CHECK_THAT(ToolAt(a, 2), Contains("a.toy:7") && Contains("a.toy:10"));
}

TEST_CASE("what a routine sets holds after its call") {
  const Analysed a = Analyse(
      "sub main starts\nuse one\ncall change\nJ p\nend\nsub change\nuse other\nreturn\nend\n");
  CHECK(ToolAt(a, 0) == "other");
}

TEST_CASE("recursion ends, and routines that nobody calls count as started") {
  const Analysed a = Analyse(
      "sub main starts\nuse one\ncall again\nend\nsub again\nJ p\nbranch out\ncall again\n"
      "label out\nend\nsub alone\nJ q\nend\n");
  CHECK(ToolAt(a, 0) == "one");
  CHECK_THAT(ToolAt(a, 1), Contains("alone may be started"));
}

TEST_CASE("a ring of routines that nobody enters is analysed, too") {
  const Analysed a = Analyse("sub a\nuse one\ncall b\nend\nsub b\nJ p\ncall a\nend\n");
  REQUIRE(a.flow.motions.size() == 1);
  CHECK(a.flow.motions[0].reached);
}

TEST_CASE("a routine that is in no file may change everything") {
  const Analysed a = Analyse("sub main starts\nuse one\ncall elsewhere\nJ p\nend\n");
  CHECK_THAT(ToolAt(a, 0), Contains("elsewhere") && Contains("in none of the files"));
}

TEST_CASE("lines after a jump are not reached") {
  const Analysed a = Analyse("sub main starts\nuse one\njump x\nJ p\nlabel x\nJ q\nend\n");
  CHECK_FALSE(a.flow.motions[0].reached);
  CHECK(a.flow.motions[1].reached);
}

TEST_CASE("the motion before is known on a straight path only") {
  const Analysed a = Analyse(
      "sub main starts\nuse one\nJ p\nJ q\nwait\nJ p\nJ computed\nJ p\nlabel again\nJ q\nJ p\n"
      "branch again\nend\n");
  const auto& motions = a.flow.motions;
  CHECK_FALSE(motions[0].previous);
  CHECK(motions[1].previous == 0U);
  CHECK_FALSE(motions[2].previous);
  CHECK_THAT(motions[4].previous_unknown, Contains("computed target"));
  CHECK_THAT(motions[5].previous_unknown, Contains("reached from"));
  CHECK(motions[5].starts == std::vector<std::size_t>{4, 6});
  CHECK(motions[6].previous == 5U);
}

TEST_CASE("uses of a point are listed with what forbids a correction") {
  const Analysed a = Analyse("sub main starts\nuse one\nJ p\ntouch p\npeek q\nC q p\nend\n");
  REQUIRE(a.flow.uses[0].size() == 3);
  CHECK(a.flow.uses[0][2].reason == "it is copied");
  REQUIRE(a.flow.uses[1].size() == 2);
  CHECK(a.flow.uses[1][0].role == PointUse::Role::kVia);
  CHECK(a.flow.uses[1][1].reason.empty());
}

TEST_CASE("a long program takes steps in proportion to its length") {
  std::string text = "sub main starts\nuse one\nlabel again\n";
  for (int k = 0; k < 20000; ++k) text += "J p\nbranch again\n";
  const Analysed a = Analyse(text + "end\n");
  CHECK(ToolAt(a, 19999) == "one");
}

}  // namespace plumbline::flow_test
