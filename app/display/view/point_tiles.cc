#include "app/display/view/point_tiles.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/display/view/palette.h"
#include "app/display/view/state_strip.h"
#include "app/display/view/status_text.h"
#include "firmware-like/correction/code_remedy.h"
#include "firmware-like/geometry/units.h"
#include "firmware-like/model/radius_coverage.h"

namespace plumbline::display {
namespace {

constexpr float kMostStretch = 1.2F;  ///< of a tile, to fill a page
constexpr float kPagerWidth_em = 6.5F;

std::string DriftNote(const status::MonitoringStatus& monitoring) {
  if (monitoring.reference_refused) return "drift: no reference";
  if (monitoring.radius_contradicted) return "probes contradict the radius";
  if (monitoring.drift_alarm) {
    return "DRIFT: " + DriftRatioText(monitoring.drift_statistic);
  }
  if (!monitoring.recording) return "drift not monitored";
  if (monitoring.learning) return LearningText(monitoring);
  if (monitoring.probes == 0 && monitoring.drift_statistic == 0) return "drift: no probes yet";
  return "drift " + DriftRatioText(monitoring.drift_statistic);
}

std::string NoteOf(const cell::ViewPoint& point, const cell::ViewState& state) {
  if (point.differs) return "not the taught posture";
  if (point.extrapolated) return "outside calibrated range";
  if ((state.warnings & warning::kModelSetAside) != 0) return "model not in force";
  return DriftNote(state.monitoring);
}

PointTile TileOf(const cell::ViewPoint& point, const ViewFacts& facts) {
  const cell::ViewState& state = *facts.state;
  PointTile tile;
  tile.id = point.id;
  tile.name = PointName(facts, point.id);
  tile.state = ClassOf(ToneOf(point, state));
  if (!point.valid) {
    tile.value = "not valid";
    tile.radius = InvalidReason(point, state);
    if (!WithoutDaemon(state)) tile.note = correction::RemedyOf(point.code);
    return tile;
  }
  tile.value = fmt::format("{:.2f} mm", kMmPerMetre * point.translation_B.norm());
  tile.radius = fmt::format("±{:.2f} mm ({})", kMmPerMetre * point.uncertainty_m,
                            model::CoverageText(point.basis));
  tile.note = NoteOf(point, state);
  return tile;
}

scene::Colour AccentOf(StateClass state) {
  switch (state) {
    case StateClass::kAdvisory:
      return palette::kAdvisory;
    case StateClass::kWarning:
      return palette::kWarning;
    case StateClass::kAlarm:
    case StateClass::kUnknown:
      return palette::kAlarm;
    case StateClass::kHealthy:
      break;
  }
  return palette::kFaded;
}

void AddTile(const PointTile& tile, const scene::Area& area, PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  writer.Box(area, palette::kPanel);
  const scene::Colour accent = AccentOf(tile.state);
  if (tile.state != StateClass::kHealthy)
    writer.Box({area.x, area.y, std::max(3.0F, 0.25F * layout.em), area.height}, accent);
  const float margin = 0.6F * layout.em, x = area.x + margin, width = area.width - 1.6F * margin;
  // A low tile has its note beside the radius; one without room for it shows a warning at the top.
  const bool warned = tile.state == StateClass::kWarning;
  const bool low = area.height < static_cast<float>(TileSize(layout).height) - 0.5F;
  const float radius_em = writer.FittingEm(tile.radius, std::round(1.15F * layout.em), width);
  const bool beside = low && writer.WidthOf(tile.radius, radius_em) + 2 * layout.em +
                                     writer.WidthOf(tile.note, layout.em) <=
                                 width;
  const bool at_top = low && warned && !beside;
  const std::string word = !tile.valid() ? "" : at_top ? tile.note : "corrected";
  const float word_width =
      std::min(writer.WidthOf(word, layout.em) + 0.4F * layout.em, 0.6F * width);
  float y = area.y + 0.3F * layout.em;
  const std::string glyph = MarkOf(tile.state).glyph;
  const float glyph_width = writer.WidthOf(glyph + " ", layout.name_em);
  writer.Text(x, y, glyph_width, layout.name_em, glyph, accent);
  writer.Text(x + glyph_width, y, width - glyph_width - word_width, layout.name_em, tile.name,
              palette::kText);
  writer.TextAtRight(x + width, y + 0.9F * (layout.name_em - layout.em), word_width, layout.em,
                     word, at_top ? accent : palette::kFaded);
  y += 1.25F * layout.name_em;
  writer.Text(x, y, width, writer.FittingEm(tile.value, layout.value_em, width), tile.value,
              tile.valid() ? palette::kText : accent);
  y += 1.2F * layout.value_em;
  if (!tile.valid()) {
    for (std::string rest : {tile.radius, tile.note}) {
      for (const std::string& row : writer.Rows(rest, layout.em, width)) {
        if (y + layout.line() > area.bottom()) break;
        const bool last = y + 2 * layout.line() > area.bottom();
        writer.Text(x, y, width, layout.em, last ? rest : row, palette::kText);
        rest.erase(0, std::min(rest.size(), row.size() + 1));
        y += layout.line();
      }
    }
    return;
  }
  writer.Text(x, y, width, radius_em, tile.radius, palette::kText);
  if (beside)
    writer.TextAtRight(x + width, y + radius_em - layout.em, width, layout.em, tile.note,
                       warned ? accent : palette::kFaded);
  if (low) return;
  y += 1.3F * radius_em;
  writer.Line(x, y, width, {tile.note, warned ? Tone::kAttention : Tone::kFaded});
}

}  // namespace

std::string DriftRatioText(double statistic) {
  return statistic < 1 ? fmt::format("{:.2f} of threshold", statistic)
                       : fmt::format("{:.1f} × threshold", statistic);
}

std::string PointName(const ViewFacts& facts, int id) {
  if (facts.model != nullptr) {
    for (const correction::AssemblyPoint& point : facts.model->config.machine.points) {
      if (point.id == id && !point.name.empty()) return point.name;
    }
  }
  return fmt::format("point {}", id);
}

std::vector<PointTile> TilesOf(const ViewFacts& facts) {
  std::vector<PointTile> tiles;
  tiles.reserve(facts.state->points.size());
  for (const cell::ViewPoint& point : facts.state->points) {
    tiles.push_back(TileOf(point, facts));
  }
  return tiles;
}

namespace {

/// Division of the tiles' area into a grid.
struct TileGrid {
  std::size_t columns = 1, rows = 1;
  float gap = 0, width = 0, height = 0;  ///< of a tile [px]
  float pager = 0;                       ///< width of a pager beside the tiles [px]; 0: below them
  bool paged = false;

