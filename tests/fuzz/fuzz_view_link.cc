// Fuzzer: arbitrary text as the daemon's states and points. Rejected, or within the limits and
// unchanged by a round trip.
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "app/cell/view_link/view_json.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

void TakeState(std::string_view text) {
  const auto state = cell::ViewOfJson(text);
  if (!state) {
    Require(!state.error().empty());
    return;
  }
  for (const cell::ViewCamera& camera : state->cameras) {
    if (camera.lens) Require(camera.lens->fx > 0 && camera.lens->fy > 0);
    if (camera.image) Require(camera.image->width > 0 && camera.image->slot >= 0);
  }
  Require(cell::ViewOfJson(cell::JsonOfView(*state)).ok());
}

void TakePoints(std::string_view text) {
  const auto points = cell::PointsOfJson(text);
  if (points) Require(cell::PointsOfJson(cell::JsonOfPoints(*points)).ok());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  TakeState({reinterpret_cast<const char*>(data), size});
  TakePoints({reinterpret_cast<const char*>(data), size});
  return 0;
}
