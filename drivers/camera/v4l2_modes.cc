#include "drivers/camera/v4l2_modes.h"

#include <fmt/format.h>
#include <linux/videodev2.h>

#include <algorithm>
#include <tuple>

#include "drivers/ioctl.h"

namespace plumbline::camera {
namespace {

constexpr std::uint32_t kMaxEntries = 200;  // bounds a driver whose list never ends
constexpr double kRateSlack = 0.98;         // 29.97 counts as 30

double RateOf(const v4l2_fract& interval) {
  return interval.numerator > 0 ? static_cast<double>(interval.denominator) / interval.numerator
                                : 0;
}

image::ImageSize SizeOf(std::uint32_t width, std::uint32_t height) {
  constexpr std::uint32_t kMost = 1U << 20;
  return {static_cast<int>(std::min(width, kMost)), static_cast<int>(std::min(height, kMost))};
}

std::vector<double> RatesOf(int fd, std::uint32_t fourcc, image::ImageSize size) {
  std::vector<double> rates_hz;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmivalenum interval{};
    interval.index = i;
    interval.pixel_format = fourcc;
    interval.width = static_cast<std::uint32_t>(size.width);
    interval.height = static_cast<std::uint32_t>(size.height);
    if (IoctlAgain(fd, VIDIOC_ENUM_FRAMEINTERVALS, &interval) != 0) break;
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      rates_hz.push_back(RateOf(interval.discrete));
      continue;
    }
    rates_hz = {RateOf(interval.stepwise.min), RateOf(interval.stepwise.max)};
    break;
  }
  std::sort(rates_hz.rbegin(), rates_hz.rend());
  return rates_hz;
}

void AddSizes(int fd, std::uint32_t fourcc, std::vector<V4l2Mode>& modes) {
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_frmsizeenum size{};
    size.index = i;
    size.pixel_format = fourcc;
    if (IoctlAgain(fd, VIDIOC_ENUM_FRAMESIZES, &size) != 0) return;
    V4l2Mode mode;
    mode.fourcc = fourcc;
    if (size.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      mode.smallest = mode.largest = SizeOf(size.discrete.width, size.discrete.height);
    } else {
      mode.smallest = SizeOf(size.stepwise.min_width, size.stepwise.min_height);
      mode.largest = SizeOf(size.stepwise.max_width, size.stepwise.max_height);
      mode.step =
          SizeOf(std::max(size.stepwise.step_width, 1U), std::max(size.stepwise.step_height, 1U));
    }
    mode.rates_hz = RatesOf(fd, fourcc, mode.largest);
    modes.push_back(std::move(mode));
    if (size.type != V4L2_FRMSIZE_TYPE_DISCRETE) return;
  }
}

bool IsWithin(int value, int smallest, int largest, int step) {
  return value >= smallest && value <= largest && (value - smallest) % step == 0;
}

/// Slowest rate that is fast enough, otherwise the fastest.
double RateToRequest(const std::vector<double>& rates_hz, double wanted_hz) {
  if (rates_hz.empty()) return 0;
  double best_hz = rates_hz.front();
  for (const double rate_hz : rates_hz) {
    if (rate_hz >= kRateSlack * wanted_hz) best_hz = rate_hz;
  }
  return best_hz;
}

std::string Offer(const std::vector<V4l2Mode>& modes) {
  std::string text;
  int listed = 0;
  for (const V4l2Mode& mode : modes) {
    if (listed++ == 12) return text + ", ...";
    if (!text.empty()) text += ", ";
    text += FourccText(mode.fourcc);
    if (mode.largest.width > 0)
      text += fmt::format(" {}x{}", mode.largest.width, mode.largest.height);
  }
  return text.empty() ? "nothing" : text;
}

/// Remedy for a camera without a supported format, from the first format that is recognised.
std::string Remedy(const std::vector<V4l2Mode>& modes) {
  struct Unsupported {
    std::string_view why;
    std::vector<std::uint32_t> fourccs;
  };
  static const std::vector<Unsupported> kinds = {
      {"compressed video is not supported. Set the camera to Motion JPEG or raw images.",
       {V4L2_PIX_FMT_H264, V4L2_PIX_FMT_H264_NO_SC, V4L2_PIX_FMT_HEVC, V4L2_PIX_FMT_MPEG,
        V4L2_PIX_FMT_MPEG4, V4L2_PIX_FMT_VP8, V4L2_PIX_FMT_VP9}},
      {"raw Bayer images are not supported. Set the camera to monochrome (GREY) or YUYV.",
       {V4L2_PIX_FMT_SBGGR8, V4L2_PIX_FMT_SGBRG8, V4L2_PIX_FMT_SGRBG8, V4L2_PIX_FMT_SRGGB8,
        V4L2_PIX_FMT_SBGGR10, V4L2_PIX_FMT_SGBRG10, V4L2_PIX_FMT_SGRBG10, V4L2_PIX_FMT_SRGGB10}},
      {"more than 8 bits per pixel are not supported. Set the camera to 8 bits (GREY).",
       {V4L2_PIX_FMT_Y10, V4L2_PIX_FMT_Y12, V4L2_PIX_FMT_Y16}},
  };
  for (const Unsupported& kind : kinds) {
    for (const V4l2Mode& mode : modes) {
      if (std::find(kind.fourccs.begin(), kind.fourccs.end(), mode.fourcc) != kind.fourccs.end()) {
        return fmt::format("; {}", kind.why);
      }
    }
  }
  return "";
}

