#include "app/programs/correction/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "app/programs/correction/point_text.h"
#include "app/programs/correction/rewriting.h"
#include "firmware-like/geometry/rotation.h"

namespace plumbline::programs {
namespace {

/// The bytes of a file without marks, and with one byte for each number and configuration.
struct Skeleton {
  std::string bytes;
  std::vector<int> lines;  ///< the line of each byte
};

/// The lines of a file that hold nothing but a mark, with their ends.
std::vector<Span> MarkLinesOf(std::size_t file, std::string_view bytes) {
  constexpr std::string_view kByteOrder = "\xEF\xBB\xBF", kWord = "plumbline ";
  std::vector<Span> lines;
  for (auto at = bytes.find(kWord); at != std::string_view::npos;) {
    const auto before = bytes.substr(0, at).find_last_of("\r\n");
    std::size_t begin = before == std::string_view::npos ? 0 : before + 1;
    if (begin == 0 && bytes.starts_with(kByteOrder)) begin = kByteOrder.size();
    const std::size_t text_end = std::min(bytes.find_first_of("\r\n", at), bytes.size());
    const std::size_t line_end = text_end + (bytes.substr(text_end, 2) == "\r\n" ? 2 : 1);
    if (MarkFrom(bytes.substr(at, text_end - at))) {
      lines.push_back({file, begin, std::min(line_end, bytes.size())});
    }
    at = bytes.find(kWord, text_end);
  }
  return lines;
}

Skeleton SkeletonOf(const Program& program, std::size_t file) {
  const std::string& bytes = program.files[file].bytes;
  std::vector<Span> spans;
  for (const Point& point : program.points) {
    for (const auto& number : point.numbers) {
      if (number && number->span.file == file) spans.push_back(number->span);
    }
    for (const auto& field : point.configuration.fields) {
      if (field.span.file == file) spans.push_back(field.span);
    }
  }
  std::sort(spans.begin(), spans.end(),
            [](const Span& a, const Span& b) { return a.begin < b.begin; });
  const std::vector<Span> marks = MarkLinesOf(file, bytes);
  Skeleton skeleton;
  std::size_t next = 0, next_mark = 0;
  int line = 1;
  for (std::size_t at = 0; at < bytes.size();) {
    if (next_mark < marks.size() && marks[next_mark].begin == at) {
      at = marks[next_mark++].end;
      ++line;
      continue;
    }
    while (next < spans.size() && spans[next].begin < at) ++next;
    if (next < spans.size() && spans[next].begin == at && spans[next].end > at) {
      while (!skeleton.bytes.empty() && skeleton.bytes.back() == ' ') {
        skeleton.bytes.pop_back();
        skeleton.lines.pop_back();
      }
      skeleton.bytes += '\0';
      skeleton.lines.push_back(line);
      at = std::min(spans[next].end, bytes.size());
      continue;
    }
    skeleton.bytes += bytes[at];
    skeleton.lines.push_back(line);
    const bool lone_return = bytes[at] == '\r' && (at + 1 == bytes.size() || bytes[at + 1] != '\n');
    line += bytes[at] == '\n' || lone_return ? 1 : 0;
    ++at;
  }
  return skeleton;
}

/// How far two points are apart, for matching them only: poses in m.
double Apart(const Conventions& conventions, const Point& one, const Point& other) {
  if (one.kind != other.kind || one.name != other.name) {
    return std::numeric_limits<double>::infinity();
  }
  double squares = 0;
  for (std::size_t n = 0; n < std::min(one.numbers.size(), other.numbers.size()); ++n) {
    if (!one.numbers[n] || !other.numbers[n]) continue;
    const double unit = one.kind == PointKind::kJoints ? conventions.rad_per_unit
                        : n < 3                        ? conventions.m_per_unit
                                                       : 0;
    squares += std::pow(unit * (one.numbers[n]->value - other.numbers[n]->value), 2);
  }
  return std::sqrt(squares);
}

/// For each old point the new one, in increasing order; fewer where none is left.
std::vector<std::size_t> MatchedPoints(const Conventions& conventions,
                                       const std::vector<Point>& before,
                                       const std::vector<Point>& after) {
  constexpr std::size_t kMostBetween = 64;  // parts of one motion
  std::vector<std::size_t> matches;
  std::size_t next = 0;
  for (std::size_t k = 0; k < before.size() && next + (before.size() - k) <= after.size(); ++k) {
    const std::size_t spare = after.size() - next - (before.size() - k);
    std::size_t best = next;
    for (std::size_t m = next; m <= next + std::min(spare, kMostBetween); ++m) {
      if (Apart(conventions, before[k], after[m]) < Apart(conventions, before[k], after[best])) {
        best = m;
      }
    }
    matches.push_back(best);
    next = best + 1;
  }
  return matches;
}

}  // namespace

ProgramComparison Compare(const Brand& brand, const Program& old_program,
                          const Program& new_program) {
  ProgramComparison comparison;
  const std::size_t files = std::max(old_program.files.size(), new_program.files.size());
  for (std::size_t f = 0; f < files; ++f) {
    if (f >= old_program.files.size() || f >= new_program.files.size()) {
      const Program& has = f < new_program.files.size() ? new_program : old_program;
      comparison.others.push_back({has.files[f].name, 0, "only one version has this file"});
      continue;
    }
    const Skeleton before = SkeletonOf(old_program, f), after = SkeletonOf(new_program, f);
    if (before.bytes == after.bytes) continue;
    const auto [a, b] = std::mismatch(before.bytes.begin(), before.bytes.end(), after.bytes.begin(),
                                      after.bytes.end());
    const auto index = static_cast<std::size_t>(b - after.bytes.begin());
    const int line = index < after.lines.size() ? after.lines[index]
                     : after.lines.empty()      ? 1
                                                : after.lines.back();
    comparison.others.push_back(
        {new_program.files[f].name, line, "bytes beside the numbers of points differ"});
  }
  if (old_program.points.size() != new_program.points.size()) {
    comparison.others.push_back(
        {new_program.files.empty() ? std::string() : new_program.files.front().name, 0,
         fmt::format("{} points, {} before", new_program.points.size(),
                     old_program.points.size())});
  }
  const std::vector<std::size_t> matches =
      MatchedPoints(brand.conventions(), old_program.points, new_program.points);
  comparison.inserted =
      new_program.points.size() - std::min(old_program.points.size(), new_program.points.size());
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const Point &before = old_program.points[k], &after = new_program.points[matches[k]];
    ++comparison.compared;
    PointDifference difference{after.name, after.place, after.kind};
    bool differs = false;
    for (std::size_t n = 0; n < std::min(before.numbers.size(), after.numbers.size()); ++n) {
      if (!before.numbers[n] || !after.numbers[n]) continue;
      const double change = std::abs(after.numbers[n]->value - before.numbers[n]->value);
      differs = differs || change != 0;
      if (after.kind == PointKind::kJoints) difference.joint = std::max(difference.joint, change);
    }
    const auto& fields = before.configuration.fields;
    for (std::size_t n = 0; n < std::min(fields.size(), after.configuration.fields.size()); ++n) {
      differs = differs || fields[n].text != after.configuration.fields[n].text;
    }
    if (!differs) continue;
    const Result<Pose> one = PoseOf(before, brand.conventions()),
                       other = PoseOf(after, brand.conventions());
    if (after.kind == PointKind::kPose && one && other) {
      difference.distance_m = (other->p - one->p).norm();
      difference.angle_rad = VectorFromRotation(other->R * one->R.transpose()).norm();
    }
    comparison.points.push_back(difference);
  }
  return comparison;
}

}  // namespace plumbline::programs
