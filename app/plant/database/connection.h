// Connection to the plant's PostgreSQL database.
#pragma once

#include <libpq-fe.h>

#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::plant {

/// Parameter of a statement in PostgreSQL's text format, or NULL.
class Parameter {
 public:
  Parameter(std::nullopt_t) {}                             // NOLINT(google-explicit-constructor)
  Parameter(std::string text) : text_(std::move(text)) {}  // NOLINT(google-explicit-constructor)
  Parameter(std::string_view text) : text_(text) {}        // NOLINT(google-explicit-constructor)
  Parameter(const char* text) : text_(text) {}             // NOLINT(google-explicit-constructor)
  Parameter(bool value) : text_(value ? "t" : "f") {}      // NOLINT(google-explicit-constructor)
  Parameter(int value) : text_(std::to_string(value)) {}   // NOLINT(google-explicit-constructor)
  Parameter(std::int64_t value) : text_(std::to_string(value)) {}  // NOLINT
  Parameter(double value);  // NOLINT(google-explicit-constructor)
  template <typename T>
  Parameter(const std::optional<T>& value) {  // NOLINT(google-explicit-constructor)
    if (value) *this = Parameter(*value);
  }
  const std::optional<std::string>& text() const { return text_; }

 private:
  std::optional<std::string> text_;
};

/// One-dimensional array in PostgreSQL's text format, `{1,2,NULL}`, for `unnest($1::bigint[])`.
class ArrayText {
 public:
  void Add(const Parameter& element);
  std::size_t size() const { return size_; }
  /// The literal of what was added so far.
  std::string Text() const { return "{" + elements_ + "}"; }

 private:
  std::string elements_;
  std::size_t size_ = 0;
};

/// Rows that a statement returned. Values are text; the getters convert, and require that the
/// column is not NULL and of that kind, which the statement determines.
class Rows {
 public:
  explicit Rows(PGresult* result) : result_(result, &PQclear) {}
  int size() const { return PQntuples(result_.get()); }
  bool empty() const { return size() == 0; }
  bool IsNull(int row, int column) const { return PQgetisnull(result_.get(), row, column) != 0; }
  std::string_view Text(int row, int column) const;
  std::int64_t Integer(int row, int column) const;
  double Number(int row, int column) const;
  bool Bool(int row, int column) const { return Text(row, column) == "t"; }
  /// nullopt where the column is NULL.
  std::optional<std::string> TextOrNull(int row, int column) const;
  std::optional<double> NumberOrNull(int row, int column) const;
  /// Number of rows that an INSERT, UPDATE or DELETE changed.
  std::int64_t changed() const;

 private:
  std::unique_ptr<PGresult, void (*)(PGresult*)> result_;
};

/// One session, used by one thread. A lost connection stays lost: open another.
///
/// The settings are a libpq connection string. With several hosts and
/// `target_session_attrs=read-write`, Open() finds the primary, also after a failover.
class Connection {
 public:
  static constexpr int kConnectTimeout_s = 5;
  /// @param program  application_name, shown in pg_stat_activity
  /// @return         or why there is no connection, without the password
  static Result<Connection> Open(const std::string& settings, const std::string& program);

  /// Runs one statement with parameters $1, $2 ...
  Result<Rows> Run(const char* statement, std::initializer_list<Parameter> parameters = {});
  Result<Rows> Run(const char* statement, std::span<const Parameter> parameters);
  /// The same, prepared at its first use and kept. For statements that are run often, whose text is
  /// a constant.
  Result<Rows> RunPrepared(const char* statement, std::initializer_list<Parameter> parameters);
  /// Runs several statements without parameters, as one transaction unless they contain their own.
  Result<void> RunScript(const std::string& statements);
  /// Sends `rows` to a `COPY ... FROM STDIN`.
  Result<void> Copy(const char* statement, std::string_view rows);

  /// False after the server has closed the connection.
  bool alive() const { return PQstatus(connection_.get()) == CONNECTION_OK; }
  /// SQLSTATE of the last failure, for example "23505" for a repeated key; empty if there was none.
  const std::string& last_state() const { return last_state_; }
  /// For poll() and PQnotifies().
  PGconn* get() const { return connection_.get(); }

 private:
  explicit Connection(PGconn* connection) : connection_(connection, &PQfinish) {}
  Result<Rows> Checked(PGresult* result);

  std::unique_ptr<PGconn, void (*)(PGconn*)> connection_;
  std::vector<const char*> prepared_;  ///< by address
  std::string last_state_;
};

/// Rolled back unless committed.
class DatabaseTransaction {
 public:
  explicit DatabaseTransaction(Connection& connection);
  ~DatabaseTransaction();
  DatabaseTransaction(const DatabaseTransaction&) = delete;
  DatabaseTransaction& operator=(const DatabaseTransaction&) = delete;
  const Result<Rows>& begun() const { return begun_; }
  Result<void> Commit();

 private:
  Connection& connection_;
  Result<Rows> begun_;
  bool open_ = false;
};

}  // namespace plumbline::plant