/// DV, if it is the only supported format of the device and the request does not exclude it.
std::optional<ModeChoice> DvChoice(const std::vector<V4l2Mode>& modes, const ModeRequest& request) {
  const std::vector<PixelFormat>& wanted = request.formats;
  if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), PixelFormat::kDv) == wanted.end())
    return std::nullopt;
  std::optional<ModeChoice> choice;
  for (const V4l2Mode& mode : modes) {
    const auto format = PixelFormatOfFourcc(mode.fourcc);
    if (format == PixelFormat::kDv) choice = ModeChoice{*format, mode.largest, 0};
    if (wanted.empty() && format && format != PixelFormat::kDv) return std::nullopt;
  }
  return choice;
}

/// True if the format is supported.
bool IsSupported(const V4l2Mode& mode) {
  return PixelFormatOfFourcc(mode.fourcc).has_value();
}

}  // namespace

std::vector<V4l2Mode> ModesOf(int fd) {
  std::vector<V4l2Mode> modes;
  for (std::uint32_t i = 0; i < kMaxEntries; ++i) {
    v4l2_fmtdesc format{};
    format.index = i;
    format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
    if (IoctlAgain(fd, VIDIOC_ENUM_FMT, &format) != 0) break;
    // The sizes and rates that Linux reports for DV are placeholders (uvcvideo: 0 x 0 at 10 MHz).
    if (format.pixelformat == V4L2_PIX_FMT_DV) {
      modes.push_back({.fourcc = format.pixelformat});
    } else {
      AddSizes(fd, format.pixelformat, modes);
    }
  }
  return modes;
}

Result<ModeChoice> ChooseMode(const std::vector<V4l2Mode>& modes, const ModeRequest& request) {
  std::vector<PixelFormat> wanted = request.formats;
  if (wanted.empty()) {
    wanted = {PixelFormat::kGrey, PixelFormat::kNv12, PixelFormat::kYuyv, PixelFormat::kUyvy,
              PixelFormat::kMjpeg};
  }
  const bool any_size = request.size == image::ImageSize{};
  ModeChoice best;
  std::tuple<bool, double, std::int64_t, std::ptrdiff_t> best_merit;
  bool found = false;
  for (const V4l2Mode& mode : modes) {
    const auto format = PixelFormatOfFourcc(mode.fourcc);
    if (format == PixelFormat::kDv) continue;
    const auto place = format ? std::find(wanted.begin(), wanted.end(), *format) : wanted.end();
    if (place == wanted.end()) continue;
    const image::ImageSize size = any_size ? mode.largest : request.size;
    if (!IsWithin(size.width, mode.smallest.width, mode.largest.width, mode.step.width) ||
        !IsWithin(size.height, mode.smallest.height, mode.largest.height, mode.step.height)) {
      continue;
    }
    const double fastest_hz = mode.rates_hz.empty() ? 0 : mode.rates_hz.front();
    const bool fast = mode.rates_hz.empty() || fastest_hz >= kRateSlack * request.rate_hz;
    const std::tuple merit(fast, fast ? 0 : fastest_hz,
                           std::int64_t{size.width} * std::int64_t{size.height},
                           wanted.begin() - place);
    if (found && !(merit > best_merit)) continue;
    found = true;
    best_merit = merit;
    best = {*format, size, RateToRequest(mode.rates_hz, request.rate_hz)};
  }
  if (found) return best;
  if (const auto dv = DvChoice(modes, request)) return *dv;
  const std::string remedy =
      std::any_of(modes.begin(), modes.end(), IsSupported)
          ? ""
          : " (supported are GREY, NV12, YUYV, UYVY, MJPG, dvsd)" + Remedy(modes);
  if (any_size) {
    return Error{fmt::format("no supported format; the camera offers {}{}", Offer(modes), remedy)};
  }
  return Error{fmt::format("no {} x {} px in a supported format; the camera offers {}{}",
                           request.size.width, request.size.height, Offer(modes), remedy)};
}

std::string ModeText(PixelFormat format, image::ImageSize size, double rate_hz) {
  std::string text = fmt::format("{} {}x{}", PixelFormatName(format), size.width, size.height);
  if (rate_hz > 0) text += fmt::format("@{:.4g}", rate_hz);
  return text;
}

}  // namespace plumbline::camera
