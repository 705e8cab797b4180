// Preparation of measured rows: copies, replicates, time offsets and joint resolution.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <functional>
#include <optional>
#include <random>
#include <set>

#include "app/measure/diagnosis/linear/robust.h"
#include "app/measure/diagnosis/preparation/dataset_preparation.h"
#include "firmware-like/geometry/units.h"
#include "tests/app/measure/diagnosis/simulated.h"

namespace plumbline::dataset_test {

using namespace plumbline::measure;

TEST_CASE("a row is a copy only if all columns and the time are equal") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 20 --repeats 0 --seed 4");
  data.table.further = {"zoom_counts"};
  for (measure::MeasuredRow& row : data.table.rows) row.further = {5000};
  const auto added_rows = [&](const std::function<void(measure::MeasuredRow&)>& change,
                              bool timed) {
    MeasuredCell more = data;
    more.table.recorded.time = timed;
    measure::MeasuredRow copy = more.table.rows.front();
    change(copy);
    more.table.rows.push_back(copy);
    const Result<Dataset> dataset = DatasetFrom(more.cell, more.table);
    REQUIRE(dataset);
    const bool noted = std::any_of(
        dataset->notes.begin(), dataset->notes.end(),
        [](const std::string& note) { return note.find("earlier rows") != std::string::npos; });
    return std::pair(dataset->rows() - static_cast<int>(data.table.rows.size()), noted);
  };
  using Outcome = std::pair<int, bool>;
  CHECK(added_rows([](measure::MeasuredRow&) {}, true) == Outcome(0, true));
  CHECK(added_rows([](measure::MeasuredRow&) {}, false) == Outcome(1, true));
  CHECK(added_rows([](measure::MeasuredRow& row) { row.further[0] = 5040; }, true) ==
        Outcome(1, false));
  CHECK(added_rows([](measure::MeasuredRow& row) { row.qd = 0.1 * row.q; }, true) ==
        Outcome(1, false));
  CHECK(added_rows([](measure::MeasuredRow& row) { row.tau = 10 * row.q; }, true) ==
        Outcome(1, false));
}

TEST_CASE("replicates with jitter form a cluster, wherever they are") {
  const MeasuredCell base = Simulated("--family none --robot ur10 --rows 60 --repeats 0 --seed 6");
  constexpr int kVisits = 8;
  for (const double jitter_rad : {0.0, 1e-5, 5e-5}) {
    CAPTURE(jitter_rad);
    std::mt19937_64 generator(7);
    std::normal_distribution<double> jitter(0, 1);
    MeasuredCell data = base;
    data.table.rows.clear();
    for (int visit = 0; visit < kVisits; ++visit) {
      for (std::size_t k = 0; k < base.table.rows.size(); ++k) {
        measure::MeasuredRow row = base.table.rows[k];
        // The first rows are on the edges of a grid with the tolerance as its pitch.
        if (k < 10) row.q[0] = 2e-4 * (static_cast<double>(k) + 0.5);
        for (double& q : row.q) q += jitter_rad * jitter(generator);
        *row.t_s += 1e4 * visit;
        *row.measured_W += Vec3::Constant(1e-5 * jitter(generator));
        data.table.rows.push_back(row);
      }
    }
    const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
    REQUIRE(dataset);
    CHECK(dataset->clusters == static_cast<int>(base.table.rows.size()));
    for (const RowIndex row : dataset->row_indices()) {
      CHECK(dataset->cluster_of[row].offset() == row.offset() % base.table.rows.size());
    }
  }
}

TEST_CASE("a slow path is not one cluster; sessions and payloads have separate clusters") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 20 --repeats 0 --seed 6");
  const measure::MeasuredRow first = data.table.rows.front();
  data.table.rows.clear();
  for (int k = 0; k < 12000; ++k) {
    measure::MeasuredRow row = first;
    row.t_s = k;
    row.q[1] += 1e-4 * k;  // half the tolerance from row to row
    data.table.rows.push_back(row);
  }
  const Result<Dataset> path = DatasetFrom(data.cell, data.table);
  REQUIRE(path);
  CHECK(path->clusters > 5000);
  data.table.rows.assign(12000, first);
  for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
    measure::MeasuredRow& row = data.table.rows[k];
    row.t_s = static_cast<double>(k);
    row.payload_kg = k % 2 == 0 ? 0 : 5;
    row.session = k % 3 == 0 ? "a" : "b";
  }
  const Result<Dataset> one_pose = DatasetFrom(data.cell, data.table);
  REQUIRE(one_pose);
  CHECK(one_pose->clusters == 4);
}

TEST_CASE("a subset of the rows renumbers its clusters without gaps") {
  const MeasuredCell measured = Simulated("--family none --robot ur10 --rows 20 --seed 4");
  const Result<Dataset> data = DatasetFrom(measured.cell, measured.table);
  REQUIRE(data);
  const FitRows rows = EvenlySpacedRows(*data, data->rows() / 2);
  const Dataset thin = SelectRows(*data, rows);
  std::set<ClusterIndex> numbers(thin.cluster_of.begin(), thin.cluster_of.end());
  CHECK(static_cast<int>(numbers.size()) == thin.clusters);
  CHECK(numbers.rbegin()->value() == thin.clusters - 1);
  for (const FitRowIndex a : rows.indices()) {
    for (const FitRowIndex b : rows.indices()) {
      CHECK((thin.cluster_of[RowIndex(a.value())] == thin.cluster_of[RowIndex(b.value())]) ==
            (data->cluster_of[rows[a]] == data->cluster_of[rows[b]]));
    }
  }
}

