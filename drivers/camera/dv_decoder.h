// Decoder of DV frames: a sandboxed process, restarted when a frame ends it.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "drivers/back_off.h"
#include "drivers/camera/dv_field.h"
#include "drivers/clock.h"
#include "drivers/os/child_process.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/result.h"

namespace plumbline::camera {

/// Path of plumbline-dv, in the folder of the running program.
std::string DvProgram();

/// Decodes frames one by one through plumbline-dv, which is started with the first frame. A frame
/// that ends the process, or is not decoded within 0.5 s (3 s with the start), costs this picture:
/// the process is started again with the next frame. One that ends before it has decoded 25
/// frames is restarted with back-off. Used by one thread; the kernel kills the process when that
/// thread ends.
class DvDecoder {
 public:
  /// @param clock  for the back-off
  explicit DvDecoder(Clock clock, std::string program = DvProgram());

  /// @param frame  untrusted
  /// @return       the field, valid until the next call, or why there is none
  Result<DvField> Decode(std::span<const std::uint8_t> frame);

  /// "dvsd 787x576@25".
  static std::string ModeTextOf(const DifFormat& format);

  /// Frames that ended the process.
  std::uint64_t lost() const { return lost_; }
  /// Since the last call: that frames ended the process, at the 1st, 2nd, 4th, 8th, ...
  std::vector<std::string> TakeRemarks();
  pid_t pid() const { return child_.pid(); }  ///< of the process; -1: none

 private:
  Result<void> Start();
  bool Send(std::span<const std::uint8_t> bytes, double until_s);
  bool Receive(std::span<std::uint8_t> bytes, double until_s);
  /// @return  false if the process did not answer; `picture_` is then undefined. After an answer it
  ///          is empty if the frame is damaged
  bool Exchange(std::span<const std::uint8_t> frame, const DifFormat& format);
  Error OnProcessLost();

  const Clock clock_;
  const std::string program_;
  os::Descriptor socket_;
  os::ChildProcess child_;
  BackOff back_off_;
  std::uint64_t decoded_ = 0;  ///< by this process
  std::uint64_t lost_ = 0;
  std::vector<std::uint8_t> picture_;
  std::string why_ended_;
  std::vector<std::string> remarks_;
};

}  // namespace plumbline::camera
