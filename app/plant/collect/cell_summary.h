// What a batch of messages changes in the sums of its cells and in their newest states.
#pragma once

#include "app/plant/collect/message_batch.h"
#include "app/plant/database/connection.h"

namespace plumbline::plant {

/// Adds to `cell_day`.
Result<void> WriteCellDays(Connection& connection, const MessageBatch& batch);

/// Updates `cell`, `cell_file`, `camera_now` and what `stream` says about dropped messages.
/// @param now_s  UTC
Result<void> WriteCells(Connection& connection, const MessageBatch& batch, double now_s);

}  // namespace plumbline::plant
