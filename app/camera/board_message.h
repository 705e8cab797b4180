// What the daemon and its detecting worker say to each other, as bytes. Both run the same program
// on the same machine; the lengths are checked all the same.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "app/lens/board.h"
#include "firmware-like/result.h"

namespace plumbline {

/// The image itself lies in shared memory, row by row, no padding.
struct BoardRequest {
  std::int32_t width = 0, height = 0;
  Board board;
};

using Bytes = std::vector<std::uint8_t>;

inline constexpr std::size_t kLargestBoardMessage = 1 << 18;
inline constexpr std::size_t kLargestBoardRequest = 256;

Bytes BytesOfRequest(const BoardRequest& request);
/// @return  nothing where the length or a number is impossible
std::optional<BoardRequest> RequestOfBytes(std::span<const std::uint8_t> bytes);

/// A view without name and time, or why there is none.
Bytes BytesOfAnswer(const Result<BoardView>& answer);
std::optional<Result<BoardView>> AnswerOfBytes(std::span<const std::uint8_t> bytes);

}  // namespace plumbline
