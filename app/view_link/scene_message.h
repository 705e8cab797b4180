// The one thing that a viewer may say: what it measured between virtual objects.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware-like/status/scene_status.h"

namespace plumbline {

/// Little-endian: "plumbsc2", interferences (u32), unmeasured (u32), blocked paths (u32), smallest
/// [mm] (f32), object a (u16), object b (u16).
inline constexpr std::size_t kSceneMessageBytes = 28;
using SceneMessage = std::array<std::uint8_t, kSceneMessageBytes>;

/// The time of `scene` does not travel: who receives it knows when.
SceneMessage BytesOfScene(const SceneStatus& scene);

/// @return  nothing where the bytes are no whole message or their values make no sense: more than
///          kMostScenePairs, a distance that is not 0..1 km, object numbers above 9999, or numbers
///          and distance that contradict each other. Never reads beyond `bytes`.
inline constexpr std::uint32_t kMostScenePairs = 5000;
std::optional<SceneStatus> SceneOfBytes(std::span<const std::uint8_t> bytes);

}  // namespace plumbline
