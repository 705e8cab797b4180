// Schema of the plant's database, its roles, and its migrations.
#pragma once

#include <string>

#include "app/plant/database/connection.h"

namespace plumbline::plant {

/// Newest version of the schema that this program knows.
int CurrentSchema();

struct SchemaState {
  int version = 0;  ///< 0: the database has none of the plant's tables
};
Result<SchemaState> ReadSchema(Connection& connection);

/// Creates the schema `plumbline`, or brings an older one forward with its data, in one
/// transaction. Needs the rights of the owner. Idempotent; several may run at once.
/// @return  the version found; or the reason, also for a newer schema than this program knows
Result<int> Migrate(Connection& connection);

/// Fails if the schema is not the one that this program knows, with the remedy.
Result<void> RequireSchema(Connection& connection);

/// Creates the group roles that do not exist and grants each the least it needs:
/// plumbline_collector writes messages, plumbline_reader reads, plumbline_worker reads and takes
/// jobs. Needs CREATEROLE unless they exist. Login roles are the administrator's:
/// `GRANT plumbline_reader TO grafana`.
Result<void> GrantRights(Connection& connection);

}  // namespace plumbline::plant
