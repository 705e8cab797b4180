// Decoder of the messages that plumbline-fleet publishes, to rows of the plant's tables.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "app/plant/database/copy_rows.h"
#include "firmware-like/result.h"

namespace plumbline::plant {

/// Levels of a topic plumblineV1/LINE/TYPE/NODE.
struct TopicParts {
  std::string_view line, type, node;
};
std::optional<TopicParts> TopicPartsOf(std::string_view topic);

/// The cell's own number of a message, and its time.
struct MessageKey {
  std::int64_t stream = 0;  ///< 32 bits
  std::int64_t seq = 0;     ///< 1..2^53
  std::int64_t utc_ms = 0;  ///< 2000..2100
};

/// Without decoding the rest: the beginning of a message as plumbline-fleet writes it. nullopt if
/// it does not begin so.
std::optional<MessageKey> KeyAtBeginningOf(std::string_view payload);

/// Tables that a message becomes a row of; the order is that of kTables in message_decoder.cc.
enum class MessageTable { kProbe, kAlarm, kModel, kLens, kPoint };
inline constexpr std::size_t kMessageTables = 5;
/// `COPY probe (cell, stream, seq, utc, ...) FROM STDIN (FORMAT binary)`.
const std::string& CopyStatementOf(MessageTable table);

/// What a message contributes to the sums and to the newest state of its cell.
struct ProbeSums {
  bool wild = false, quarantined = false, compared = false;
  double size_mm = 0, dx_mm = 0, dy_mm = 0, dz_mm = 0;
};
struct NewestState {
  std::string_view json;  ///< the payload
  int health = 0;
};
struct NewestLens {
  std::string camera, lens, reason;
};
struct CellFile {
  std::string fingerprint, arm_model, arm_series, installed, page, toml;
};
struct Birth {
  std::int64_t bdSeq = 0, waiting = 0;
  std::string version, name;
};
struct Death {
  std::int64_t bdSeq = 0;
  bool clean_shutdown = false;
};
struct Dropped {
  std::int64_t stream = 0, messages = 0;
};

struct PlantMessage {
  std::optional<MessageKey> key;  ///< absent for births and deaths
  std::optional<MessageTable> table;
  CopyRow row;    ///< of `table`, from the fifth column on
  int model = 0;  ///< that was in force, if the message says so
  std::optional<ProbeSums> probe;
  bool alarm_begins = false;
  std::optional<NewestState> state;
  std::unique_ptr<NewestLens> lens;
  std::unique_ptr<CellFile> cell;
  std::unique_ptr<Birth> birth;
  std::optional<Death> death;
  std::optional<Dropped> dropped;
};

/// Largest message: of a cell's file, of all others.
inline constexpr std::size_t kMaxCellFile_bytes = 300'000, kMaxMessage_bytes = 65'536;

/// Pure; the result refers to the payload. Any bytes are a message or an error that says what is
/// wrong with them.
/// @param type  third level of the topic
Result<PlantMessage> DecodeMessage(std::string_view type, std::string_view payload);

}  // namespace plumbline::plant
