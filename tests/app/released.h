// Stores as released versions write them: `released/schema_N.sql` beside the test of each store,
// dumped from a file that the version itself had written, and never changed.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "app/base/sqlite/database.h"
#include "tests/file_text.h"

namespace plumbline::test {

/// Makes the file as version `schema` left it. @param folder  "cell/journal" for
/// tests/app/cell/journal
inline void WriteReleased(const std::string& folder, int schema, const std::string& path) {
  const std::string dump =
      FileText("tests/app/" + folder + "/released/schema_" + std::to_string(schema) + ".sql");
  INFO(folder << ": no dump of schema " << schema);
  REQUIRE_FALSE(dump.empty());
  auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  REQUIRE(database);
  INFO(database.value().Problem());
  REQUIRE(database.value().Run(dump.c_str()));
  REQUIRE(*database.value().IntegerOf("PRAGMA user_version") == schema);
}

/// Makes it a file of another version.
inline void SetSchema(const std::string& path, int schema) {
  auto database = sqlite::Database::Open(path, sqlite::Database::Mode::kWrite);
  REQUIRE(database);
  REQUIRE(database.value().Run(("PRAGMA user_version=" + std::to_string(schema)).c_str()));
}

}  // namespace plumbline::test
