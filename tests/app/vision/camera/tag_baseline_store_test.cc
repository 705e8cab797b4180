#include "app/vision/camera/tag_baseline_store.h"

#include <catch2/catch.hpp>
#include <fstream>

#include "tests/app/temporary_folder.h"
#include "tests/app/vision/camera/reference_tag_scene.h"
#include "tests/file_text.h"

namespace plumbline::tag_baseline_store_test {

using namespace plumbline::vision;
using namespace plumbline::test;

TEST_CASE("baselines survive a restart exactly") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/fixed_marks.json";
  const target::Body cell = CellTags();
  const lens::KnownLens lens{TagSceneLens(), lens::LensCovariance::Zero()};
  const TagBaseline baseline =
      BaselineAt(lens, cell, ObserveTags(lens.lens, cell, CellInCamera(), 0.05, 3), CellInCamera());
  std::string problem;
  {
    TagBaselineStore store(path, cell, problem);
    CHECK(problem.empty());
    CHECK_FALSE(store.Find(7));
    CHECK(store.Store(7, baseline));
    CHECK(store.Store(8, baseline));
    CHECK(store.StoreContradiction(8));
    CHECK(store.StoreContradiction(9));
    CHECK(store.Store(8, baseline));  // the tags agree after all
  }
  const TagBaselineStore again(path, cell, problem);
  CHECK(problem.empty());
  const auto read = again.Find(7);
  REQUIRE(read);
  CHECK(read->X_CK.p == baseline.X_CK.p);
  CHECK(read->X_CK.R == baseline.X_CK.R);
  REQUIRE(read->tags.size() == baseline.tags.size());
  CHECK(read->tags.at(2).residual_px[3] == baseline.tags.at(2).residual_px[3]);
  CHECK(read->tags.at(4).covariance == baseline.tags.at(4).covariance);
  CHECK(again.Find(8));
  CHECK_FALSE(again.IsContradicted(8));
  CHECK(again.IsContradicted(9));
  TagBaseline bent = baseline;  // as in a file edited by hand
  bent.X_CK.R *= 1.1;
  CHECK_FALSE(TagBaselinesFromJson(TagBaselinesJson({{{7, bent}}, {}}, cell), cell).ok());
  bent = baseline;
  bent.tags.at(2).covariance(3, 3) = -1;
  CHECK_FALSE(TagBaselinesFromJson(TagBaselinesJson({{{7, bent}}, {}}, cell), cell).ok());

  target::Body other = cell;
  other.tags[1].X_KM.p.x() += 1e-4;  // declared otherwise: what was left then means nothing now
  const TagBaselineStore fresh(path, other, problem);
  CHECK(problem.empty());
  CHECK_FALSE(fresh.Find(7));
}

TEST_CASE("an unreadable file is reported and replaced") {
  const TemporaryFolder folder;
  const std::string path = folder.path() + "/fixed_marks.json";
  const target::Body cell = CellTags();
  for (const char* text : {"", "{", "[]", "{\"schema\": 2}", "{\"schema\":1,\"marks\":[]}",
                           "{\"schema\":1,\"marks\":7,\"lenses\":{\"x\":{}}}"}) {
    CAPTURE(text);
    std::ofstream(path) << text;
    std::string problem;
    TagBaselineStore store(path, cell, problem);
    CHECK_FALSE(store.Find(1));
  }
  std::ofstream(path) << "{";
  std::string problem;
  TagBaselineStore store(path, cell, problem);
  CHECK_THAT(problem, Catch::Contains("verified again without their history"));
  CHECK(store.Store(1, {}));
  CHECK(FileText(path + ".unread") == "{");  // preserved for inspection or a newer version
  TagBaselineStore again(path, cell, problem = "");
  CHECK(problem.empty());
  CHECK(again.Find(1));
  std::string unused;
  TagBaselineStore nowhere("/nonexistent/marks.json", cell, unused);
  CHECK_FALSE(nowhere.Store(1, {}));
}

}  // namespace plumbline::tag_baseline_store_test
