#include "app/display/view/detail_band.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/display/view/palette.h"
#include "app/display/view/panels.h"

namespace plumbline::display {
namespace {

constexpr float kOneRow_em = 72;  ///< width from which all cells are side by side
constexpr std::size_t kMostMessages = 40;

/// Whether the operator should act on it.
bool IsUrgent(const PanelLine& line) {
  return line.tone == Tone::kBad || line.tone == Tone::kAttention;
}

/// One row of a cell. @see RowsOf
struct Row {
  PanelLine line;
  std::string rest;  ///< from here to the end of the line: shown if the next row has no room
  bool starts_line;
};

/// "long name of a pair: 12.3 mm" shortened before its value, so that the value stays.
std::string ShortenedBeforeValue(const std::string& text, float width,
                                 const PictureWriter& writer) {
  constexpr float kMostForValue = 0.6F;
  const float em = writer.layout().em;
  const std::size_t colon = text.rfind(": ");
  if (colon == std::string::npos || writer.WidthOf(text, em) <= width) return text;
  const std::string value = text.substr(colon);
  const float value_width = writer.WidthOf(value, em);
  if (value_width > kMostForValue * width) return text;
  return writer.Shortened(text.substr(0, colon), em, width - value_width) + value;
}

std::vector<Row> RowsOf(const PanelLine& line, bool wrapped, float width,
                        const PictureWriter& writer) {
  if (!wrapped && !IsUrgent(line)) {
    const std::string text = ShortenedBeforeValue(line.text, width, writer);
    return {{{text, line.tone}, text, true}};
  }
  std::vector<Row> rows;
  std::string rest = MarkedText(line);
  for (const std::string& piece : writer.Rows(rest, writer.layout().em, width)) {
    rows.push_back({{piece, line.tone}, rest, rows.empty()});
    rest.erase(0, std::min(rest.size(), piece.size() + 1));
  }
  return rows;
}

enum class CellKind { kFacts, kMessages };

/// Messages keep their order, are all wrapped, and are not counted.
void AddCell(const Panel& panel, CellKind kind, const scene::Area& area, PictureWriter& writer) {
  const bool facts = kind == CellKind::kFacts;
  const PictureLayout& layout = writer.layout();
  writer.Box(area, palette::kPanel);
  const float margin = 0.5F * layout.em, x = area.x + margin, width = area.width - 2 * margin;
  std::vector<PanelLine> lines = panel.lines;
  if (facts) std::stable_partition(lines.begin(), lines.end(), IsUrgent);
  std::vector<Row> rows;
  for (const PanelLine& line : lines) {
    for (Row& row : RowsOf(line, !facts, width, writer)) rows.push_back(std::move(row));
  }
  const auto room = static_cast<std::size_t>(
      std::max(0.0F, (area.height - 0.3F * layout.em) / layout.line() - 1 + 0.02F));
  const std::size_t shown = std::min(room, rows.size());
  const auto hidden = std::count_if(rows.begin() + static_cast<std::ptrdiff_t>(shown), rows.end(),
                                    [](const Row& row) { return row.starts_line; });
  float y = area.y + 0.2F * layout.em;
  writer.Text(x, y, width, layout.em,
              facts && hidden > 0 ? fmt::format("{} ({} more)", panel.title, hidden) : panel.title,
              palette::kFaded);
  for (std::size_t k = 0; k < shown; ++k) {
    y += layout.line();
    const bool cut = k + 1 == shown && shown < rows.size() && !rows[shown].starts_line;
    writer.Text(x, y, width, layout.em, cut ? rows[k].rest : rows[k].line.text,
                palette::OfTone(rows[k].line.tone));
  }
}

}  // namespace

void AddDetailBand(const ViewFacts& facts, PictureWriter& writer) {
  const PictureLayout& layout = writer.layout();
  const scene::Area& band = layout.band;
  if (band.height < layout.line()) return;
  writer.Box(band, palette::kGround);
  std::vector<Panel> panels = WallPanelsOf(facts);
  panels.push_back({"Messages, newest first (UTC)", RecentMessages(facts, kMostMessages)});
  const std::size_t messages = panels.size() - 1;
  const bool one_row = band.width >= kOneRow_em * layout.em;
  const std::size_t columns = one_row ? panels.size() : (panels.size() + 1) / 2;
  const std::size_t rows = (panels.size() + columns - 1) / columns;
  const float gap = std::round(0.25F * layout.em);
  // The messages are half as wide again as the other cells if they are beside them.
  const float parts = static_cast<float>(columns) + (one_row ? 0.5F : 0.0F);
  const float part = (band.width - gap) / parts;
  const float height = (band.height - gap) / static_cast<float>(rows);
  for (std::size_t k = 0; k < panels.size(); ++k) {
    const auto column = static_cast<float>(k % columns), row = static_cast<float>(k / columns);
    const float wide = one_row && k == messages ? 1.5F : 1.0F;
    AddCell(panels[k], k == messages ? CellKind::kMessages : CellKind::kFacts,
            {band.x + gap + column * part, band.y + gap + row * height, wide * part - gap,
             height - gap},
            writer);
  }
}

}  // namespace plumbline::display
