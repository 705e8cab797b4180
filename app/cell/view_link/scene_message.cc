#include "app/cell/view_link/scene_message.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

namespace plumbline::cell {
namespace {

static_assert(std::endian::native == std::endian::little);
constexpr std::array<std::uint8_t, 8> kMagic = {'p', 'l', 'u', 'm', 'b', 's', 'c', '3'};
constexpr double kMillimetres = 1e3;
constexpr float kMaxDistance_mm = 1e6F;
constexpr std::uint16_t kMaxObjectNumber = 9999;

struct Fields {
  std::uint32_t interferences = 0, near = 0, unmeasured = 0, blocked = 0;
  float smallest_mm = 0;
  std::uint16_t object_a = 0, object_b = 0;
};
static_assert(kMagic.size() + sizeof(Fields) == kSceneMessageBytes);

}  // namespace

SceneMessage EncodeScene(const status::SceneStatus& scene) {
  const Fields fields{scene.interferences,
                      scene.near,
                      scene.unmeasured,
                      scene.blocked,
                      static_cast<float>(kMillimetres * scene.smallest_m),
                      scene.object_a,
                      scene.object_b};
  SceneMessage message;
  std::copy(kMagic.begin(), kMagic.end(), message.begin());
  std::memcpy(message.data() + kMagic.size(), &fields, sizeof fields);
  return message;
}

std::optional<status::SceneStatus> DecodeScene(std::span<const std::uint8_t> bytes) {
  if (bytes.size() != kSceneMessageBytes) return std::nullopt;
  if (!std::equal(kMagic.begin(), kMagic.end(), bytes.begin())) return std::nullopt;
  Fields fields;
  std::memcpy(&fields, bytes.data() + kMagic.size(), sizeof fields);
  const bool counts = fields.interferences <= kMaxScenePairs && fields.near <= kMaxScenePairs &&
                      fields.unmeasured <= kMaxScenePairs && fields.blocked <= kMaxScenePairs;
  const bool distance = fields.smallest_mm >= 0 && fields.smallest_mm <= kMaxDistance_mm;
  const bool numbers = fields.object_a <= kMaxObjectNumber && fields.object_b <= kMaxObjectNumber &&
                       (fields.object_a == 0) == (fields.object_b == 0);
  const bool distance_of_nothing = fields.object_a == 0 && fields.smallest_mm != 0;
  if (!counts || !distance || !numbers || distance_of_nothing) return std::nullopt;
  status::SceneStatus scene;
  scene.interferences = fields.interferences;
  scene.near = fields.near;
  scene.unmeasured = fields.unmeasured;
  scene.blocked = fields.blocked;
  scene.smallest_m = static_cast<double>(fields.smallest_mm) / kMillimetres;
  scene.object_a = fields.object_a;
  scene.object_b = fields.object_b;
  return scene;
}

}  // namespace plumbline::cell
