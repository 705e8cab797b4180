// Fixture: a plant of many cells, made by the server itself.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "app/plant/database/connection.h"

namespace plumbline::test {

/// Cells 1..N in lines of 25, two arm models, all online and healthy; `days` days of sums, 40
/// probes a day, a mean residual about 0.2 mm with 0.01 mm between days, the same at each call.
inline void FillPlant(plant::Connection& connection, int cells, int days) {
  const auto run = [&](const char* statement, std::initializer_list<plant::Parameter> parameters) {
    const auto done = connection.Run(statement, parameters);
    INFO((done ? "" : done.error()));
    REQUIRE(done.ok());
  };
  run(R"sql(
INSERT INTO cell (line, node, name, arm_model, arm_series, installed, page, version, birth,
                  last_received, state_utc, state, health, model)
SELECT 'line ' || (k - 1) / 25 + 1, 'cell-' || k, 'cell ' || k,
       CASE WHEN k % 3 = 0 THEN 'KR 210' ELSE 'KR 120' END, 'R' || 2700 + 200 * (k % 2),
       current_date - 365 * (1 + k % 12), 'http://10.0.0.' || k || ':8080/', '1.2.0',
       1790000000000, now(), now(),
       jsonb_build_object('health', 0, 'health_reason', '', 'drift_statistic', 0.2,
                          'proposed_model', 0), 0, 3
FROM generate_series(1, $1::int) k)sql",
      {cells});
  run(R"sql(
INSERT INTO cell_day (cell, day, model, probes, wild, sum_mm, sum_mm2, max_mm,
                      sum_dx_mm, sum_dy_mm, sum_dz_mm)
SELECT cell, current_date - d, 3, 40, (cell + d) % 7 / 6, 40 * mean, 40 * mean * mean, 2 * mean,
       20 * mean, 20 * mean, 28 * mean
FROM cell, generate_series(0, $1::int - 1) d,
     LATERAL (SELECT 0.2 + 0.01 * (hashint8(cell * 7919::bigint + d) % 1000) / 1000.0) m (mean))sql",
      {days});
}

}  // namespace plumbline::test
