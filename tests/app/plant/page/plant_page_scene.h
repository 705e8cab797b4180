// Fixture: the plant's page over a database of a given number of cells.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "app/plant/page/plant_page.h"
#include "tests/app/display/page/page_client.h"
#include "tests/app/plant/answers/plant_rows.h"
#include "tests/app/plant/database/postgres_process.h"

namespace plumbline::test {

struct PlantPageScene {
  PostgresProcess server;
  plant::Connection owner = server.ConnectToNewPlant();
  std::mutex log_mutex;
  std::vector<std::string> logged;
  std::unique_ptr<plant::PlantPage> page;

  explicit PlantPageScene(int cells, const std::string& token = "") {
    FillPlant(owner, cells, 0);
    // Never silent.
    Run("UPDATE cell SET last_received = now() + interval '1 hour'");
    Run("UPDATE cell SET state_utc = last_received");
    plant::PlantPageOptions options;
    options.page.port = 0;
    options.page.token = token;
    options.database = server.Settings();
    options.log = [this](const std::string& line) {
      const std::lock_guard lock(log_mutex);
      logged.push_back(line);
    };
    auto started = plant::PlantPage::Start(std::move(options));
    INFO((started ? "" : started.error()));
    REQUIRE(started);
    page = std::move(started).value();
  }
  void Run(const char* statement) {
    const auto done = owner.Run(statement);
    INFO((done ? "" : done.error()));
    REQUIRE(done.ok());
  }
  /// @param cell  its database key, counted from 1
  void SetHealth(int cell, int health, const char* reason) {
    const auto done = owner.Run(
        "UPDATE cell SET health = $2, state = jsonb_set(state, '{health_reason}', "
        "to_jsonb($3::text)) WHERE cell = $1",
        {cell, health, reason});
    REQUIRE(done.ok());
  }
  PageResponse Get(const std::string& path, const std::string& headers = "") const {
    return Request(page->at().port, path, headers);
  }
  std::string Address() const {
    return "http://127.0.0.1:" + std::to_string(page->at().port) + "/";
  }
};

}  // namespace plumbline::test
