// Scene message from viewer to daemon: interference and distances of the virtual objects.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware-like/status/scene_status.h"

namespace plumbline::cell {

/// Little-endian: "plumbsc3", interferences (u32), near pairs (u32), unmeasured (u32), blocked
/// paths (u32), smallest [mm] (f32), object a (u16), object b (u16).
inline constexpr std::size_t kSceneMessageBytes = 32;
using SceneMessage = std::array<std::uint8_t, kSceneMessageBytes>;

/// `scene.time_s` is not sent; the receiver stamps the time of arrival.
SceneMessage EncodeScene(const status::SceneStatus& scene);

/// @return  nullopt if the bytes are not a complete message or a value is implausible: a count
///          above kMaxScenePairs, a distance outside 0..1 km, an object number above 9999, or
///          object numbers and distance that contradict each other. Never reads beyond `bytes`.
inline constexpr std::uint32_t kMaxScenePairs = 5000;
std::optional<status::SceneStatus> DecodeScene(std::span<const std::uint8_t> bytes);

}  // namespace plumbline::cell
