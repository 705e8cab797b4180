#include "drivers/camera/pgm_image.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <optional>

#include "drivers/files/open_failure.h"

namespace plumbline::camera {
namespace {

constexpr int kMaxSide_px = 16384;
constexpr const char* kRemedy =
    "; this is not an 8-bit binary PGM (\"P5\"). Convert the images of the recording to that "
    "format.";

bool IsSpace(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f';
}

/// Takes the next number of the header from `rest`.
std::optional<int> TakeNumber(std::string_view& rest) {
  while (!rest.empty() && (IsSpace(rest.front()) || rest.front() == '#')) {
    const bool comment = rest.front() == '#';
    rest.remove_prefix(comment ? std::min(rest.find('\n'), rest.size()) : 1);
  }
  int number = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), number);
  if (error != std::errc()) return std::nullopt;
  rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
  return number;
}

}  // namespace

Result<GreyImage> GreyFromPgm(std::string_view bytes) {
  if (bytes.substr(0, 2) != "P5") return Error{fmt::format("does not start with P5{}", kRemedy)};
  std::string_view rest = bytes.substr(2);
  const auto width = TakeNumber(rest), height = TakeNumber(rest), largest = TakeNumber(rest);
  if (!width || !height || !largest || rest.empty() || !IsSpace(rest.front())) {
    return Error{fmt::format("invalid header{}", kRemedy)};
  }
  if (*width < 1 || *width > kMaxSide_px || *height < 1 || *height > kMaxSide_px) {
    return Error{fmt::format("{} x {} px; each side must be 1..{}", *width, *height, kMaxSide_px)};
  }
  if (*largest != 255)
    return Error{fmt::format("maximum value {} instead of 255{}", *largest, kRemedy)};
  rest.remove_prefix(1);
  const std::size_t pixels = static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height);
  if (rest.size() < pixels) {
    return Error{
        fmt::format("{} bytes of pixels, but {} x {} px need {}. The file may be truncated.",
                    rest.size(), *width, *height, pixels)};
  }
  GreyImage image;
  image.width = *width;
  image.height = *height;
  image.grey.assign(rest.begin(), rest.begin() + static_cast<std::ptrdiff_t>(pixels));
  return image;
}

Result<GreyImage> ReadPgm(const std::string& path) {
  std::error_code why;
  const std::uintmax_t size = std::filesystem::file_size(path, why);
  if (why) return Error{files::ReadErrorText(path, why.message())};
  if (size > std::uintmax_t{256} << 20) return Error{"larger than 256 MB"};
  std::string bytes(size, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size))) {
    return Error{files::ReadErrorText(path, "shorter than its reported size, or no access")};
  }
  return GreyFromPgm(bytes);
}

}  // namespace plumbline::camera
