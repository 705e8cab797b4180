// Camera that replays a recorded image sequence, to run the tracking without hardware.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/camera/camera.h"
#include "drivers/camera/pgm_image.h"
#include "drivers/camera/sequence_file.h"
#include "drivers/clock.h"
#include "firmware-like/image/image_size.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

struct RecordedCameraOptions {
  std::string path =
      {};  ///< folder of images, played in order of their names, or a sequence file (*.csv)
  double rate_hz = 20;      ///< for a folder, whose images have no times
  bool paced = true;        ///< at the recorded rate; otherwise each Read() returns the next frame
  bool repeat = false;      ///< restart after the last frame
  std::string serial = {};  ///< of the recording camera, for the lens store; default "recorded"
  std::string mode = {};    ///< of the recording camera; default from image size and rate
  Result<GreyImage> (*read)(const std::string& path) =
      ReadPgm;  ///< ReadImage() supports more formats
};

/// Frames carry their recorded times, shifted so that the first frame is taken at the first Read();
/// a repeat starts one frame interval after the last frame. If paced, the newest frame that is due
/// is returned, and a gap in `sequence` counts the skipped ones. An image that cannot be read, or
/// differs in size from the first, is kUnusable; a row without a file is kLost.
class RecordedCamera : public Camera {
 public:
  /// Reads the list of frames, not the images. Fails if there are none or if the rate is outside
  /// 0.01..1000 Hz.
  static Result<std::unique_ptr<Camera>> Create(const RecordedCameraOptions& options, Clock clock,
                                                Sleep sleep = SleepSeconds);

  CameraResult Read(double timeout_s, CameraFrame& frame) override;
  const CameraIdentity& identity() const override { return identity_; }
  std::string_view problem() const override { return problem_; }

 private:
  RecordedCamera(RecordedCameraOptions options, std::vector<SequenceFrame> frames, Clock clock,
                 Sleep sleep);

  /// Time of frame n, where n counts through all repeats.
  double TimeOf(std::size_t n) const;
  bool HasFrame(std::size_t n) const { return options_.repeat || n < frames_.size(); }
  CameraResult Show(std::size_t n, CameraFrame& frame);

  const RecordedCameraOptions options_;
  const std::vector<SequenceFrame> frames_;  ///< with resolved paths; at least one
  const Clock clock_;
  const Sleep sleep_;
  double period_s_ = 0;  ///< duration of one repeat
  double rate_hz_ = 0;
  std::optional<double> start_s_;
  std::size_t next_ = 0;  ///< next frame to return
  GreyImage image_;
  std::optional<image::ImageSize> size_;
  CameraIdentity identity_;
  std::string problem_;
};

}  // namespace plumbline::camera
