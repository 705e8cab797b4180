// Messages between the daemon and its board worker, encoded as bytes.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "app/base/target/board.h"
#include "app/vision/lens/board_view.h"
#include "firmware-like/result.h"

// Both ends are the same program on the same machine, so values have native layout; lengths and
// ranges are checked nevertheless.
namespace plumbline::vision {

/// Request to detect a board. The image itself is in shared memory, row by row without padding.
struct BoardRequest {
  std::int32_t width = 0, height = 0;
  target::Board board;
};

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kMaxBoardResponse_bytes = 1 << 18;
inline constexpr std::size_t kMaxBoardRequest_bytes = 256;

Bytes EncodeRequest(const BoardRequest& request);
/// @return  nullopt if the length or a value is out of range
std::optional<BoardRequest> DecodeRequest(std::span<const std::uint8_t> bytes);

/// Response: the detected view without its name and time, or the reason why there is none.
Bytes EncodeResponse(const Result<BoardView>& response);
/// @return  nullopt if the bytes are malformed
std::optional<Result<BoardView>> DecodeResponse(std::span<const std::uint8_t> bytes);

}  // namespace plumbline::vision
