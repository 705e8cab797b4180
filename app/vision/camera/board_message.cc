#include "app/vision/camera/board_message.h"

#include <cmath>
#include <cstring>
#include <string>

namespace plumbline::vision {
namespace {

constexpr std::int32_t kMaxSide_px = 16384;
constexpr std::uint8_t kFound = 1, kNone = 0;

template <typename T>
void Put(Bytes& bytes, const T& value) {
  const auto* raw = reinterpret_cast<const std::uint8_t*>(&value);
  bytes.insert(bytes.end(), raw, raw + sizeof value);
}

/// Reads values from the front; Take() returns false if too few bytes remain.
class Reader {
 public:
  explicit Reader(std::span<const std::uint8_t> bytes) : rest_(bytes) {}
  template <typename T>
  bool Take(T& value) {
    if (rest_.size() < sizeof value) return false;
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_ = rest_.subspan(sizeof value);
    return true;
  }
  std::span<const std::uint8_t> rest() const { return rest_; }

 private:
  std::span<const std::uint8_t> rest_;
};

}  // namespace

Bytes EncodeRequest(const BoardRequest& request) {
  const target::Board& board = request.board;
  Bytes bytes;
  for (const std::int32_t value : {request.width, request.height, board.columns, board.rows}) {
    Put(bytes, value);
  }
  Put(bytes, board.square_m);
  Put(bytes, board.marker_m);
  Put(bytes, static_cast<std::uint8_t>(board.kind));
  bytes.insert(bytes.end(), board.family.begin(), board.family.end());
  return bytes;
}

std::optional<BoardRequest> DecodeRequest(std::span<const std::uint8_t> bytes) {
  BoardRequest request;
  target::Board& board = request.board;
  Reader reader(bytes);
  std::uint8_t kind = 0;
  const bool whole = reader.Take(request.width) && reader.Take(request.height) &&
                     reader.Take(board.columns) && reader.Take(board.rows) &&
                     reader.Take(board.square_m) && reader.Take(board.marker_m) &&
                     reader.Take(kind);
  const auto side = [](std::int32_t v) { return v >= 1 && v <= kMaxSide_px; };
  if (!whole || bytes.size() > kMaxBoardRequest_bytes || !side(request.width) ||
      !side(request.height) ||
      kind > static_cast<std::uint8_t>(target::BoardKind::kAsymmetricCircles)) {
    return std::nullopt;
  }
  board.kind = static_cast<target::BoardKind>(kind);
  board.family.assign(reader.rest().begin(), reader.rest().end());
  if (FaultOf(board)) return std::nullopt;
  return request;
}

Bytes EncodeResponse(const Result<BoardView>& answer) {
  Bytes bytes;
  if (!answer) {
    Put(bytes, kNone);
    bytes.insert(bytes.end(), answer.error().begin(), answer.error().end());
    return bytes;
  }
  Put(bytes, kFound);
  Put(bytes, answer->blur_px);
  Put(bytes, static_cast<std::uint32_t>(answer->corners_px.size()));
  for (std::size_t k = 0; k < answer->corners_px.size(); ++k) {
    Put(bytes, answer->corners_px[k].x());
    Put(bytes, answer->corners_px[k].y());
    Put(bytes, static_cast<std::uint8_t>(answer->seen[k] ? 1 : 0));
  }
  return bytes;
}

std::optional<Result<BoardView>> DecodeResponse(std::span<const std::uint8_t> bytes) {
  Reader reader(bytes);
  std::uint8_t kind = kNone;
  if (!reader.Take(kind) || kind > kFound) return std::nullopt;
  if (kind == kNone) {
    return Result<BoardView>(Error{std::string(reader.rest().begin(), reader.rest().end())});
  }
  BoardView view;
  std::uint32_t count = 0;
  if (!reader.Take(view.blur_px) || !reader.Take(count) ||
      !(view.blur_px >= 0 && std::isfinite(view.blur_px)) ||
      reader.rest().size() != count * std::size_t{17}) {
    return std::nullopt;
  }
  for (std::uint32_t k = 0; k < count; ++k) {
    double x = 0, y = 0;
    std::uint8_t seen = 0;
    if (!reader.Take(x) || !reader.Take(y) || !reader.Take(seen)) return std::nullopt;
    if (seen > 1 || (seen == 1 && !(std::isfinite(x) && std::isfinite(y)))) return std::nullopt;
    view.corners_px.emplace_back(x, y);
    view.seen.push_back(seen == 1);
  }
  return Result<BoardView>(std::move(view));
}

}  // namespace plumbline::vision
