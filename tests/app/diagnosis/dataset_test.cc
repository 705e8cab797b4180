// Measured rows made ready: copies, repeats, what a clock hides.
#include "app/diagnosis/dataset.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <functional>
#include <random>
#include <set>

#include "tests/app/diagnosis/simulated.h"

using namespace plumbline;

TEST_CASE("only what repeats a row in every column and at the same time is a copy") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 20 --repeats 0 --seed 4");
  data.table.further = {"zoom_counts"};
  for (MeasuredRow& row : data.table.rows) row.further = {5000};
  const auto rows_beside = [&](const std::function<void(MeasuredRow&)>& change, bool timed) {
    MeasuredCell more = data;
    more.table.recorded.time = timed;
    MeasuredRow copy = more.table.rows.front();
    change(copy);
    more.table.rows.push_back(copy);
    const Result<Dataset> dataset = DatasetFrom(more.cell, more.table);
    REQUIRE(dataset);
    const bool told =
        std::any_of(dataset->notes.begin(), dataset->notes.end(), [](const std::string& note) {
          return note.find("to the last digit") != std::string::npos;
        });
    return std::pair(dataset->rows() - static_cast<int>(data.table.rows.size()), told);
  };
  using Told = std::pair<int, bool>;
  CHECK(rows_beside([](MeasuredRow&) {}, true) == Told(0, true));
  CHECK(rows_beside([](MeasuredRow&) {}, false) == Told(1, true));
  CHECK(rows_beside([](MeasuredRow& row) { row.further[0] = 5040; }, true) == Told(1, false));
  CHECK(rows_beside([](MeasuredRow& row) { row.qd = 0.1 * row.q; }, true) == Told(1, false));
  CHECK(rows_beside([](MeasuredRow& row) { row.tau = 10 * row.q; }, true) == Told(1, false));
}
