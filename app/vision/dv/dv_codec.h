// DV decoder of libavcodec, loaded at run time.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/camera/dif_frame.h"

struct AVCodecContext;
struct AVFrame;
struct AVPacket;

namespace plumbline::vision {

struct LibavcodecFunctions;

/// Decodes frames without threads, files or output. Used by one thread, once in a process: messages
/// of libavcodec are redirected.
class DvCodec {
 public:
  /// @return  nullptr if libavcodec, in the version that this program was compiled for, cannot be
  ///          loaded or has no DV decoder
  static std::unique_ptr<DvCodec> Load();
  ~DvCodec();
  DvCodec(const DvCodec&) = delete;
  DvCodec& operator=(const DvCodec&) = delete;

  /// Decodes the field of the lower lines as Y U Y V.
  /// @param frame   that CheckDifFrame() accepts
  /// @param format  its result
  /// @return        false if libavcodec reports any error: it would conceal it and continue
  bool DecodeLowerField(std::span<const std::uint8_t> frame, const camera::DifFormat& format,
                        std::vector<std::uint8_t>& yuyv);

 private:
  DvCodec() = default;

  std::unique_ptr<LibavcodecFunctions> functions_;
  AVCodecContext* context_ = nullptr;
  AVFrame* picture_ = nullptr;
  AVPacket* packet_ = nullptr;
};

}  // namespace plumbline::vision
