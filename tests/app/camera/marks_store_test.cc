#include "app/camera/marks_store.h"

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/app/camera/marks_scene.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

using namespace plumbline;
using namespace plumbline::test;

TEST_CASE("marks are remembered over a restart, to the last digit") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/fixed_marks.json";
  const Body cell = CellMarks();
  const KnownLens lens{MarksLens(), LensCovariance::Zero()};
  const MarksMemory memory =
      Remember(lens, cell, SeenMarks(lens.lens, cell, CellInCamera(), 0.05, 3), CellInCamera());
  std::string problem;
  {
    MarksStore store(path, cell, problem);
    CHECK(problem.empty());
    CHECK_FALSE(store.Find(7));
    CHECK(store.Keep(7, memory));
    CHECK(store.Keep(8, memory));
  }
  const MarksStore again(path, cell, problem);
  CHECK(problem.empty());
  const auto read = again.Find(7);
  REQUIRE(read);
  CHECK(read->X_CK.p == memory.X_CK.p);
  CHECK(read->X_CK.R == memory.X_CK.R);
  REQUIRE(read->tags.size() == memory.tags.size());
  CHECK(read->tags.at(2).residual_px[3] == memory.tags.at(2).residual_px[3]);
  CHECK(read->tags.at(4).covariance == memory.tags.at(4).covariance);
  CHECK(again.Find(8));
  MarksMemory bent = memory;  // as a file that somebody wrote in may say
  bent.X_CK.R *= 1.1;
  CHECK_FALSE(MarksFromJson(MarksJson({{7, bent}}, cell), cell).ok());
  bent = memory;
  bent.tags.at(2).covariance(3, 3) = -1;
  CHECK_FALSE(MarksFromJson(MarksJson({{7, bent}}, cell), cell).ok());

  Body other = cell;
  other.tags[1].X_KM.p.x() += 1e-4;  // declared otherwise: what was left then means nothing now
  const MarksStore fresh(path, other, problem);
  CHECK(problem.empty());
  CHECK_FALSE(fresh.Find(7));
}

TEST_CASE("a file that is none is told, and written anew") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/fixed_marks.json";
  const Body cell = CellMarks();
  for (const char* text : {"", "{", "[]", "{\"schema\": 2}", "{\"schema\":1,\"marks\":[]}",
                           "{\"schema\":1,\"marks\":7,\"lenses\":{\"x\":{}}}"}) {
    CAPTURE(text);
    std::ofstream(path) << text;
    std::string problem;
    MarksStore store(path, cell, problem);
    CHECK_FALSE(store.Find(1));
  }
  std::ofstream(path) << "{";
  std::string problem;
  MarksStore store(path, cell, problem);
  CHECK_THAT(problem, Catch::Contains("the marks are looked at anew"));
  CHECK(store.Keep(1, {}));
  CHECK(FileText(path + ".unread") == "{");  // for whoever wants to know, or a newer version's
  MarksStore again(path, cell, problem = "");
  CHECK(problem.empty());
  CHECK(again.Find(1));
  std::string unused;
  MarksStore nowhere("/nonexistent/marks.json", cell, unused);
  CHECK_FALSE(nowhere.Keep(1, {}));
}
