// What a plant is told, before it has its number.
#pragma once

#include <cstdint>
#include <string>

namespace plumbline {

/// A kind of message is a level of its topic. Its number stands in the queue's file.
enum class MessageKind : std::uint8_t {
  kState = 0,  ///< NDATA
  kPoint = 1,  ///< NPOINT
  kLens = 2,   ///< NLENS
  kModel = 3,  ///< NMODEL
  kAlarm = 4,  ///< NALARM
  kProbe = 5,  ///< NPROBE
  kLost = 6,   ///< NLOST
};
inline constexpr int kMessageKinds = 7;

const char* TopicTypeOf(MessageKind kind);

/// What is dropped first where room is short: 0 states, 1 what is told again or can be asked for,
/// 2 what happened once.
int ImportanceOf(MessageKind kind);
inline constexpr int kImportances = 3;

struct Message {
  MessageKind kind = MessageKind::kState;
  std::int64_t utc_ms = 0;  ///< when it was so
  std::string body;         ///< JSON object
};

/// A message in the queue. `seq` counts up from 1 without gaps, over restarts; a number that was
/// given is never given again.
struct QueuedMessage {
  std::int64_t seq = 0;
  Message message;
};

}  // namespace plumbline
