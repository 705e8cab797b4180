// The daemon's side of the view: images and states for whoever looks.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/view_link/scene_message.h"
#include "app/view_link/view_state.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/lens/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Listens on a socket of the file system; whoever may open that file may look. What can be said
/// through it is one message of 24 bytes (scene_message.h), by the daemon's own user. A new viewer
/// is handed the memory in which the images lie, to read only; then a message (view_json.h) comes
/// for every state. Nobody is waited for: a viewer whose socket is full misses that state and gets
/// the next, and one that stays away costs nothing: with no viewer at all, nothing is copied.
///
/// Images of each camera go round kSlotsEach places of its own. A viewer copies one and then looks
/// whether the place's stamp is still the one that the state named; a viewer slower than
/// kSlotsEach - 1 images of that camera sees that it is not.
class ViewPublisher {
 public:
  static constexpr int kSlotsEach = 3, kSlots = kSlotsEach * static_cast<int>(kMostCameras);
  static constexpr int kMostViewers = 8;

  /// @param path  of the socket; one that is left over is replaced. At most 107 bytes.
  static Result<std::unique_ptr<ViewPublisher>> Open(const std::string& path);
  ~ViewPublisher();
  ViewPublisher(const ViewPublisher&) = delete;
  ViewPublisher& operator=(const ViewPublisher&) = delete;

  /// Lets new viewers in and old ones go; whether anybody looks. Call it before work is done for
  /// them.
  bool Watched();

  /// Copies an image into the camera's next slot. @param bgr  the same in colour, no padding; may
  /// be null. @return  its place, without time and sequence; nothing where there is no memory for
  /// it
  std::optional<ViewImage> Share(std::size_t camera, const LumaView& luma, const std::uint8_t* bgr);
  /// Counts memories: where it has changed, images that were shared before are gone.
  int memory_number() const { return memory_number_; }

  void Send(const ViewState& state);

  /// The newest that a viewer of the daemon's own user said (scene_message.h), with the moment at
  /// which Watched() took it; nothing: none did. What others say, or what is no such message, is
  /// thrown away.
  const std::optional<SceneStatus>& scene() const { return scene_; }

 private:
  struct Viewer {
    Descriptor socket;
    int memory_handed = -1;  ///< which memory it knows
    bool may_tell = false;   ///< it runs as the daemon's own user
  };
  ViewPublisher(std::string path, Descriptor socket);
  bool Reserve(std::size_t bytes);
  void Accept();
  bool HandMemory(Viewer& viewer);
  void Drop(std::size_t index);

  const std::string path_;
  const Descriptor socket_;
  std::vector<Viewer> viewers_;
  Descriptor memory_;
  int memory_number_ = 0;
  std::uint8_t* at_ = nullptr;
  std::size_t slot_bytes_ = 0;
  std::array<int, kMostCameras> next_{};  ///< of the camera's own slots
  std::uint32_t stamp_ = 0;
  bool Hear(const Viewer& viewer);
  std::optional<SceneStatus> scene_;
};

/// At the begin of each slot; the pixels follow at kViewPixels.
struct ViewSlotHead {
  std::uint32_t stamp;  ///< 0 while it is filled; read and written atomically
};
inline constexpr std::size_t kViewPixels = 64;

/// Between a slot's stamp and its pixels, on both sides: neither may overtake the other.
/// ThreadSanitizer knows no fences, and refuses them.
inline void OrderStampAndPixels() {
#ifndef __SANITIZE_THREAD__
  std::atomic_thread_fence(std::memory_order_seq_cst);
#endif
}

/// The first message after connecting, and again when the memory was replaced; with its descriptor.
struct ViewMemory {
  char magic[8] = {'p', 'l', 'u', 'm', 'b', 'v', 'w', '1'};
  std::uint64_t slot_bytes = 0;
};

}  // namespace plumbline
