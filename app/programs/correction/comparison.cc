#include "app/programs/correction/comparison.h"

#include <fmt/format.h>

#include <algorithm>

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
  Skeleton skeleton;
  std::size_t next = 0, line_start = 0;
  int line = 1;
  for (std::size_t at = 0; at < bytes.size();) {
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
    const bool end = bytes[at] == '\n';
    ++at;
    if (!end && at < bytes.size()) continue;
    if (MarkFrom(std::string_view(bytes).substr(line_start, at - line_start))) {
      while (!skeleton.lines.empty() && skeleton.lines.back() == line) {
        skeleton.bytes.pop_back();
        skeleton.lines.pop_back();
      }
    }
    line_start = at;
    ++line;
  }
  return skeleton;
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
    return comparison;
  }
  for (std::size_t k = 0; k < new_program.points.size(); ++k) {
    const Point &before = old_program.points[k], &after = new_program.points[k];
    ++comparison.compared;
    PointDifference difference{after.name, after.place};
    bool differs = false;
    for (std::size_t n = 0; n < std::min(before.numbers.size(), after.numbers.size()); ++n) {
      differs = differs || (before.numbers[n] && after.numbers[n] &&
                            before.numbers[n]->value != after.numbers[n]->value);
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
