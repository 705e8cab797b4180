#include "app/plant/database/connection.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

namespace plumbline::plant {
namespace {

/// libpq's messages end with a line break and may have several lines.
std::string OneLine(const char* message) {
  std::string text = message == nullptr ? "" : message;
  while (!text.empty() && text.back() == '\n') text.pop_back();
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

void IgnoreNotice(void*, const PGresult*) {}

}  // namespace

Parameter::Parameter(double value) {
  if (std::isfinite(value)) text_ = fmt::format("{}", value);
}

void ArrayText::Add(const Parameter& element) {
  if (size_++ > 0) elements_ += ',';
  if (!element.text()) {
    elements_ += "NULL";
    return;
  }
  elements_ += '"';
  for (const char c : *element.text()) {
    if (c == '"' || c == '\\') elements_ += '\\';
    elements_ += c;
  }
  elements_ += '"';
}

std::string_view Rows::Text(int row, int column) const {
  return {PQgetvalue(result_.get(), row, column),
          static_cast<std::size_t>(PQgetlength(result_.get(), row, column))};
}

std::int64_t Rows::Integer(int row, int column) const {
  const std::string_view text = Text(row, column);
  std::int64_t value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

double Rows::Number(int row, int column) const {
  const std::string_view text = Text(row, column);
  double value = 0;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return value;
}

std::optional<std::string> Rows::TextOrNull(int row, int column) const {
  if (IsNull(row, column)) return std::nullopt;
  return std::string(Text(row, column));
}

std::optional<double> Rows::NumberOrNull(int row, int column) const {
  if (IsNull(row, column)) return std::nullopt;
  return Number(row, column);
}

std::int64_t Rows::changed() const {
  return std::atoll(PQcmdTuples(result_.get()));
}

Result<Connection> Connection::Open(const std::string& settings, const std::string& program) {
  const std::string timeout = std::to_string(kConnectTimeout_s);
  // The first entry is expanded; what follows applies where it states nothing.
  // A server that vanishes without a word, by a power cut, is noticed after half a minute.
  const char* const keys[] = {"connect_timeout",
                              "keepalives_idle",
                              "keepalives_interval",
                              "keepalives_count",
                              "tcp_user_timeout",
                              "application_name",
                              "dbname",
                              nullptr};
  const char* const values[] = {timeout.c_str(),  "10",   "5", "4", "30000", program.c_str(),
                                settings.c_str(), nullptr};
  Connection connection(PQconnectdbParams(keys, values, 1));
  if (!connection.alive()) return Error{OneLine(PQerrorMessage(connection.get()))};
  PQsetNoticeReceiver(connection.get(), &IgnoreNotice, nullptr);
  const auto prepared = connection.Run(
      "SELECT set_config('timezone', 'UTC', false), set_config('datestyle', 'ISO', false), "
      "set_config('search_path', 'plumbline, public', false)");
  if (!prepared) return prepared.failure();
  return connection;
}

Result<Rows> Connection::Checked(PGresult* result) {
  Rows rows(result);
  const ExecStatusType status = PQresultStatus(result);
  if (status == PGRES_TUPLES_OK || status == PGRES_COMMAND_OK || status == PGRES_COPY_IN) {
    return rows;
  }
  const char* const state = PQresultErrorField(result, PG_DIAG_SQLSTATE);
  last_state_ = state == nullptr ? "" : state;
  const std::string message = OneLine(PQresultErrorMessage(result));
  return Error{message.empty() ? OneLine(PQerrorMessage(get())) : message};
}

Result<Rows> Connection::Run(const char* statement, std::initializer_list<Parameter> parameters) {
  return Run(statement, std::span(parameters.begin(), parameters.size()));
}

Result<Rows> Connection::Run(const char* statement, std::span<const Parameter> parameters) {
  std::vector<const char*> values;
  for (const Parameter& one : parameters)
    values.push_back(one.text() ? one.text()->c_str() : nullptr);
  return Checked(PQexecParams(get(), statement, static_cast<int>(values.size()), nullptr,
                              values.data(), nullptr, nullptr, 0));
}

Result<Rows> Connection::RunPrepared(const char* statement,
                                     std::initializer_list<Parameter> parameters) {
  const auto known = std::find(prepared_.begin(), prepared_.end(), statement);
  const std::string name = fmt::format("s{}", known - prepared_.begin());
  if (known == prepared_.end()) {
    const auto made = Checked(PQprepare(get(), name.c_str(), statement, 0, nullptr));
    if (!made) return made.failure();
    prepared_.push_back(statement);
  }
  std::vector<const char*> values;
  for (const Parameter& one : parameters)
    values.push_back(one.text() ? one.text()->c_str() : nullptr);
  return Checked(PQexecPrepared(get(), name.c_str(), static_cast<int>(values.size()), values.data(),
                                nullptr, nullptr, 0));
}

Result<void> Connection::RunScript(const std::string& statements) {
  return Checked(PQexec(get(), statements.c_str())).transform([](const Rows&) {});
}

Result<void> Connection::Copy(const char* statement, std::string_view rows) {
  const auto begun = Checked(PQexec(get(), statement));
  if (!begun) return begun.failure();
  const bool sent = PQputCopyData(get(), rows.data(), static_cast<int>(rows.size())) == 1 &&
                    PQputCopyEnd(get(), nullptr) == 1;
  if (!sent) return Error{OneLine(PQerrorMessage(get()))};
  Result<void> ended = Checked(PQgetResult(get())).transform([](const Rows&) {});
  while (PGresult* const rest = PQgetResult(get())) PQclear(rest);
  return ended;
}

DatabaseTransaction::DatabaseTransaction(Connection& connection)
    : connection_(connection), begun_(connection.Run("BEGIN")), open_(begun_.ok()) {}

DatabaseTransaction::~DatabaseTransaction() {
  if (open_ && connection_.alive()) static_cast<void>(connection_.Run("ROLLBACK").ok());
}

Result<void> DatabaseTransaction::Commit() {
  open_ = false;
  const auto done = connection_.Run("COMMIT");
  if (!done) return done.failure();
  return {};
}

}  // namespace plumbline::plant
