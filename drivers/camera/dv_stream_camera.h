// DV camcorder whose frames another program writes to a FIFO, such as dvgrab from IEEE 1394.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/back_off.h"
#include "drivers/camera/camera.h"
#include "drivers/camera/dif_stream.h"
#include "drivers/camera/dv_decoder.h"
#include "drivers/clock.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

struct DvStreamOptions {
  std::string fifo = {};    ///< path of an existing FIFO
  std::string serial = {};  ///< name under which its lenses are stored; empty: "dv@" and the path
  std::string dv_decoder = DvProgram();
};

/// Reads raw DV frames from a FIFO. A thread of its own drains the FIFO at all times: otherwise
/// frames would queue in the writing program, and an old picture would be taken for a new one. The
/// picture is one field with square pixels. `time_s` is when the last byte of the frame arrived,
/// later than the exposure by what the camcorder and the writer need. A FIFO that stays silent for
/// 5 s is opened again, in case the writer has replaced it.
class DvStreamCamera : public Camera {
 public:
  /// Fails for an empty path.
  static Result<std::unique_ptr<Camera>> Create(const DvStreamOptions& options, Clock clock);
  ~DvStreamCamera() override { Close(); }

  CameraResult Read(double timeout_s, CameraFrame& frame) override;
  const CameraIdentity& identity() const override { return identity_; }
  std::string_view problem() const override { return problem_; }
  std::vector<std::string> TakeRemarks() override;
  const std::vector<std::uint8_t>* Bgr() override;

 private:
  /// Frame that the draining thread hands over.
  struct Arrived {
    std::vector<std::uint8_t> frame;  ///< empty if none came since the last was taken
    double time_s = 0;
    std::uint64_t sequence = 0;  ///< counts complete and damaged frames
    std::uint64_t damaged = 0;
    std::uint64_t skipped = 0;  ///< bytes outside valid frames
    std::string why_damaged;
    double last_byte_s = 0;
  };

  DvStreamCamera(DvStreamOptions options, Clock clock);
  Result<void> Open();
  void Close();
  void Drain();
  /// Takes one piece of the stream. @return false if there is none
  bool DrainPiece(DifStream& stream, std::vector<std::uint8_t>& piece);
  /// Waits for a frame and moves it to `raw_`. @return false at the deadline
  bool Await(double until_s, CameraFrame& next);
  CameraResult OnNoFrame(double timeout_s);

  const DvStreamOptions options_;
  const Clock clock_;
  BackOff back_off_;
  os::Descriptor fifo_;
  std::thread thread_;
  std::atomic<bool> stop_ = false;
  std::mutex mutex_;  ///< guards arrived_
  std::condition_variable news_;
  Arrived arrived_;
  std::uint64_t reported_damaged_ = 0, reported_skipped_ = 0;
  DvDecoder decoder_;
  DvField field_;
  std::vector<std::uint8_t> raw_, field_luma_, luma_, bgr_;
  bool has_picture_ = false;
  CameraIdentity identity_;
  std::string problem_;
};

}  // namespace plumbline::camera
