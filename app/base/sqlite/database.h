// RAII wrappers of SQLite connections, prepared statements and transactions.
#pragma once

#include <sqlite3.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::sqlite {

/// Prepared statement. As in SQLite, parameter indices start at 1 and column indices at 0.
class Statement {
 public:
  Statement(sqlite3* database, std::string_view sql);

  void Bind(int index, std::int64_t value) { sqlite3_bind_int64(get(), index, value); }
  void Bind(int index, double value) { sqlite3_bind_double(get(), index, value); }
  void Bind(int index, const std::string& text);
  void BindBlob(int index, const std::vector<std::uint8_t>& bytes);
  template <typename T>
  void Bind(int index, const std::optional<T>& value) {
    if (value) {
      Bind(index, *value);
    } else {
      sqlite3_bind_null(get(), index);
    }
  }

  /// SQLITE_ROW, SQLITE_DONE or an error code.
  int Step() { return statement_ ? sqlite3_step(get()) : SQLITE_ERROR; }
  /// Runs a statement that returns no rows, and resets it for the next values.
  bool Run();
  /// Makes the statement ready to run again; bound values stay.
  void Reset() { sqlite3_reset(get()); }

  bool IsNull(int column) const { return sqlite3_column_type(get(), column) == SQLITE_NULL; }
  std::int64_t Integer(int column) const { return sqlite3_column_int64(get(), column); }
  double Number(int column) const { return sqlite3_column_double(get(), column); }
  std::string Text(int column) const;
  std::optional<double> OptionalNumberAt(int column) const {
    return IsNull(column) ? std::nullopt : std::optional(Number(column));
  }
  std::optional<std::int64_t> OptionalIntegerAt(int column) const {
    return IsNull(column) ? std::nullopt : std::optional(Integer(column));
  }

 private:
  sqlite3_stmt* get() const { return statement_.get(); }
  std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement_{nullptr, &sqlite3_finalize};
};

/// Connection to one database file. Not thread-safe.
class Database {
 public:
  enum class Mode { kRead, kWrite };
  /// kWrite creates the file if it is missing, and refuses a symbolic link.
  static Result<Database> Open(const std::string& path, Mode mode);

  bool Run(const char* sql);
  /// Whether the open file is no longer the one at path(): it was moved, deleted or replaced.
  bool HasMoved();
  /// The first value of the first row. @return  why there is none: unreadable, locked, no row
  Result<std::int64_t> IntegerOf(const char* sql);
  /// Error message of the last call, with a remedy.
  std::string Problem() const;
  sqlite3* get() const { return handle_.get(); }
  const std::string& path() const { return path_; }

 private:
  explicit Database(std::string path) : path_(std::move(path)) {}
  std::string path_;
  std::unique_ptr<sqlite3, int (*)(sqlite3*)> handle_{nullptr, &sqlite3_close_v2};
};

/// Write transaction; the destructor rolls it back unless it was committed.
class Transaction {
 public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  bool begun() const { return open_; }
  bool Commit();

 private:
  Database& database_;
  bool open_;
};

// Identity of a store: whether an SQLite file belongs to this product, and which schema it has.

/// Identification that a store writes into the header of its file.
struct StoreIdentity {
  std::int64_t application_id;  ///< PRAGMA application_id, shown by file(1)
  int schema;                   ///< PRAGMA user_version of this version of the product
  const char* name;             ///< with its article: "a plumbline journal"
  /// The oldest schema that the store itself brings up to date when it opens a file; 0: none.
  int oldest_migrated = 0;

  /// SQL that marks a new file as such a store.
  std::string Mark() const;
};

/// Schema of an open file: identity.schema, an older one that the store migrates, or 0 if its
/// tables have not been created yet.
/// Errors: the file cannot be read, belongs to another program, or has another schema.
Result<std::int64_t> SchemaOf(Database& database, const StoreIdentity& identity);

/// The same for a reader, which cannot create tables: also an error if the file is empty.
Result<void> RequireCurrentSchema(Database& database, const StoreIdentity& identity);

/// Error message "PATH: WHAT: the database's problem".
Error Failure(const Database& database, std::string_view what);

}  // namespace plumbline::sqlite
