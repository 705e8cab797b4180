#include "drivers/zoom/replay_zoom.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "drivers/zoom/registry.h"

namespace plumbline::zoom {
namespace {

constexpr std::array<std::string_view, 7> kColumns = {
    "t_s", "zoom_counts", "focus_counts", "moving", "digital_zoom", "moved", "lost"};

constexpr ZoomOption kReplayOptions[] = {
    {.key = "file",
     .value = FileOption{},
     .description = "for \"replay\": recorded table t_s,zoom_counts,...",
     .example = "\"zoom.csv\""},
};

std::string_view CutAt(std::string_view& rest, char separator) {
  const std::size_t end = rest.find(separator);
  const std::string_view piece = rest.substr(0, end);
  rest = end == std::string_view::npos ? std::string_view() : rest.substr(end + 1);
  return piece;
}

std::vector<std::string_view> FieldsOf(std::string_view line) {
  std::vector<std::string_view> fields;
  for (bool more = true; more;) {
    more = line.find(',') != std::string_view::npos;
    std::string_view field = CutAt(line, ',');
    while (!field.empty() && (field.front() == ' ')) field.remove_prefix(1);
    while (!field.empty() && (field.back() == ' ' || field.back() == '\r')) field.remove_suffix(1);
    fields.push_back(field);
  }
  return fields;
}

template <typename T>
bool Parse(std::string_view text, T& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

bool PutField(std::size_t column, std::string_view text, ZoomRow& row) {
  std::int32_t number = 0;
  if (column == 0) return Parse(text, row.t_s) && std::isfinite(row.t_s);
  if (text.empty()) return true;
  if (!Parse(text, number)) return false;
  if (column == 1) row.reading.zoom_counts = number;
  if (column == 2) row.reading.focus_counts = number;
  if (column <= 2) return true;
  if (number != 0 && number != 1) return false;
  if (column == 3)
    row.reading.motion = number == 1 ? lens::LensMotion::kMoving : lens::LensMotion::kSettled;
  if (column == 4) row.reading.digital_zoom = number == 1;
  if (column == 5) row.reading.moved = number == 1;
  if (column == 6) row.lost = number == 1;
  return true;
}

}  // namespace

Result<std::vector<ZoomRow>> ZoomRowsFromCsv(std::string_view csv) {
  std::vector<std::size_t> meaning;  // index into kColumns for each column of the file
  for (const std::string_view name : FieldsOf(CutAt(csv, '\n'))) {
    std::size_t column = 0;
    while (column < kColumns.size() && kColumns[column] != name) ++column;
    if (column == kColumns.size()) return Error{fmt::format("line 1: unknown column {}", name)};
    for (const std::size_t other : meaning) {
      if (other == column) return Error{fmt::format("line 1: column {} occurs twice", name)};
    }
    meaning.push_back(column);
  }
  for (const std::size_t needed : {0U, 1U}) {
    if (std::find(meaning.begin(), meaning.end(), needed) == meaning.end()) {
      return Error{fmt::format("line 1: column {} is missing", kColumns[needed])};
    }
  }
  std::vector<ZoomRow> rows;
  for (int line = 2; !csv.empty(); ++line) {
    const std::string_view text = CutAt(csv, '\n');
    if (text.empty() || text == "\r") continue;
    const std::vector<std::string_view> fields = FieldsOf(text);
    if (fields.size() != meaning.size()) {
      return Error{fmt::format("line {}: {} fields, but the header has {}", line, fields.size(),
                               meaning.size())};
    }
    ZoomRow row;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      if (!PutField(meaning[i], fields[i], row)) {
        return Error{
            fmt::format("line {}: {} is not a valid {}", line, fields[i], kColumns[meaning[i]])};
      }
    }
    rows.push_back(row);
  }
  return rows;
}

Result<std::unique_ptr<ZoomSensor>> ReplayZoom::Create(std::vector<ZoomRow> rows, Clock clock) {
  if (rows.empty()) return Error{"zoom replay: no rows"};
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (!(rows[i].t_s > rows[i - 1].t_s)) {
      return Error{fmt::format("zoom replay: the time of row {} does not increase", i + 1)};
    }
  }
  return std::unique_ptr<ZoomSensor>(new ReplayZoom(std::move(rows), clock));
}

ZoomResult ReplayZoom::Read(lens::ZoomReading& reading) {
  const double now_s = clock_();
  if (!start_s_) start_s_ = now_s;
  const double due_s = rows_.front().t_s + std::max(0.0, now_s - *start_s_);
  bool moved = false;
  while (shown_ < rows_.size() && (shown_ == 0 || rows_[shown_].t_s <= due_s)) {
    moved = moved || rows_[shown_].reading.moved;
    ++shown_;
  }
  const ZoomRow& row = rows_[shown_ - 1];
  if (row.lost) {
    problem_ = "zoom replay: no answer recorded at this time";
    return ZoomResult::kTimeout;
  }
  reading = row.reading;
  reading.moved = moved;
  reading.time_s = now_s;
  return ZoomResult::kOk;
}

const ZoomKind kReplayZoomKind{
    .name = "replay",
    .make = [](const ZoomConnection& to) { return ReplayZoom::Create(to.replay, to.clock); },
    .identity = [](const ZoomConnection&) { return std::string(); },
    .device = [](const ZoomConnection&) { return Result<std::string>(""); },
    .period_s = kQuickZoomPeriod_s,
    .options = kReplayOptions};

}  // namespace plumbline::zoom
