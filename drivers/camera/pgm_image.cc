#include "drivers/camera/pgm_image.h"

#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <optional>

#include "drivers/files/open_failure.h"

namespace plumbline {
namespace {

constexpr int kLargestSide = 16384;
constexpr const char* kRemedy =
    "; this is no PGM of 8 bits (\"P5\"): turn the recording's images into such";

bool IsSpace(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r' || c == '\v' || c == '\f';
}

/// The next number of the header, and what follows it left in `rest`.
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
  if (bytes.substr(0, 2) != "P5") return Error{fmt::format("does not begin with P5{}", kRemedy)};
  std::string_view rest = bytes.substr(2);
  const auto width = TakeNumber(rest), height = TakeNumber(rest), largest = TakeNumber(rest);
  if (!width || !height || !largest || rest.empty() || !IsSpace(rest.front())) {
    return Error{fmt::format("a broken header{}", kRemedy)};
  }
  if (*width < 1 || *width > kLargestSide || *height < 1 || *height > kLargestSide) {
    return Error{fmt::format("{} x {} px; 1..{} each way", *width, *height, kLargestSide)};
  }
  if (*largest != 255) return Error{fmt::format("the largest value is {}{}", *largest, kRemedy)};
  rest.remove_prefix(1);
  const std::size_t pixels = static_cast<std::size_t>(*width) * static_cast<std::size_t>(*height);
  if (rest.size() < pixels) {
    return Error{fmt::format("{} bytes of pixels where {} x {} px need {}: cut short?", rest.size(),
                             *width, *height, pixels)};
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
  if (why) return Error{CannotBeRead(path, why.message())};
  if (size > std::uintmax_t{256} << 20) return Error{"larger than 256 MB"};
  std::string bytes(size, '\0');
  std::ifstream file(path, std::ios::binary);
  if (!file.read(bytes.data(), static_cast<std::streamsize>(size))) {
    return Error{CannotBeRead(path, "shorter than its folder says, or no access")};
  }
  return GreyFromPgm(bytes);
}

}  // namespace plumbline