  std::size_t page_size() const { return columns * rows; }
};

TileGrid GridOf(std::size_t tiles, const PictureLayout& layout) {
  const image::ImageSize size = TileSize(layout);
  TileGrid grid;
  grid.gap = Gap(layout);
  const auto fit = [&](float room, int each) {
    return std::max<std::size_t>(
        1, static_cast<std::size_t>((room - grid.gap) / (static_cast<float>(each) + grid.gap)));
  };
  grid.columns = fit(layout.tiles.width, size.width);
  grid.paged = tiles > grid.columns * fit(layout.tiles.height, size.height);
  const bool low = layout.tiles.height < static_cast<float>(size.height) + layout.line();
  if (grid.paged && low) {
    grid.pager = kPagerWidth_em * layout.em;
    grid.columns = fit(layout.tiles.width - grid.pager, size.width);
  }
  const bool in_row = layout.tiles.width >= static_cast<float>(layout.size.width);
  if (in_row) grid.columns = std::clamp<std::size_t>(tiles, 1, grid.columns);
  const float room = layout.tiles.height - (grid.paged && !low ? layout.line() : 0);
  grid.rows = fit(room, size.height);
  grid.width =
      (layout.tiles.width - grid.pager - grid.gap) / static_cast<float>(grid.columns) - grid.gap;
  grid.height = std::min(kMostStretch * static_cast<float>(size.height),
                         (room - grid.gap) / static_cast<float>(grid.rows) - grid.gap);
  return grid;
}

/// "4–6 of 7, 1 not valid"
PanelLine PagerOf(const std::vector<PointTile>& tiles, std::size_t first, std::size_t page_size) {
  const auto invalid = std::count_if(tiles.begin(), tiles.end(),
                                     [](const PointTile& tile) { return !tile.valid(); });
  const std::string text = fmt::format("{}–{} of {}", first + 1,
                                       std::min(first + page_size, tiles.size()), tiles.size());
  if (invalid == 0) return {text, Tone::kFaded};
  return {fmt::format("{}, {} not valid", text, invalid), Tone::kBad};
}

}  // namespace

void AddPointTiles(const ViewFacts& facts, PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const scene::Area& all = layout.tiles;
  writer.Box(all, palette::kGround);
  if (facts.state == nullptr) return;
  const std::vector<PointTile> tiles = TilesOf(facts);
  const TileGrid grid = GridOf(tiles.size(), layout);
  const float x = all.x + grid.gap, step_x = grid.width + grid.gap;
  if (tiles.empty()) {
    writer.Text(x, all.y + grid.gap, all.width - 2 * grid.gap, layout.em,
                "no assembly point configured", palette::kFaded);
    return;
  }
  const std::size_t pages = (tiles.size() + grid.page_size() - 1) / grid.page_size();
  const auto turn = static_cast<std::size_t>(std::max(0.0, facts.state->utc_s) / kTilePage_s);
  const std::size_t first = turn % pages * grid.page_size();
  for (std::size_t k = 0; k < grid.page_size() && first + k < tiles.size(); ++k) {
    const std::size_t column = k % grid.columns, row = k / grid.columns;
    const float y = all.y + grid.gap + static_cast<float>(row) * (grid.height + grid.gap);
    AddTile(tiles[first + k], {x + static_cast<float>(column) * step_x, y, grid.width, grid.height},
            writer);
  }
  if (!grid.paged) return;
  if (grid.pager > 0) {
    float y = all.y + 2 * grid.gap;
    const PanelLine pager = PagerOf(tiles, first, grid.page_size());
    for (const std::string& row : writer.Rows(pager.text, layout.em, grid.pager - grid.gap)) {
      writer.Line(all.x + all.width - grid.pager, y, grid.pager - grid.gap, {row, pager.tone});
      y += layout.line();
    }
    return;
  }
  writer.Line(x, all.bottom() - layout.line() - grid.gap / 2, all.width - 2 * grid.gap,
              PagerOf(tiles, first, grid.page_size()));
}

}  // namespace plumbline::display
