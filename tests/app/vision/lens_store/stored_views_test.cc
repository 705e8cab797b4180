#include "app/vision/lens_store/stored_views.h"

#include <catch2/catch.hpp>
#include <string>

namespace plumbline::stored_views_test {

using namespace plumbline::vision;

namespace {

StoredViews Some() {
  StoredViews stored;
  stored.board = {4, 3, 0.02, target::BoardKind::kCharuco, 0.015, "aruco-4x4-50"};
  for (int k = 0; k < 3; ++k) {
    vision::BoardView view;
    view.time_s = 100 + 0.05 * k;
    view.blur_px = 0.8;
    for (int i = 0; i < stored.board.corners(); ++i) {
      view.corners_px.emplace_back(100.123456789 + i, 200.5 + k);
      view.seen.push_back(i != k);
    }
    stored.views.push_back(view);
  }
  return stored;
}

}  // namespace

TEST_CASE("views survive a round trip to 1e-5 px") {
  const StoredViews kept = Some();
  const auto bytes = EncodeViews(kept);
  const auto read = DecodeViews(bytes);
  REQUIRE(read);
  CHECK(WordsOf(read->board) == WordsOf(kept.board));
  REQUIRE(read->views.size() == 3);
  for (std::size_t k = 0; k < 3; ++k) {
    CHECK(read->views[k].time_s == kept.views[k].time_s);
    CHECK(read->views[k].seen == kept.views[k].seen);
    CHECK((read->views[k].corners_px[5] - kept.views[k].corners_px[5]).norm() < 1e-5);
  }
  CHECK(std::string(bytes.begin(), bytes.end()).find("101.12346") != std::string::npos);
}

TEST_CASE("malformed views are refused with the reason") {
  const auto why = [](std::string text, const std::string& from, const std::string& to) {
    if (!from.empty()) text.replace(text.find(from), from.size(), to);
    const auto read =
        DecodeViews({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
    return read ? std::string("read") : read.error();
  };
  const auto bytes = EncodeViews(Some());
  const std::string sound(bytes.begin(), bytes.end());
  CHECK(why(sound, "", "") == "read");
  CHECK(why("", "", "") != "read");
  CHECK_THAT(why(sound, "\"schema\":1", "\"schema\":2"), Catch::Contains("schema"));
  CHECK_THAT(why(sound, "charuco", "hexagon"), Catch::Contains("unknown kind"));
  CHECK_THAT(why(sound, "\"columns\":4", "\"columns\":5"), Catch::Contains("number of points"));
  CHECK_THAT(why(sound, "\"columns\":4", "\"columns\":-4"), Catch::Contains("columns"));
  CHECK_THAT(why(sound, "null", "[1]"), Catch::Contains("[u, v]"));
  CHECK_THAT(why(sound, "null", "[1,1e300]"), Catch::Contains("outside any image"));
  CHECK(why(sound, "null", "\"x\"") != "read");
}

}  // namespace plumbline::stored_views_test
