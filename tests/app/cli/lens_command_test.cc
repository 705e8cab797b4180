// plumbline lens on a store with views, as written by the daemon.
#include <catch2/catch.hpp>
#include <filesystem>

#include "app/base/text/json_text.h"
#include "app/cli/commands.h"
#include "app/vision/lens/calibration.h"
#include "app/vision/lens_store/lens_store.h"
#include "app/vision/lens_store/stored_views.h"
#include "tests/app/cli/run_command.h"
#include "tests/app/temporary_folder.h"
#include "tests/app/vision/lens/rendered_views.h"
#include "tests/file_text.h"

namespace plumbline::lens_command_test {

using namespace plumbline::cli;
using test::Answer;

namespace {

Answer RunLens(const std::string& arguments) {
  return test::RunCommand(AddLensCommand, "lens " + arguments);
}

/// A lens calibrated with its views, and one that came without.
void Fill(const std::string& path) {
  const target::Board board;
  const auto views = vision::NoisyViews(vision::DrawViews({}, board, 3), board, 0.03, 3);
  const vision::LensCalibration solved = vision::CalibrateLens(board, views, {1920, 1080});
  REQUIRE(solved.accepted);
  vision::LensEntry entry;
  entry.key = {"SN-1", "GREY 1920x1080@20", 4000, std::nullopt};
  entry.lens = solved.lens;
  entry.covariance = solved.covariance;
  entry.size = {1920, 1080};
  entry.rms_px = solved.rms_px;
  entry.uncertainty_px = solved.uncertainty.max_px;
  entry.board = WordsOf(board);
  entry.temp_C = 23.5;
  entry.declared.no_window = true;
  entry.utc = "2026-01-01T00:00:00Z";
  entry.corners = vision::EncodeViews({board, views});
  auto store = vision::LensStore::Open(path);
  REQUIRE(store);
  REQUIRE(store.value().Append(entry));
  entry.corners.clear();
  REQUIRE(store.value().Append(entry));
  entry.corners = {'{', '}'};
  REQUIRE(store.value().Append(entry));
}

}  // namespace

TEST_CASE("lenses are listed, and solved again from their views") {
  const test::TemporaryFolder folder;
  const std::string where = " --state " + folder.path(), out = folder.path() + "/lens.json";
  const Answer none = RunLens("list" + where);
  CHECK(none.exit_code == 1);
  CHECK_THAT(none.err, Catch::Contains("the lens store does not exist yet"));
  Fill(folder.path() + "/lenses.sqlite");

  const Answer list = RunLens("list" + where);
  CHECK(list.exit_code == 0);
  CHECK_THAT(list.out, Catch::Contains("SN-1; GREY 1920x1080@20, chessboard 17x11, 10 mm; declared "
                                       "no_window\n") &&
                           Catch::Contains("23.50 C") && Catch::Contains(" 20 "));

  const Answer solved = RunLens("solve 1 --no-window --json " + out + where);
  INFO(solved.err);
  CHECK(solved.exit_code == 0);
  CHECK_THAT(solved.out, Catch::Contains("accepted") &&
                             Catch::Contains("differs from the stored lens by") &&
                             Catch::Contains("over the image; declared no_window\n"));
  CHECK_THAT(solved.out.substr(0, solved.out.find('\n')),
             Catch::StartsWith("lens 1 as stored: f ") && Catch::EndsWith("; declared no_window"));
  const auto json = text::JsonOrNull(test::FileText(out));
  CHECK(json["accepted"] == true);
  CHECK(json["declared"].dump() == "[\"no_window\"]");
  auto store = vision::LensStore::OpenForReading(folder.path() + "/lenses.sqlite");
  REQUIRE(store);
  const auto kept = store.value().All();
  REQUIRE(kept);
  CHECK(json["fx"].get<double>() == Approx(kept->front().lens.fx).epsilon(1e-6));
  // A stricter limit refuses the same views; the store is not changed.
  const Answer strict = RunLens("solve 1 --acceptable-px 0.001" + where);
  CHECK(strict.exit_code == 0);
  CHECK_THAT(strict.out, Catch::Contains("refused:"));
  CHECK(kept->size() == 3);
}

TEST_CASE("lenses that cannot be solved again are reported with the reason") {
  const test::TemporaryFolder folder;
  const std::string where = " --state " + folder.path(), store = folder.path() + "/lenses.sqlite";
  Fill(store);
  CHECK_THAT(RunLens("solve 2" + where).err, Catch::Contains("without its views"));
  CHECK_THAT(RunLens("solve 3" + where).err, Catch::Contains("the views of lens 3"));
  CHECK_THAT(RunLens("solve 9" + where).err, Catch::Contains("no lens 9"));
  CHECK(RunLens("solve 9" + where).exit_code == 1);
  const auto size = std::filesystem::file_size(store);
  CHECK(RunLens("solve 1 --json " + store + where).exit_code == 2);
  CHECK(std::filesystem::file_size(store) == size);
  CHECK(RunLens("solve 1 --json /no/such/lens.json" + where).exit_code == 2);
}

}  // namespace plumbline::lens_command_test
