// Message to the plant's broker, before and after it has a sequence number.
#pragma once

#include <cstdint>
#include <string>

namespace plumbline::plant {

/// Kind of a message, which determines its topic. The numbers are stored in the queue's file.
enum class MessageKind : std::uint8_t {
  kState = 0,  ///< NDATA
  kPoint = 1,  ///< NPOINT
  kLens = 2,   ///< NLENS
  kModel = 3,  ///< NMODEL
  kAlarm = 4,  ///< NALARM
  kProbe = 5,  ///< NPROBE
  kLost = 6,   ///< NLOST
  kCell = 7,   ///< NCELL
};

const char* TopicTypeOf(MessageKind kind);

/// Order in which a full queue drops messages: 0 (first) states; 1 changes, which are reported
/// again; 2 unique events.
int ImportanceOf(MessageKind kind);
inline constexpr int kImportances = 3;

struct Message {
  MessageKind kind = MessageKind::kState;
  std::int64_t utc_ms = 0;  ///< time of the event
  std::string body;         ///< JSON object
};

/// A message in the queue. `seq` counts from 1 without gaps, across restarts, and is never reused.
struct QueuedMessage {
  std::int64_t seq = 0;
  Message message;
};

}  // namespace plumbline::plant
