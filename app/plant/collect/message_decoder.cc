#include "app/plant/collect/message_decoder.h"

#include <fmt/format.h>
#include <simdjson.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

namespace plumbline::plant {
namespace {

using Element = simdjson::dom::element;
using Object = simdjson::dom::object;

constexpr std::string_view kNamespace = "plumblineV1";
constexpr std::size_t kMaxName = 64;
constexpr std::int64_t kYear2000_ms = 946'684'800'000, kYear2100_ms = 4'102'444'800'000;
constexpr std::size_t kMaxJoints = 16;
constexpr std::int64_t kMaxSeq = std::int64_t{1} << 53;
constexpr std::size_t kMaxText = 300;  ///< of a text column, some of which are indexed

/// A column and where its value is in the message.
struct Column {
  enum class Kind { kBig, kInteger, kSmall, kNumber, kReal, kText, kBool, kNumbers };
  const char* name;
  Kind kind;
  std::string_view key;  ///< of the message
  int index = -1;        ///< of an array of three
  bool required = false;
};
using enum Column::Kind;

constexpr Column kProbeColumns[] = {{"journal", kBig, "journal", -1, true},
                                    {"id", kBig, "id", -1, true},
                                    {"model", kInteger, "model", -1, true},
                                    {"x_mm", kNumber, "measured_mm", 0},
                                    {"y_mm", kNumber, "measured_mm", 1},
                                    {"z_mm", kNumber, "measured_mm", 2},
                                    {"dx_mm", kReal, "residual_mm", 0},
                                    {"dy_mm", kReal, "residual_mm", 1},
                                    {"dz_mm", kReal, "residual_mm", 2},
                                    {"size_mm", kReal, "residual_size_mm"},
                                    {"payload_kg", kReal, "payload_kg"},
                                    {"temp_c", kReal, "temp_C"},
                                    {"wild", kBool, "wild", -1, true},
                                    {"alarm", kBool, "alarm", -1, true},
                                    {"quarantined", kBool, "quarantined", -1, true},
                                    {"source", kText, "source", -1, true},
                                    {"session", kText, "session", -1, true},
                                    {"q", kNumbers, "q"}};
constexpr Column kAlarmColumns[] = {{"word", kText, "word", -1, true},
                                    {"bit", kSmall, "bit", -1, true},
                                    {"meaning", kText, "meaning", -1, true}};
constexpr Column kModelColumns[] = {{"model", kInteger, "model", -1, true},
                                    {"before", kInteger, "before"},
                                    {"declared", kInteger, "declared"},
                                    {"proposed", kInteger, "proposed"}};
constexpr Column kLensColumns[] = {
    {"camera", kText, "camera", -1, true}, {"lens", kText, "lens", -1, true},
    {"reason", kText, "reason", -1, true}, {"lens_id", kBig, "lens_id"},
    {"zoom_counts", kBig, "zoom_counts"},  {"board_views", kInteger, "board_views"}};
constexpr Column kPointColumns[] = {
    {"point", kInteger, "point", -1, true}, {"name", kText, "name", -1, true},
    {"valid", kBool, "valid", -1, true},    {"extrapolated", kBool, "extrapolated", -1, true},
    {"code", kSmall, "code", -1, true},     {"reason", kText, "reason", -1, true},
    {"cx_mm", kReal, "correction_mm", 0},   {"cy_mm", kReal, "correction_mm", 1},
    {"cz_mm", kReal, "correction_mm", 2},   {"correction_mm", kReal, "correction_size_mm"},
    {"x_mm", kNumber, "command_mm", 0},     {"y_mm", kNumber, "command_mm", 1},
    {"z_mm", kNumber, "command_mm", 2},     {"uncertainty_mm", kReal, "uncertainty_mm"},
    {"basis", kText, "basis", -1, true},    {"model", kInteger, "model", -1, true}};

struct Table {
  const char* name;
  const char* type;  ///< third level of the topic
  std::span<const Column> columns;
  const char* further;  ///< a last column that is computed; nullptr: none
};
/// In the order of MessageTable.
constexpr Table kTables[] = {{"probe", "NPROBE", kProbeColumns, "more"},
                             {"alarm", "NALARM", kAlarmColumns, "begins"},
                             {"model", "NMODEL", kModelColumns, nullptr},
                             {"lens", "NLENS", kLensColumns, nullptr},
                             {"point", "NPOINT", kPointColumns, nullptr}};
static_assert(std::size(kTables) == kMessageTables);

/// Further columns of measured.csv that a probe may have.
constexpr std::string_view kMore[] = {"t_s",
                                      "tool",
                                      "payload_item",
                                      "sigma_mm",
                                      "camera",
                                      "range_mm",
                                      "predicted_radius_mm",
                                      "covariance_mm2",
                                      "artefact",
                                      "gauge_mm",
                                      "predicted_mm",
                                      "orientation",
                                      "qd",
                                      "qdd",
                                      "tau",
                                      "q_step_deg"};

/// The value of a key; nullopt if it is absent or null.
std::optional<Element> ValueOf(const Object& json, std::string_view key) {
  const auto found = json.at_key(key);
  if (found.error() != simdjson::SUCCESS || found.value_unsafe().is_null()) return std::nullopt;
  return found.value_unsafe();
}

/// The value of a key as a T; nullopt if it is absent or of another kind.
template <typename T>
std::optional<T> ValueAs(const Object& json, std::string_view key) {
  const auto found = json.at_key(key).get<T>();
  if (found.error() != simdjson::SUCCESS) return std::nullopt;
  return found.value_unsafe();
}

std::int64_t IntegerOr(const Object& json, std::string_view key, std::int64_t otherwise) {
  return ValueAs<std::int64_t>(json, key).value_or(otherwise);
}

std::string TextOf(const Object& json, std::string_view key) {
  return std::string(ValueAs<std::string_view>(json, key).value_or(""));
}

/// Adds a value to the row. @return  false if it is not of the column's kind
bool AddValue(CopyRow& row, Column::Kind kind, const Element& value) {
  switch (kind) {
    case kBig:
    case kInteger:
    case kSmall: {
      const auto integer = value.get_int64();
      if (integer.error() != simdjson::SUCCESS) return false;
      const std::int64_t number = integer.value_unsafe();
      const auto four = static_cast<std::int32_t>(number);
      const auto two = static_cast<std::int16_t>(number);
      if (kind != kBig && number != (kind == kInteger ? four : two)) return false;
      if (kind == kBig) row.Big(number);
      if (kind == kInteger) row.Integer(four);
      if (kind == kSmall) row.Small(two);
      return true;
    }
    case kNumber:
    case kReal: {
      const auto number = value.get_double();
      if (number.error() != simdjson::SUCCESS) return false;
      if (kind == kNumber) {
        row.Double(number.value_unsafe());
        return true;
      }
      if (std::abs(number.value_unsafe()) > std::numeric_limits<float>::max()) return false;
      row.Real(static_cast<float>(number.value_unsafe()));
      return true;
    }
    case kBool: {
      const auto truth = value.get_bool();
      if (truth.error() != simdjson::SUCCESS) return false;
      row.Bool(truth.value_unsafe());
      return true;
    }
    case kText: {
      const auto text = value.get_string();
      if (text.error() != simdjson::SUCCESS || text.value_unsafe().size() > kMaxText) return false;
      row.Text(text.value_unsafe());
      return true;
    }
    case kNumbers: {
      const auto list = value.get_array();
      if (list.error() != simdjson::SUCCESS || list.value_unsafe().size() > kMaxJoints)
        return false;
      std::array<double, kMaxJoints> numbers{};
      std::size_t count = 0;
      for (const Element one : list.value_unsafe()) {
        if (one.get(numbers[count++]) != simdjson::SUCCESS) return false;
      }
      row.Doubles(std::span(numbers).first(count));
      return true;
    }
  }
  return false;
}

Result<CopyRow> RowOf(const Table& table, const Object& json) {
  CopyRow row(512);
  for (const Column& column : table.columns) {
    std::optional<Element> value = ValueOf(json, column.key);
    if (column.index >= 0 && value) {
      const auto list = value->get_array();
      if (list.error() != simdjson::SUCCESS || list.value_unsafe().size() != 3) {
        return Error{fmt::format("{} is not a list of three numbers", column.key)};
      }
      value = list.value_unsafe().at(static_cast<std::size_t>(column.index)).value_unsafe();
      if (!value->is_number()) {
        return Error{fmt::format("{} is not a list of three numbers", column.key)};
      }
    }
    if (!value && !column.required) {
      row.Null();
    } else if (!value || !AddValue(row, column.kind, *value)) {
      return Error{fmt::format("{} {}", column.key,
                               value ? "has a value of another kind or size" : "is missing")};
    }
  }
  return row;
}

std::optional<std::int64_t> StreamOf(std::string_view digits) {
  constexpr std::size_t kDigits = 8;
  std::int64_t stream = 0;
  const auto [end, code] =
      std::from_chars(digits.data(), digits.data() + digits.size(), stream, 16);
  const bool whole = digits.size() == kDigits && code == std::errc() && stream >= 0 &&
                     end == digits.data() + digits.size();
  return whole ? std::optional(stream) : std::nullopt;
}

Result<MessageKey> KeyOf(const Object& json) {
  const auto stream = StreamOf(ValueAs<std::string_view>(json, "stream").value_or(""));
  if (!stream) return Error{"stream is not eight hexadecimal digits"};
  const std::int64_t seq = IntegerOr(json, "seq", 0);
  if (seq <= 0 || seq > kMaxSeq) return Error{"seq is not an integer of 1..2^53"};
  const std::int64_t utc_ms = IntegerOr(json, "timestamp", 0);
  if (utc_ms < kYear2000_ms || utc_ms > kYear2100_ms) {
    return Error{"timestamp is not a time in milliseconds between 2000 and 2100"};
  }
  return MessageKey{*stream, seq, utc_ms};
}

std::int64_t SumOfDropped(const Object& json) {
  constexpr std::int64_t kMost = 1'000'000'000'000;
  std::int64_t sum = 0;
  for (const char* kind : {"states", "changes", "others"}) {
    sum += std::clamp<std::int64_t>(IntegerOr(json, kind, 0), 0, kMost);
  }
  return sum;
}

ProbeSums SumsOf(const Object& json) {
  ProbeSums sums;
  sums.wild = ValueAs<bool>(json, "wild").value_or(false);
  sums.quarantined = ValueAs<bool>(json, "quarantined").value_or(false);
  const auto size = ValueAs<double>(json, "residual_size_mm");
  const auto residual = ValueAs<simdjson::dom::array>(json, "residual_mm");
  sums.compared = size.has_value();
  sums.size_mm = size.value_or(0);
  double* const parts[] = {&sums.dx_mm, &sums.dy_mm, &sums.dz_mm};
  for (std::size_t i = 0; residual && i < 3; ++i) {
    if (residual->at(i).get(*parts[i]) != simdjson::SUCCESS) *parts[i] = 0;
  }
  return sums;
}

/// Number of the model in force, or an error if no column holds it.
Result<int> ModelOf(const Object& json) {
  const std::int64_t model = IntegerOr(json, "model", 0);
  if (model < 0 || model > std::numeric_limits<int>::max()) return Error{"model is out of range"};
  return static_cast<int>(model);
}

/// Further columns of a probe as a JSON object; empty if it has none.
std::string MoreOf(const Object& json) {
  std::string more;
  for (const auto& field : json) {
    if (field.value.is_null() || std::ranges::find(kMore, field.key) == std::end(kMore)) continue;
    more += more.empty() ? "{\"" : ",\"";
    more += field.key;
    more += "\":" + simdjson::minify(field.value);
  }
  return more.empty() ? "" : more + "}";
}

Result<PlantMessage> DecodeRow(MessageTable which, const Object& json, PlantMessage message) {
  auto row = RowOf(kTables[static_cast<std::size_t>(which)], json);
  if (!row) return row.failure();
  message.table = which;
  message.row = std::move(row).value();
  if (which == MessageTable::kProbe) {
    const std::string more = MoreOf(json);
    more.empty() ? message.row.Null() : message.row.Json(more);
    message.probe = SumsOf(json);
  } else if (which == MessageTable::kAlarm) {
    const auto event = ValueAs<std::string_view>(json, "event").value_or("");
    if (event != "begin" && event != "end") return Error{"event is neither begin nor end"};
    message.alarm_begins = event == "begin";
    message.row.Bool(message.alarm_begins);
  } else if (which == MessageTable::kLens) {
    message.lens = std::make_unique<NewestLens>(
        NewestLens{TextOf(json, "camera"), TextOf(json, "lens"), TextOf(json, "reason")});
  }
  return message;
}

Result<PlantMessage> DecodeState(const Object& json, std::string_view payload,
                                 PlantMessage message) {
  const std::int64_t health = IntegerOr(json, "health", -1);
  if (health < 0 || health > 100) return Error{"health is not a small integer"};
  message.state = NewestState{payload, static_cast<int>(health)};
  return message;
}

/// YYYY-MM-DD of 1950..2100; empty if it is no such date.
std::string DateOf(const std::string& text) {
  int year = 0, month = 0, day = 0;
  char rest = 0;
  if (text.size() != 10 ||
      std::sscanf(text.c_str(), "%4d-%2d-%2d%c", &year, &month, &day, &rest) != 3) {  // NOLINT
    return "";
  }
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  return date.ok() && year >= 1950 && year <= 2100 ? text : "";
}

Result<PlantMessage> DecodeCell(const Object& json, PlantMessage message) {
  message.cell = std::make_unique<CellFile>(
      CellFile{TextOf(json, "fingerprint"), TextOf(json, "arm_model"), TextOf(json, "arm_series"),
               DateOf(TextOf(json, "installed")), TextOf(json, "page"), TextOf(json, "cell")});
  const CellFile& cell = *message.cell;
  if (cell.fingerprint.empty()) return Error{"fingerprint is missing"};
  for (const std::string* text :
       {&cell.fingerprint, &cell.arm_model, &cell.arm_series, &cell.page}) {
    if (text->size() > kMaxText)
      return Error{fmt::format("a text has more than {} bytes", kMaxText)};
  }
  return message;
}

Result<PlantMessage> DecodeBirth(const Object& json, std::int64_t number) {
  PlantMessage message;
  message.birth = std::make_unique<Birth>(
      Birth{number, IntegerOr(json, "waiting", 0), TextOf(json, "version"), TextOf(json, "cell")});
  if (message.birth->version.size() > kMaxText || message.birth->name.size() > kMaxText) {
    return Error{fmt::format("a text has more than {} bytes", kMaxText)};
  }
  const auto dropped = ValueAs<Object>(json, "dropped");
  const auto stream = StreamOf(ValueAs<std::string_view>(json, "stream").value_or(""));
  if (dropped && stream) message.dropped = Dropped{*stream, SumOfDropped(*dropped)};
  return message;
}

/// Reads `"NAME":` and digits at the beginning.
bool TakeNumber(std::string_view& text, std::string_view before, std::int64_t& value) {
  if (!text.starts_with(before)) return false;
  text.remove_prefix(before.size());
  const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (code != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

}  // namespace

std::optional<TopicParts> TopicPartsOf(std::string_view topic) {
  std::array<std::string_view, 4> levels;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    const std::size_t end = topic.find('/');
    if ((end == std::string_view::npos) != (i + 1 == levels.size())) return std::nullopt;
    levels[i] = topic.substr(0, end);
    if (levels[i].empty() || levels[i].size() > kMaxName) return std::nullopt;
    topic.remove_prefix(std::min(topic.size(), levels[i].size() + 1));
  }
  if (levels[0] != kNamespace) return std::nullopt;
  return TopicParts{levels[1], levels[2], levels[3]};
}

std::optional<MessageKey> KeyAtBeginningOf(std::string_view payload) {
  constexpr std::string_view kStart = "{\"stream\":\"";
  constexpr std::size_t kDigits = 8;
  if (!payload.starts_with(kStart) || payload.size() < kStart.size() + kDigits) return std::nullopt;
  payload.remove_prefix(kStart.size());
  const auto stream = StreamOf(payload.substr(0, kDigits));
  if (!stream) return std::nullopt;
  MessageKey key{*stream, 0, 0};
  payload.remove_prefix(kDigits);
  if (!TakeNumber(payload, "\",\"seq\":", key.seq) || key.seq <= 0 || key.seq > kMaxSeq ||
      !TakeNumber(payload, ",\"timestamp\":", key.utc_ms) || key.utc_ms < kYear2000_ms ||
      key.utc_ms > kYear2100_ms) {
    return std::nullopt;
  }
  return key;
}

const std::string& CopyStatementOf(MessageTable table) {
  static const std::array<std::string, kMessageTables> kStatements = [] {
    std::array<std::string, kMessageTables> statements;
    for (std::size_t i = 0; i < kMessageTables; ++i) {
      std::string& statement = statements[i];
      statement = fmt::format("COPY {} (cell, stream, seq, utc", kTables[i].name);
      for (const Column& column : kTables[i].columns) statement += fmt::format(", {}", column.name);
      if (kTables[i].further != nullptr) statement += fmt::format(", {}", kTables[i].further);
      statement += ") FROM STDIN (FORMAT binary)";
    }
    return statements;
  }();
  return kStatements[static_cast<std::size_t>(table)];
}

Result<PlantMessage> DecodeMessage(std::string_view type, std::string_view payload) {
  const std::size_t limit = type == "NCELL" ? kMaxCellFile_bytes : kMaxMessage_bytes;
  if (payload.size() > limit) {
    return Error{fmt::format("has {} bytes, at most {} are read", payload.size(), limit)};
  }
  // No text of the database holds it.
  if (payload.find("\\u0000") != std::string_view::npos) return Error{"contains a zero character"};
  thread_local simdjson::dom::parser parser;
  Object json;
  if (const auto fault = parser.parse(payload.data(), payload.size()).get(json)) {
    return Error{fault == simdjson::INCORRECT_TYPE ? "is not a JSON object" : "is not JSON"};
  }
  const bool birth = type == "NBIRTH";
  if (birth || type == "NDEATH") {
    const std::int64_t number = IntegerOr(json, "bdSeq", -1);  // of the connection
    if (number < 0) return Error{"bdSeq is not a number"};
    if (birth) return DecodeBirth(json, number);
    PlantMessage message;
    message.death = Death{number, ValueAs<bool>(json, "clean_shutdown").value_or(false)};
    return message;
  }
  const auto key = KeyOf(json);
  if (!key) return key.failure();
  const auto model = ModelOf(json);
  if (!model) return model.failure();
  PlantMessage message;
  message.key = *key;
  message.model = *model;
  if (type == "NDATA") return DecodeState(json, payload, std::move(message));
  if (type == "NCELL") return DecodeCell(json, std::move(message));
  if (type == "NLOST") {
    message.dropped = Dropped{key->stream, SumOfDropped(json)};
    return message;
  }
  for (std::size_t i = 0; i < kMessageTables; ++i) {
    if (type == kTables[i].type) {
      return DecodeRow(static_cast<MessageTable>(i), json, std::move(message));
    }
  }
  return Error{"is of a type that this collector does not know; update plumbline on this machine"};
}

}  // namespace plumbline::plant
