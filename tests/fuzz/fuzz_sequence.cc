// Fuzzer: arbitrary bytes as a recording: frames with ascending times, or a complete PGM.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "drivers/camera/pgm_image.h"
#include "drivers/camera/sequence_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto image = plumbline::camera::GreyFromPgm(text);
  if (!image && image.error().empty()) std::abort();
  if (image && image->grey.size() != static_cast<std::size_t>(image->width) *
                                         static_cast<std::size_t>(image->height)) {
    std::abort();
  }
  const auto frames = plumbline::camera::SequenceFromCsv(text);
  if (!frames) {
    if (frames.error().empty()) std::abort();
    return 0;
  }
  if (frames->empty()) std::abort();
  double last_s = -HUGE_VAL;
  for (const plumbline::camera::SequenceFrame& frame : *frames) {
    if (!(frame.t_s > last_s && std::isfinite(frame.t_s))) std::abort();
    if (frame.file.find_first_of(std::string_view("\0\n", 2)) != std::string::npos) std::abort();
    last_s = frame.t_s;
  }
  return 0;
}
