// Model stores of released versions, read by the present code.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>

#include "app/cell/model_store/model_json.h"
#include "app/cell/model_store/model_store.h"
#include "tests/app/temporary_folder.h"
#include "tests/file_text.h"

namespace plumbline::released_test {

using namespace plumbline::cell;
using namespace plumbline::test;

namespace {

ModelStore Released(const TemporaryFolder& folder, int schema) {
  const std::string from = "tests/app/cell/model_store/released/schema_" + std::to_string(schema);
  INFO("no store of schema " << schema);
  REQUIRE(std::filesystem::exists(from));
  std::filesystem::copy(from, folder.path() + "/models");
  auto store = ModelStore::Open(folder.path());
  REQUIRE(store);
  return std::move(store).value();
}

void WriteOver(const std::string& path, const std::string& text) {
  std::filesystem::remove(path);
  std::ofstream(path) << text;
}

}  // namespace

TEST_CASE("a model store of every released schema opens, loses nothing, and works") {
  for (int schema = 1; schema <= kModelSchema; ++schema) {
    const TemporaryFolder folder;
    ModelStore store = Released(folder, schema);
    const auto state = store.State();
    REQUIRE(state);
    CHECK(*state == ModelState{1, 2, 3, {1, 2}});
    const auto versions = store.Versions();
    REQUIRE(versions);
    REQUIRE(versions->size() == 3);
    const ModelFacts& found = (*versions)[1].facts;
    CHECK(found.origin == ModelFacts::Origin::kDiagnosis);
    CHECK(found.date == "2026-11-21T10:20:55Z");
    CHECK(found.from == "DIAGNOSIS.json");
    CHECK(found.verdict == "explained");
    CHECK(found.effects == std::vector<std::string>{"joint_compliance"});
    CHECK(found.based_on == 1);
    CHECK(found.rms_before_mm == 2.418);
    CHECK(found.rms_after_mm == 0.0898);
    CHECK(found.change_mm == 3.25);
    CHECK(FileText(store.ReportFile(2)) == "<!doctype html><title>Plumbline</title>\n");
    CHECK(*store.Text(1) == "schema = 1\n# the cell as declared\n");
    CHECK((*versions)[0].facts.origin == ModelFacts::Origin::kDeclared);
    CHECK((*versions)[2].facts.origin == ModelFacts::Origin::kManual);
    CHECK_FALSE((*versions)[2].facts.rms_before_mm);
    // The same cell file: no new version is declared, and the applied one stays in force.
    CHECK(*store.Declare("schema = 1\n# the cell as declared\n", "cell.toml") == 1);
    CHECK(store.State()->applied == 2);
    CHECK(*store.RollBack() == 1);
    CHECK(*store.Declare("schema = 1\n# edited\n", "cell.toml") == 4);
  }
}

TEST_CASE("a model store of a newer version is refused with a remedy, and left unchanged") {
  const TemporaryFolder folder;
  ModelStore store = Released(folder, kModelSchema);
  const std::string file = folder.path() + "/models/state.json";
  WriteOver(file,
            "{\"schema\": 2, \"declared\": 1, \"applied\": 2, \"proposed\": 0, \"history\": []}");
  const std::string before = FileText(file);
  const auto state = store.State();
  REQUIRE_FALSE(state);
  CHECK_THAT(state.error(), Catch::Contains("written by a newer plumbline") &&
                                Catch::Contains("install that version again"));
  CHECK_FALSE(store.Declare("schema = 1\n# edited\n", "cell.toml"));
  CHECK_FALSE(store.Apply(1));
  CHECK_FALSE(store.RollBack());
  CHECK(FileText(file) == before);
  CHECK_FALSE(std::filesystem::exists(store.ModelFile(4)));
  WriteOver(folder.path() + "/models/0002.json", "{\"schema\": 2, \"origin\": \"diagnosis\"}");
  const auto facts = store.Facts(2);
  REQUIRE_FALSE(facts);
  CHECK_THAT(facts.error(), Catch::Contains("written by a newer plumbline"));
}

}  // namespace plumbline::released_test
