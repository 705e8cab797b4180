// Daemon's end of the view link: publishes states and images to viewers.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/cell/view_link/view_state.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/image/luma_view.h"
#include "firmware-like/result.h"

namespace plumbline::cell {

/// Listens on a Unix socket; the file's mode decides who may connect. What viewers send is
/// discarded. A viewer receives one message (ViewMessage) per state, which carries descriptors of
/// read-only memory: the state's text (view_json.h), and the points and the images where it does
/// not have them yet. So a message is small however large the state, and each text is encoded once
/// for all viewers. The publisher never waits: a viewer whose socket is full misses that state and
/// gets the next; what waits in its socket keeps a few states in memory. Without viewers nothing is
/// copied.
///
/// The images of a camera cycle through its kSlotsPerCamera slots. A viewer copies an image and
/// then checks that the slot's stamp is still the one given in the state; it differs if the viewer
/// was slower than kSlotsPerCamera - 1 images of that camera.
class ViewPublisher {
 public:
  static constexpr int kSlotsPerCamera = 3,
                       kSlots = kSlotsPerCamera * static_cast<int>(model::kMaxCameras);
  static constexpr int kMaxViewers = 8;

  /// @param path  of the socket, at most 107 bytes; a leftover socket is replaced
  static Result<std::unique_ptr<ViewPublisher>> Open(const std::string& path);
  ~ViewPublisher();
  ViewPublisher(const ViewPublisher&) = delete;
  ViewPublisher& operator=(const ViewPublisher&) = delete;

  /// Accepts new viewers and drops disconnected ones. Call it before doing work for viewers.
  /// @return  whether there is a viewer
  bool PollViewers();

  /// Copies an image into the camera's next slot.
  /// @param bgr  the same image in colour, without padding; may be null
  /// @return     its location, with time and sequence left to the caller; nullopt if there is no
  ///             memory for it
  std::optional<ViewImage> Share(std::size_t camera, const image::LumaView& luma,
                                 const std::uint8_t* bgr);
  /// Number of the shared memory. When it changes, images shared earlier are gone.
  int memory_number() const { return memory_number_; }

  /// Sends the state to each viewer, and the points to those that do not have that list yet.
  void Send(const ViewState& state);

 private:
  struct Viewer {
    os::Descriptor socket;
    int memory_sent = 0;            ///< number of the shared memory that it was sent; 0: none
    std::uint64_t points_sent = 0;  ///< number of the points that it was sent; 0: none
  };
  ViewPublisher(std::string path, os::Descriptor socket);
  bool Reserve(std::size_t bytes);
  void Accept();
  static bool Connected(const Viewer& viewer);
  /// @return  false if the viewer has disconnected
  bool SendTo(Viewer& viewer, const os::Descriptor& state);
  void Drop(std::size_t index);

  const std::string path_;
  const os::Descriptor socket_;
  std::vector<Viewer> viewers_;
  os::Descriptor points_;  ///< text of the points
  std::uint64_t points_number_ = 0;
  os::Descriptor memory_;  ///< of the images
  int memory_number_ = 0;
  std::uint8_t* at_ = nullptr;
  std::size_t slot_bytes_ = 0;
  std::array<int, model::kMaxCameras> next_{};  ///< next slot of each camera
  std::uint32_t stamp_ = 0;
};

/// Header of a slot; the pixels follow at offset kViewPixels.
struct ViewSlotHead {
  std::uint32_t stamp;  ///< 0 while the slot is being filled; accessed atomically
};
inline constexpr std::size_t kViewPixels = 64;

/// Prevents reordering of the accesses to a slot's stamp and its pixels, in publisher and client.
/// ThreadSanitizer does not support fences.
inline void OrderStampAndPixels() {
#ifndef __SANITIZE_THREAD__
  std::atomic_thread_fence(std::memory_order_seq_cst);
#endif
}

/// Message of the publisher. It carries the descriptor of a state's text, and then those of the
/// points' text and the images' memory if `points` and `images` say so. A points list and images
/// stay in use until others arrive.
struct ViewMessage {
  static constexpr std::size_t kMaxDescriptors = 3;
  char magic[8] = {'p', 'l', 'u', 'm', 'b', 'v', 'w', '2'};
  std::uint64_t slot_bytes = 0;  ///< of the images' memory
  std::uint32_t points = 0, images = 0;
};

}  // namespace plumbline::cell