TEST_CASE("a time that starts far from zero causes a note about thermal drift") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 20 --seed 4");
  const auto noted = [&] {
    const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
    REQUIRE(dataset);
    return std::any_of(
        dataset->not_recorded.begin(), dataset->not_recorded.end(),
        [](const std::string& line) { return line.find("t_s starts at") != std::string::npos; });
  };
  REQUIRE(data.table.recorded.time);
  CHECK_FALSE(noted());
  for (measure::MeasuredRow& row : data.table.rows) *row.t_s += 1.7e9;
  CHECK(noted());
}

TEST_CASE(
    "undeclared joint resolution is reported with its effect at the tool and what to declare") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 30 --repeats 0 --seed 8");
  const auto noted = [&data](const char* words) {
    const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
    REQUIRE(dataset);
    return std::any_of(
        dataset->notes.begin(), dataset->notes.end(),
        [words](const std::string& note) { return note.find(words) != std::string::npos; });
  };
  data.table.recorded.q_step = false;
  for (measure::MeasuredRow& row : data.table.rows) row.q_step_rad.reset();
  data.table.q_decimals = 6;
  CHECK_FALSE(noted("q_step_deg"));  // the resolution of the file is negligible
  for (measure::MeasuredRow& row : data.table.rows) {
    for (double& q : row.q) q = 1e-3 * std::round(q / 1e-3);
  }
  CHECK(noted("are multiples of 0.0573 deg (1 mrad), although 6 decimals are written"));
  CHECK(noted("mm at the tool (95 %)"));
  CHECK(noted("add the column q_step_deg with 0.0572958 in every row"));
  data.table.recorded.q_step = true;
  for (measure::MeasuredRow& row : data.table.rows) row.q_step_rad = 1e-3;
  CHECK_FALSE(noted("are multiples of"));
  CHECK(noted("counts as noise"));
  // Three decimals in the file are not reported as coarse; one decimal costs a millimetre.
  data.table.recorded.q_step = false;
  for (measure::MeasuredRow& row : data.table.rows) row.q_step_rad.reset();
  data.table.q_decimals = 1;
  for (measure::MeasuredRow& row : data.table.rows) {
    for (double& q : row.q) q = 0.1 * kRadPerDeg * std::round(q / (0.1 * kRadPerDeg));
  }
  CHECK(noted("are written to 1 decimals, in steps of 0.1 deg"));
}

TEST_CASE("the noise that the rows state replaces the declared one, and residuals are in real mm") {
  MeasuredCell data = Simulated("--family none --robot ur10 --rows 30 --repeats 10 --seed 6");
  data.cell.measurement.sigma_m = 2e-4;
  data.table.recorded.sigma = true;
  const auto dataset_with = [&](const std::function<std::optional<double>(std::size_t)>& sigma_of) {
    for (std::size_t k = 0; k < data.table.rows.size(); ++k) {
      data.table.rows[k].sigma_m = sigma_of(k);
    }
    const Result<Dataset> dataset = DatasetFrom(data.cell, data.table);
    REQUIRE(dataset);
    return *dataset;
  };
  const auto sigma_of_residual_of = [](const Dataset& dataset, double residual_m) {
    const PerRow<RowResidual> residuals(dataset.table.rows.size(),
                                        RowResidual(Vec3::Constant(residual_m)));
    return RobustSigma(dataset, residuals) * MedianOfChi(3) / std::sqrt(3.0);
  };

  const Dataset of_all = dataset_with([](std::size_t) { return 2e-5; });
  CHECK(of_all.sigma_m == Approx(2e-5));
  CHECK(of_all.sigma_origin == "median of the column sigma_mm");
  CHECK(of_all.noise_per_row() == Approx(3));
  CHECK(sigma_of_residual_of(of_all, 5e-5) == Approx(5e-5));
  CHECK(of_all.repeat_sigma_m == Approx(5e-5).epsilon(0.5));  // measured, whatever was stated
  CHECK_THAT(of_all.notes.back(), Catch::Contains("median 0.02 mm, replaces"));

  // Half of the rows much noisier: the scale is that of the others.
  const Dataset mixed = dataset_with([](std::size_t k) { return k % 2 == 0 ? 2e-5 : 3e-4; });
  CHECK(mixed.sigma_m == Approx(2e-5));
  CHECK(mixed.numbers[RowIndex(1)].covariance(0, 0) == Approx(225));
  const double mean_square = (2e-5 * 2e-5 + 3e-4 * 3e-4) / 2;
  CHECK(mixed.sigma_m * std::sqrt(mixed.noise_per_row()) == Approx(std::sqrt(3 * mean_square)));

  const Dataset partial = dataset_with(
      [](std::size_t k) { return k % 3 == 0 ? std::optional<double>() : std::optional(2e-5); });
  CHECK(partial.sigma_m == Approx(2e-5));
  CHECK(partial.numbers[RowIndex(0)].covariance(0, 0) == Approx(100));  // as declared
  CHECK_THAT(partial.sigma_origin, Catch::Contains("declared where it is empty"));
}

}  // namespace plumbline::dataset_test
