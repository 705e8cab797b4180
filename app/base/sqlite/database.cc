#include "app/base/sqlite/database.h"

#include <fmt/format.h>

#include <filesystem>

#include "drivers/files/open_failure.h"

namespace plumbline::sqlite {
std::string StoreIdentity::Mark() const {
  return fmt::format("PRAGMA application_id={}; PRAGMA user_version={}", application_id, schema);
}

Result<std::int64_t> SchemaOf(Database& database, const StoreIdentity& identity) {
  // SQLite detects a file that is not a database when it first reads it.
  const Result<std::int64_t> tables = database.IntegerOf("SELECT count(*) FROM sqlite_master");
  if (!tables) return Failure(database, "cannot be read");
  const Result<std::int64_t> schema = database.IntegerOf("PRAGMA user_version");
  if (!schema) return schema;
  const Result<std::int64_t> application = database.IntegerOf("PRAGMA application_id");
  if (!application) return application;
  if (*tables > 0 && *application != identity.application_id) {
    return Error{fmt::format("{}: is a database, but not {}; move the file away", database.path(),
                             identity.name)};
  }
  if (*schema > identity.schema) {
    return Error{
        fmt::format("{}: written by a newer plumbline (schema {}, this one knows {}); install that "
                    "version again, or move the file away to start a new one",
                    database.path(), *schema, identity.schema)};
  }
  const int oldest = identity.oldest_migrated > 0 ? identity.oldest_migrated : identity.schema;
  if (*tables > 0 && *schema < oldest) {
    return Error{
        fmt::format("{}: written by a development version before 0.1.0 (schema {}, this one knows "
                    "{}); move the file away to start a new one",
                    database.path(), *schema, identity.schema)};
  }
  return *tables == 0 ? 0 : *schema;
}

Result<void> RequireCurrentSchema(Database& database, const StoreIdentity& identity) {
  const Result<std::int64_t> schema = SchemaOf(database, identity);
  if (!schema) return schema.failure();
  if (*schema != 0) return {};
  return Error{fmt::format("{}: is empty, not {} yet", database.path(), identity.name)};
}

Error Failure(const Database& database, std::string_view what) {
  return Error{fmt::format("{}: {}: {}", database.path(), what, database.Problem())};
}

namespace {

constexpr int kBusyTimeout_ms = 5000;  // the daemon and a command may write at the same time

constexpr const char* kDamagedRemedy =
    "; restore it from the backup, or move it away to start a new one";

constexpr std::string_view kInMemory = ":memory:";

/// SQLITE_OPEN_NOFOLLOW refuses links anywhere in the path; resolving the folder limits that to the
/// file.
std::string WithResolvedFolder(const std::string& path) {
  std::error_code unknown;
  const std::filesystem::path file = std::filesystem::absolute(path, unknown);
  const std::filesystem::path folder = std::filesystem::canonical(file.parent_path(), unknown);
  return unknown ? path : (folder / file.filename()).string();
}

std::string Remedy(const std::string& path, int code, bool to_write) {
  switch (code) {
    case SQLITE_CANTOPEN:
      return to_write ? files::WriteRemedy(path) : files::ReadRemedy(path);
    case SQLITE_READONLY:
    case SQLITE_PERM:
      return files::WriteRemedy(path);
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return "; another program is writing to it: wait, or stop that program";
    case SQLITE_FULL:
      return "; the disk is full: free space (df -h)";
    case SQLITE_IOERR:
      return "; the disk reports an error: see journalctl -k";
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
      return kDamagedRemedy;
    default:
      return "";
  }
}

}  // namespace

Statement::Statement(sqlite3* database, std::string_view sql) {
  sqlite3_stmt* statement = nullptr;
  sqlite3_prepare_v2(database, sql.data(), static_cast<int>(sql.size()), &statement, nullptr);
  statement_.reset(statement);
}

void Statement::Bind(int index, const std::string& text) {
  sqlite3_bind_text(get(), index, text.data(), static_cast<int>(text.size()), SQLITE_TRANSIENT);
}

void Statement::BindBlob(int index, const std::vector<std::uint8_t>& bytes) {
  // An empty blob is not NULL.
  const void* data = bytes.empty() ? "" : static_cast<const void*>(bytes.data());
  sqlite3_bind_blob64(get(), index, data, bytes.size(), SQLITE_TRANSIENT);
}

bool Statement::Run() {
  if (!statement_) return false;
  const bool done = Step() == SQLITE_DONE;
  sqlite3_reset(get());
  return done;
}

std::string Statement::Text(int column) const {
  const void* text = sqlite3_column_blob(get(), column);
  const int size = sqlite3_column_bytes(get(), column);
  return text == nullptr
             ? std::string()
             : std::string(static_cast<const char*>(text), static_cast<std::size_t>(size));
}

Result<Database> Database::Open(const std::string& path, Mode mode) {
  Database database(path);
  sqlite3* handle = nullptr;
  const bool write = mode == Mode::kWrite;
  const bool file = path != kInMemory;
  int flags = write ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  if (write && file) flags |= SQLITE_OPEN_NOFOLLOW;
  const std::string name = write && file ? WithResolvedFolder(path) : path;
  const int code = sqlite3_open_v2(name.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  database.handle_.reset(handle);
  if (code != SQLITE_OK && write && std::filesystem::is_symlink(path)) {
    return Error{
        fmt::format("{}: is a symbolic link, which is not followed; move the file itself there, or "
                    "use another state_directory",
                    path)};
  }
  if (code != SQLITE_OK) {
    return Error{fmt::format("{}: {}{}", path, sqlite3_errstr(code), Remedy(path, code, write))};
  }
  sqlite3_busy_timeout(handle, kBusyTimeout_ms);
  return database;
}

std::string Database::Problem() const {
  return sqlite3_errmsg(handle_.get()) + Remedy(path_, sqlite3_errcode(handle_.get()), true);
}

bool Database::Run(const char* sql) {
  return sqlite3_exec(handle_.get(), sql, nullptr, nullptr, nullptr) == SQLITE_OK;
}

bool Database::HasMoved() {
  int moved = 0;
  sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_HAS_MOVED, &moved);
  return moved != 0;
}

Result<std::int64_t> Database::IntegerOf(const char* sql) {
  Statement statement(handle_.get(), sql);
  const int code = statement.Step();
  if (code == SQLITE_ROW) return statement.Integer(0);
  return Error{fmt::format("{}: cannot be read: {}", path_,
                           code == SQLITE_DONE
                               ? fmt::format("the expected row is missing{}", kDamagedRemedy)
                               : Problem())};
}

Transaction::Transaction(Database& database)
    : database_(database), open_(database.Run("BEGIN IMMEDIATE")) {}

Transaction::~Transaction() {
  if (open_) database_.Run("ROLLBACK");
}

bool Transaction::Commit() {
  if (!open_ || !database_.Run("COMMIT")) return false;
  open_ = false;
  return true;
}

}  // namespace plumbline::sqlite
