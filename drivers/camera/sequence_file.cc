#include "drivers/camera/sequence_file.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace plumbline::camera {
namespace {

std::string_view CutLine(std::string_view& rest) {
  const std::size_t end = rest.find('\n');
  std::string_view line = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
  return line;
}

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && text.front() == ' ') text.remove_prefix(1);
  while (!text.empty() && text.back() == ' ') text.remove_suffix(1);
  return text;
}

bool Parse(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

}  // namespace

Result<std::vector<SequenceFrame>> SequenceFromCsv(std::string_view csv) {
  if (CutLine(csv) != "t_s,file") return Error{"line 1: the header is not t_s,file"};
  std::vector<SequenceFrame> frames;
  for (int line = 2; !csv.empty(); ++line) {
    const std::string_view text = CutLine(csv);
    if (Trimmed(text).empty()) continue;
    const std::size_t comma = text.find(',');
    SequenceFrame frame;
    if (comma == std::string_view::npos || !Parse(Trimmed(text.substr(0, comma)), frame.t_s)) {
      return Error{fmt::format("line {}: does not start with a time and a comma", line)};
    }
    if (!frames.empty() && !(frame.t_s > frames.back().t_s)) {
      return Error{fmt::format("line {}: the time must increase from row to row", line)};
    }
    const std::string_view file = Trimmed(text.substr(comma + 1));
    if (file.find('\0') != std::string_view::npos) {
      return Error{fmt::format("line {}: the file name contains a zero byte", line)};
    }
    frame.file = file;
    frames.push_back(std::move(frame));
  }
  if (frames.empty()) return Error{"contains no frames"};
  return frames;
}

}  // namespace plumbline::camera
