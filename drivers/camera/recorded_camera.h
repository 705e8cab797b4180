// A recorded sequence is a camera too: the whole tracking on a laptop.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.h"
#include "drivers/camera/pgm_image.h"
#include "drivers/camera/sequence_file.h"
#include "drivers/clock.h"
#include "firmware-like/result.h"

namespace plumbline {

struct RecordedCameraOptions {
  std::string path = {};  ///< a folder of images, played by their names, or a sequence file (*.csv)
  double rate_hz = 20;    ///< of a folder, whose images have no times
  bool paced = true;      ///< at the recording's own rate; else each Read() has the next frame
  bool repeat = false;    ///< from the beginning again, after the last one
  std::string serial = {};  ///< of the camera that recorded it, for the lens store; else "recorded"
  std::string mode = {};    ///< likewise; else made of the images' size and the rate
  Result<GreyImage> (*read)(const std::string& path) = ReadPgm;  ///< ReadImage() takes every kind
};

/// Frames carry their recorded times, moved so that the first one is taken when Read() is called
/// first; repeats follow after the last interval. Paced, the newest frame that is due is shown, and
/// `sequence` tells those that nobody asked for. An image that cannot be read, or has another size
/// than the first one, is kUnusable; where the sequence file names none, the camera is kLost.
class RecordedCamera : public Camera {
 public:
  /// Reads the list of frames, not the images. Refuses what holds none, and a rate outside
  /// 0.01..1000 Hz.
  static Result<std::unique_ptr<Camera>> Create(const RecordedCameraOptions& options, Clock clock,
                                                Sleep sleep = SleepSeconds);

  CameraResult Read(double timeout_s, CameraFrame& frame) override;
  const CameraIdentity& identity() const override { return identity_; }
  std::string_view problem() const override { return problem_; }

 private:
  RecordedCamera(RecordedCameraOptions options, std::vector<SequenceFrame> frames, Clock clock,
                 Sleep sleep);

  /// When frame n is taken, n counted through all repeats.
  double TimeOf(std::size_t n) const;
  bool IsThere(std::size_t n) const { return options_.repeat || n < frames_.size(); }
  CameraResult Show(std::size_t n, CameraFrame& frame);

  const RecordedCameraOptions options_;
  const std::vector<SequenceFrame> frames_;  ///< with paths that can be opened; at least one
  const Clock clock_;
  const Sleep sleep_;
  double period_s_ = 0;  ///< from one repeat to the next
  double rate_hz_ = 0;
  std::optional<double> start_s_;
  std::size_t next_ = 0;  ///< the first frame that was not shown
  GreyImage image_;
  std::optional<ImageSize> size_;
  CameraIdentity identity_;
  std::string problem_;
};

}  // namespace plumbline
