#include "app/plant/jobs/comparison.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "app/base/text/json_text.h"

namespace plumbline::plant::comparison_test {

using Change = CellComparison::Change;

/// An answer with this held-out error, whose 95 % interval is a factor of `spread` to either side.
JobAnswer Answer(double error_mm, double spread = 1.1, const std::string& by = "blocks of rows") {
  JobAnswer answer;
  answer.output = {{"verdict", "explained"},
                   {"effects", {{{"id", "joint_compliance"}, {"scope", {"q2"}}}}},
                   {"held_out",
                    {{{"by", by},
                      {"before_mm", 1.0},
                      {"after_mm", error_mm},
                      {"after_low_mm", error_mm / spread},
                      {"after_high_mm", error_mm * spread}}}},
                   {"plant", {{"data_sha256", "aa"}}}};
  return answer;
}

TEST_CASE("a cell is worse only beyond its uncertainty and beyond five percent") {
  CHECK(CompareAnswers("a/b", Answer(0.1), Answer(0.1)).change == Change::kEqual);
  // Intervals of 10 % each combine to 14 %.
  CHECK(CompareAnswers("a/b", Answer(0.1), Answer(0.113)).change == Change::kEqual);
  CHECK(CompareAnswers("a/b", Answer(0.1), Answer(0.116)).change == Change::kWorse);
  CHECK(CompareAnswers("a/b", Answer(0.116), Answer(0.1)).change == Change::kBetter);
  CHECK(CompareAnswers("a/b", Answer(0.1, 1.001), Answer(0.104, 1.001)).change == Change::kEqual);
  CHECK(CompareAnswers("a/b", Answer(0.1, 1.001), Answer(0.106, 1.001)).change == Change::kWorse);
}

TEST_CASE("answers that cannot be compared are not counted as equal") {
  JobAnswer refused, failed, none, other_rows = Answer(0.1);
  refused.output = {{"refused", "too few rows"}};
  failed.failed = "killed by signal 11";
  other_rows.output["plant"]["data_sha256"] = "bb";
  CHECK(CompareAnswers("a/b", Answer(0.1), refused).change == Change::kRefused);
  CHECK(CompareAnswers("a/b", Answer(0.1), failed).change == Change::kRefused);
  CHECK(CompareAnswers("a/b", refused, Answer(0.1)).change == Change::kAnswers);
  CHECK(CompareAnswers("a/b", refused, refused).change == Change::kNotComparable);
  CHECK(CompareAnswers("a/b", Answer(0.1), other_rows).change == Change::kNotComparable);
  CHECK(CompareAnswers("a/b", Answer(0.1), Answer(0.1, 1.1, "sessions")).change ==
        Change::kNotComparable);
  for (const char* text : {"[]", "{}", "3", R"({"held_out": {"by": 1}, "effects": 7})",
                           R"({"held_out": [3, {"by": "x", "after_mm": "much"}]})"}) {
    JobAnswer odd;
    odd.output = text::JsonOrNull(text);
    CHECK(CompareAnswers("a/b", odd, Answer(0.1)).change != Change::kEqual);
    CHECK(CompareAnswers("a/b", odd, odd).change == Change::kNotComparable);
  }
}

TEST_CASE("changes too small for a single cell show over the plant") {
  std::vector<CellComparison> cells;
  for (int k = 0; k < 20; ++k) {
    cells.push_back(
        CompareAnswers("a/" + std::to_string(k), Answer(0.1), Answer(k % 2 == 0 ? 0.103 : 0.104)));
  }
  const PlantComparison worse = CompareCells(cells);
  CHECK(worse.worse == 0);
  CHECK(worse.equal == 20);
  CHECK(*worse.ratio == Approx(1.035).epsilon(1e-3));
  CHECK(worse.IsWorse());

  cells.clear();
  for (int k = 0; k < 20; ++k) {
    cells.push_back(
        CompareAnswers("a/" + std::to_string(k), Answer(0.1), Answer(k % 2 == 0 ? 0.095 : 0.105)));
  }
  CHECK_FALSE(CompareCells(cells).IsWorse());
  cells.push_back(CompareAnswers("a/bad", Answer(0.1), Answer(0.2)));
  const PlantComparison one = CompareCells(cells);
  CHECK(one.IsWorse());
  CHECK(one.cells.front().cell == "a/bad");
  CHECK(ComparisonText(one).find("a/bad") != std::string::npos);
  CHECK(ComparisonJson(one)["worse"] == 1);
}

}  // namespace plumbline::plant::comparison_test
