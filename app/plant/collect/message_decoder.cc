#include "app/plant/collect/message_decoder.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <limits>

#include "app/base/text/json_text.h"
#include "app/plant/database/connection.h"

namespace plumbline::plant {
namespace {

using Json = nlohmann::json;

constexpr std::string_view kNamespace = "plumblineV1";
constexpr std::size_t kMaxName = 64;
constexpr std::int64_t kYear2000_ms = 946'684'800'000, kYear2100_ms = 4'102'444'800'000;
constexpr std::size_t kMaxJoints = 16;

/// A column and where its value is in the message.
struct Column {
  enum class Kind { kInteger, kSmall, kNumber, kReal, kText, kBool, kNumbers };
  const char* name;
  Kind kind;
  const char* key;  ///< of the message
  int index = -1;   ///< of an array of three
  bool required = false;
};
using enum Column::Kind;

constexpr Column kProbeColumns[] = {{"journal", kInteger, "journal", -1, true},
                                    {"id", kInteger, "id", -1, true},
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
    {"camera", kText, "camera", -1, true},    {"lens", kText, "lens", -1, true},
    {"reason", kText, "reason", -1, true},    {"lens_id", kInteger, "lens_id"},
    {"zoom_counts", kInteger, "zoom_counts"}, {"board_views", kInteger, "board_views"}};
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
constexpr const char* kMore[] = {"t_s",      "tool",     "payload_item",        "sigma_mm",
                                 "camera",   "range_mm", "predicted_radius_mm", "covariance_mm2",
                                 "artefact", "gauge_mm", "predicted_mm",        "quaternion"};

/// The value of a key; null if it is absent.
const Json& ValueOf(const Json& json, const char* key) {
  static const Json kNull;
  const auto found = json.find(key);
  return found == json.end() ? kNull : *found;
}

std::optional<std::int64_t> IntegerOf(const Json& value) {
  if (value.is_number_unsigned() &&
      value.get<std::uint64_t>() > std::numeric_limits<std::int64_t>::max()) {
    return std::nullopt;
  }
  if (value.is_number_integer()) return value.get<std::int64_t>();
  return std::nullopt;
}

std::string TextOf(const Json& json, const char* key) {
  const Json& value = ValueOf(json, key);
  return value.is_string() ? value.get<std::string>() : "";
}

/// Whether PostgreSQL stores it: no zero byte.
bool IsStorable(std::string_view text) {
  return text.find('\0') == std::string_view::npos;
}

/// Appends a value. @return  false if it is not of the column's kind
bool AppendValue(std::string& row, const Column& column, const Json& value) {
  switch (column.kind) {
    case kInteger:
    case kSmall: {
      const auto integer = IntegerOf(value);
      if (!integer || (column.kind == kSmall && std::abs(*integer) > 32767)) return false;
      fmt::format_to(std::back_inserter(row), "{}", *integer);
      return true;
    }
    case kNumber:
    case kReal: {
      if (!value.is_number()) return false;
      const double number = value.get<double>();
      if (column.kind == kReal && !(std::abs(number) < std::numeric_limits<float>::max())) {
        return false;
      }
      fmt::format_to(std::back_inserter(row), "{}", number);
      return true;
    }
    case kBool:
      if (!value.is_boolean()) return false;
      row += value.get<bool>() ? 't' : 'f';
      return true;
    case kText: {
      if (!value.is_string()) return false;
      const auto& text = value.get_ref<const std::string&>();
      if (!IsStorable(text)) return false;
      AppendCopyText(row, text);
      return true;
    }
    case kNumbers: {
      if (!value.is_array() || value.size() > kMaxJoints) return false;
      row += '{';
      for (std::size_t i = 0; i < value.size(); ++i) {
        if (!value[i].is_number()) return false;
        fmt::format_to(std::back_inserter(row), "{}{}", i > 0 ? "," : "", value[i].get<double>());
      }
      row += '}';
      return true;
    }
  }
  return false;
}

Result<std::string> RowOf(const Table& table, const Json& json) {
  std::string row;
  for (const Column& column : table.columns) {
    if (&column != table.columns.data()) row += '\t';
    const Json* value = &ValueOf(json, column.key);
    if (column.index >= 0 && !value->is_null()) {
      if (!value->is_array() || value->size() != 3) {
        return Error{fmt::format("{} is not a list of three numbers", column.key)};
      }
      value = &(*value)[static_cast<std::size_t>(column.index)];
    }
    if (value->is_null() && !column.required) {
      row += "\\N";
    } else if (!AppendValue(row, column, *value)) {
      return Error{fmt::format("{} {}", column.key,
                               value->is_null() ? "is missing" : "has a value of another kind")};
    }
  }
  return row;
}

Result<MessageKey> KeyOf(const Json& json) {
  MessageKey key;
  const std::string stream = TextOf(json, "stream");
  const auto [end, code] =
      std::from_chars(stream.data(), stream.data() + stream.size(), key.stream, 16);
  if (stream.size() != 8 || code != std::errc() || end != stream.data() + stream.size() ||
      key.stream < 0) {
    return Error{"stream is not eight hexadecimal digits"};
  }
  const auto seq = IntegerOf(ValueOf(json, "seq"));
  if (!seq || *seq <= 0) return Error{"seq is not a positive integer"};
  const auto utc_ms = IntegerOf(ValueOf(json, "timestamp"));
  if (!utc_ms || *utc_ms < kYear2000_ms || *utc_ms > kYear2100_ms) {
    return Error{"timestamp is not a time in milliseconds between 2000 and 2100"};
  }
  key.seq = *seq;
  key.utc_ms = *utc_ms;
  return key;
}

std::int64_t SumOfDropped(const Json& json) {
  std::int64_t sum = 0;
  for (const char* kind : {"states", "changes", "others"}) {
    const std::int64_t count = IntegerOf(ValueOf(json, kind)).value_or(0);
    sum += std::clamp<std::int64_t>(count, 0, 1'000'000'000'000);
  }
  return sum;
}

double NumberAt(const Json& array, std::size_t index) {
  return array.is_array() && index < array.size() && array[index].is_number()
             ? array[index].get<double>()
             : 0;
}

ProbeSums SumsOf(const Json& json) {
  ProbeSums sums;
  sums.wild = ValueOf(json, "wild").get<bool>();
  sums.quarantined = ValueOf(json, "quarantined").get<bool>();
  const Json& size = ValueOf(json, "residual_size_mm");
  const Json& residual = ValueOf(json, "residual_mm");
  sums.compared = size.is_number();
  if (sums.compared) sums.size_mm = size.get<double>();
  sums.dx_mm = NumberAt(residual, 0);
  sums.dy_mm = NumberAt(residual, 1);
  sums.dz_mm = NumberAt(residual, 2);
  return sums;
}

Result<PlantMessage> DecodeRow(MessageTable which, const Json& json, PlantMessage message) {
  const Table& table = kTables[static_cast<std::size_t>(which)];
  auto row = RowOf(table, json);
  if (!row) return row.failure();
  message.table = which;
  message.row = std::move(row).value();
  if (which == MessageTable::kProbe) {
    Json more = Json::object();
    for (const char* key : kMore) {
      const Json& value = ValueOf(json, key);
      // The predicted tip follows from measured and residual.
      if (!value.is_null() &&
          (std::string_view(key) != "predicted_mm" || ValueOf(json, "residual_mm").is_null())) {
        more[key] = value;
      }
    }
    const std::string text = more.empty() ? "" : text::JsonText(more);
    if (text.find("\\u0000") != std::string::npos) return Error{"a text contains a zero byte"};
    message.row += '\t';
    if (text.empty()) {
      message.row += "\\N";
    } else {
      AppendCopyText(message.row, text);
    }
    message.probe = SumsOf(json);
  } else if (which == MessageTable::kAlarm) {
    const std::string event = TextOf(json, "event");
    if (event != "begin" && event != "end") return Error{"event is neither begin nor end"};
    message.alarm_begins = event == "begin";
    message.row += message.alarm_begins ? "\tt" : "\tf";
  } else if (which == MessageTable::kLens) {
    message.lens = NewestLens{TextOf(json, "camera"), TextOf(json, "lens"), TextOf(json, "reason")};
  }
  const std::int64_t model = IntegerOf(ValueOf(json, "model")).value_or(0);
  if (model < 0 || model > std::numeric_limits<int>::max()) return Error{"model is out of range"};
  message.model = static_cast<int>(model);
  return message;
}

Result<PlantMessage> DecodeState(const Json& json, PlantMessage message) {
  const auto health = IntegerOf(ValueOf(json, "health"));
  if (!health || *health < 0 || *health > 100) return Error{"health is not a small integer"};
  Json state = json;
  for (const char* key : {"stream", "seq", "timestamp"}) state.erase(key);
  message.state = NewestState{text::JsonText(state), static_cast<int>(*health)};
  if (message.state->json.find("\\u0000") != std::string::npos) {
    return Error{"a text contains a zero byte"};
  }
  const std::int64_t model = IntegerOf(ValueOf(json, "model")).value_or(0);
  message.model = static_cast<int>(std::clamp<std::int64_t>(model, 0, 1'000'000'000));
  return message;
}

Result<PlantMessage> DecodeCell(const Json& json, PlantMessage message) {
  CellFile cell{TextOf(json, "fingerprint"), TextOf(json, "arm_model"), TextOf(json, "arm_series"),
                TextOf(json, "installed"),   TextOf(json, "page"),      TextOf(json, "cell")};
  for (const std::string* text : {&cell.fingerprint, &cell.arm_model, &cell.arm_series,
                                  &cell.installed, &cell.page, &cell.toml}) {
    if (!IsStorable(*text)) return Error{"a text contains a zero byte"};
  }
  if (cell.fingerprint.empty()) return Error{"fingerprint is missing"};
  const std::int64_t model = IntegerOf(ValueOf(json, "model")).value_or(0);
  message.model = static_cast<int>(std::clamp<std::int64_t>(model, 0, 1'000'000'000));
  message.cell = std::move(cell);
  return message;
}

/// Number of the connection; births and deaths have no sequence number.
Result<std::int64_t> ConnectionOf(const Json& json) {
  const auto number = IntegerOf(ValueOf(json, "bdSeq"));
  if (!number || *number < 0) return Error{"bdSeq is not a number"};
  return *number;
}

std::optional<Dropped> DroppedOf(const Json& counts, const std::string& stream) {
  Dropped dropped;
  const auto [end, code] =
      std::from_chars(stream.data(), stream.data() + stream.size(), dropped.stream, 16);
  if (stream.size() != 8 || code != std::errc() || dropped.stream < 0) return std::nullopt;
  dropped.messages = counts.is_object() ? SumOfDropped(counts) : 0;
  return dropped;
}

Result<PlantMessage> DecodeBirth(const Json& json) {
  const auto number = ConnectionOf(json);
  if (!number) return number.failure();
  PlantMessage message;
  const std::int64_t waiting = IntegerOf(ValueOf(json, "waiting")).value_or(0);
  message.birth = Birth{*number, waiting, TextOf(json, "version"), TextOf(json, "cell")};
  if (!IsStorable(message.birth->version) || !IsStorable(message.birth->name)) {
    return Error{"a text contains a zero byte"};
  }
  message.dropped = DroppedOf(ValueOf(json, "dropped"), TextOf(json, "stream"));
  return message;
}

Result<PlantMessage> DecodeDeath(const Json& json) {
  const auto number = ConnectionOf(json);
  if (!number) return number.failure();
  PlantMessage message;
  const Json& clean = ValueOf(json, "clean_shutdown");
  message.death = Death{*number, clean.is_boolean() && clean.get<bool>()};
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
  MessageKey key;
  const auto [end, code] =
      std::from_chars(payload.data(), payload.data() + kDigits, key.stream, 16);
  if (code != std::errc() || end != payload.data() + kDigits || key.stream < 0) return std::nullopt;
  payload.remove_prefix(kDigits);
  if (!TakeNumber(payload, "\",\"seq\":", key.seq) || key.seq <= 0 ||
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
      statement += ") FROM STDIN";
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
  const auto json = text::JsonFromText(payload);
  if (!json) return json.failure();
  if (!json->is_object()) return Error{"is not a JSON object"};
  if (type == "NBIRTH") return DecodeBirth(*json);
  if (type == "NDEATH") return DecodeDeath(*json);
  const auto key = KeyOf(*json);
  if (!key) return key.failure();
  PlantMessage message;
  message.key = *key;
  if (type == "NDATA") return DecodeState(*json, std::move(message));
  if (type == "NCELL") return DecodeCell(*json, std::move(message));
  if (type == "NLOST") {
    message.dropped = Dropped{key->stream, SumOfDropped(*json)};
    return message;
  }
  for (std::size_t i = 0; i < kMessageTables; ++i) {
    if (type == kTables[i].type) {
      return DecodeRow(static_cast<MessageTable>(i), *json, std::move(message));
    }
  }
  return Error{"is of a type that this collector does not know; update plumbline on this machine"};
}

}  // namespace plumbline::plant
