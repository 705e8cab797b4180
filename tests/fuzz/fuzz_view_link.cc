// Fuzzer: arbitrary bytes between daemon and viewer: scene messages of the viewer (32 bytes),
// states and points of the daemon (text). Rejected, or within the limits and unchanged by a round
// trip.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string_view>

#include "app/cell/view_link/scene_message.h"
#include "app/cell/view_link/view_json.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

void Require(bool condition) {
  if (!condition) std::abort();
}

void TakeScene(std::span<const std::uint8_t> bytes) {
  const auto scene = cell::DecodeScene(bytes);
  if (!scene) return;
  Require(scene->interferences <= cell::kMaxScenePairs && scene->near <= cell::kMaxScenePairs &&
          scene->unmeasured <= cell::kMaxScenePairs);
  Require(scene->smallest_m >= 0 && scene->smallest_m <= 1000);
  Require((scene->object_a == 0) == (scene->object_b == 0));
  const auto again = cell::DecodeScene(cell::EncodeScene(*scene));
  Require(again && again->interferences == scene->interferences &&
          again->object_a == scene->object_a && again->object_b == scene->object_b &&
          std::abs(again->smallest_m - scene->smallest_m) <= 1e-6 * scene->smallest_m);
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
  TakeScene({data, size});
  TakeState({reinterpret_cast<const char*>(data), size});
  TakePoints({reinterpret_cast<const char*>(data), size});
  return 0;
}
