// Fuzzer: arbitrary bytes as messages between the daemon and its board process: rejected, or
// encoded to the same bytes again.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "app/camera/board_message.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

bool Equal(const camera::Bytes& made, std::span<const std::uint8_t> given) {
  return std::equal(made.begin(), made.end(), given.begin(), given.end());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::span bytes(data, size);
  if (const auto request = camera::DecodeRequest(bytes)) {
    Require(!FaultOf(request->board) && request->width > 0 && request->height > 0);
    Require(Equal(camera::EncodeRequest(*request), bytes));
  }
  const auto answer = camera::DecodeResponse(bytes);
  if (!answer) return 0;
  Require(Equal(camera::EncodeResponse(*answer), bytes));
  if (!*answer) return 0;
  const lens::BoardView& view = answer->value();
  Require(view.corners_px.size() == view.seen.size() && view.blur_px >= 0);
  for (std::size_t k = 0; k < view.seen.size(); ++k) {
    Require(!view.seen[k] || view.corners_px[k].allFinite());
  }
  return 0;
}
