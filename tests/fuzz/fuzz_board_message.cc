// Fuzzer: arbitrary bytes as messages between the daemon and its board process: rejected, or
// encoded to the same bytes again.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "app/vision/camera/board_message.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

bool Equal(const vision::Bytes& made, std::span<const std::uint8_t> given) {
  return std::equal(made.begin(), made.end(), given.begin(), given.end());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(data, size);
  if (const auto request = vision::DecodeRequest(bytes)) {
    Require(!FaultOf(request->board) && request->width > 0 && request->height > 0);
    Require(Equal(vision::EncodeRequest(*request), bytes));
  }
  const auto answer = vision::DecodeResponse(bytes);
  if (!answer) return 0;
  Require(Equal(vision::EncodeResponse(*answer), bytes));
  if (!*answer) return 0;
  const vision::BoardView& view = answer->value();
  Require(view.corners_px.size() == view.seen.size() && view.blur_px >= 0);
  for (std::size_t k = 0; k < view.seen.size(); ++k) {
    Require(!view.seen[k] || view.corners_px[k].allFinite());
  }
  return 0;
}
