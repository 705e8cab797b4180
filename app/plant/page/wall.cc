#include "app/plant/page/wall.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "app/base/http/html_text.h"
#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/plant/answers/state_words.h"
#include "app/plant/answers/status_text.h"
#include "app/plant/page/plant_page_files.h"

namespace plumbline::plant {
namespace {

using http::EscapedHtml;

constexpr std::size_t kMostReasons = 3;

std::string CardHtml(const RankedCell& one, const WallCard& card) {
  const CellState& cell = *one.cell;
  const StateWord word = WordOf(one);
  const std::string name = EscapedHtml(ShownName(cell.node, cell.name));
  const std::string page = http::WebAddress(cell.page);
  const std::string link = page.empty()
                               ? name
                               : fmt::format("<a href=\"{}\" rel=\"noopener noreferrer\">{}</a>",
                                             EscapedHtml(page), name);
  const std::string arm = cell.arm_model.empty() ? ""
                                                 : fmt::format("<span class=\"model\">, {}</span>",
                                                               EscapedHtml(cell.arm_model));
  std::string html = fmt::format(
      "<li id=\"c{}\" class=\"card {}\" data-line=\"{}\" data-state=\"{}\" data-group=\"{}\" "
      "data-words=\"{}\"><h3><span class=\"word\">{}</span><span class=\"glyph\" "
      "aria-hidden=\"true\">{}</span> {}</h3><p class=\"arm\">{}</p>",
      cell.cell, word.name, EscapedHtml(card.line), word.name, card.group, EscapedHtml(card.words),
      word.word, word.glyph, link, EscapedHtml(cell.line) + arm);
  for (std::size_t k = 0; k < std::min(one.findings.size(), kMostReasons); ++k) {
    html += fmt::format("<p class=\"why\">{}</p>", EscapedHtml(one.findings[k].text));
  }
  if (one.findings.size() > kMostReasons) {
    html += fmt::format("<p class=\"why\">and {} more</p>", one.findings.size() - kMostReasons);
  }
  return html + "</li>";
}

WallCard CardOf(const RankedCell& one) {
  const CellState& cell = *one.cell;
  const char* const group = NeedsPerson(one.findings) ? "person"
                            : one.findings.empty()    ? "rest"
                                                      : "note";
  WallCard card{cell.cell, cell.line, "", WordOf(one).name, group, "", 0};
  std::string words = fmt::format("{} {} {} {} {}", cell.line, cell.name, cell.node, cell.arm_model,
                                  cell.arm_series);
  for (const Finding& finding : one.findings) words += " " + finding.text;
  card.words = LowerCase(words);
  card.html = CardHtml(one, card);
  return card;
}

WallStrip StripOf(const std::vector<RankedCell>& ranked, const PlantState& plant) {
  const auto need = std::count_if(ranked.begin(), ranked.end(),
                                  [](const RankedCell& one) { return NeedsPerson(one.findings); });
  WallStrip strip;
  strip.headline = need == 0   ? "No cell needs a person"
                   : need == 1 ? "1 cell needs a person"
                               : fmt::format("{} cells need a person", need);
  strip.reason = fmt::format("{} cells", ranked.size());
  for (const std::string& count : CountsByWord(ranked)) strip.reason += " · " + count;
  Urgency worst = ranked.empty() ? Urgency::kNone : UrgencyOf(ranked.front().findings);
  for (const Finding& finding : FindingsOf(plant)) {
    worst = std::max(worst, finding.urgency);
    strip.reason = finding.text + ". " + strip.reason;
  }
  strip.style = worst == Urgency::kAlarm       ? "alarm"
                : worst == Urgency::kAttention ? "warning"
                                               : "healthy";
  strip.glyph = worst == Urgency::kAlarm ? "■" : worst == Urgency::kAttention ? "▲" : "●";
  return strip;
}

/// "2026-11-30 10:16:31 UTC".
std::string TimeText(double utc) {
  std::string text = text::TextFromUtc(utc);
  text.replace(text.find('T'), 1, " ");
  return text.replace(text.find('Z'), 1, " UTC");
}

std::string StripHtml(const WallStrip& strip, double now_utc) {
  return fmt::format(
      "<header id=\"head\" class=\"{}\"><span id=\"glyph\" aria-hidden=\"true\">{}</span>"
      "<div role=\"status\"><h1 id=\"headline\">{}</h1><p id=\"reason\">{}</p></div>"
      "<p id=\"about\">{}</p></header>",
      strip.style, strip.glyph, EscapedHtml(strip.headline), EscapedHtml(strip.reason),
      TimeText(now_utc));
}

std::string SelectionHtml(const WallSelection& selection) {
  std::string html = fmt::format(
      "<form id=\"selection\" method=\"get\" action=\"/\"><label>Search <input name=\"q\" "
      "type=\"search\" value=\"{}\" autocomplete=\"off\"></label><label>Show <select "
      "name=\"state\">",
      EscapedHtml(selection.words));
  const std::pair<const char*, const char*> states[] = {
      {"", "all cells"},        {"person", "who need a person"}, {"alarm", "ALARM"},
      {"warning", "ATTENTION"}, {"unknown", "NO DATA"},          {"advisory", "NOTE"},
      {"healthy", "OK"}};
  for (const auto& [value, words] : states) {
    html += fmt::format("<option value=\"{}\"{}>{}</option>", value,
                        selection.state == value ? " selected" : "", words);
  }
  return html + fmt::format(
                    "</select></label><label><input name=\"lines\" type=\"checkbox\" value=\"1\"{}>"
                    " by line</label><button>Apply</button></form>",
                    selection.by_line ? " checked" : "");
}

std::string ListHtml(const std::string& key, const std::string& title, const std::string& cards) {
  return fmt::format("<section><h2>{}</h2><ol data-list=\"{}\">{}</ol></section>",
                     EscapedHtml(title), EscapedHtml(key), cards);
}

}  // namespace

Wall WallFrom(const std::vector<CellState>& cells, double now_utc, const Wall& before) {
  Wall wall;
  PlantState plant;
  plant.now_utc = now_utc;
  plant.cells = cells;
  const std::vector<RankedCell> ranked = RankedCells(plant.cells, now_utc);
  std::map<std::int64_t, const WallCard*> known;
  for (const WallCard& card : before.cards) known[card.cell] = &card;
  wall.now_utc = now_utc;
  wall.strip = StripOf(ranked, plant);
  wall.status = StatusJson(plant);
  bool changed =
      before.version == 0 || wall.strip != before.strip || ranked.size() != before.cards.size();
  for (const RankedCell& one : ranked) {
    WallCard card = CardOf(one);
    const auto found = known.find(card.cell);
    const bool same = found != known.end() && found->second->html == card.html;
    card.changed = same ? found->second->changed : before.version + 1;
    const std::size_t place = wall.cards.size();
    changed = changed || !same || before.cards[place].cell != card.cell;
    wall.cards.push_back(std::move(card));
  }
  wall.version = before.version + (changed ? 1 : 0);
  return wall;
}

bool WallSelection::Shows(const WallCard& card) const {
  if (state == "person" && card.group != state) return false;
  if (!state.empty() && state != "person" && state != card.state) return false;
  for (std::size_t at = 0; at < words.size();) {
    const std::size_t end = std::min(words.find(' ', at), words.size());
    if (card.words.find(words.substr(at, end - at)) == std::string::npos) return false;
    at = end + 1;
  }
  return true;
}

std::string WallHtml(const Wall& wall, const WallSelection& selection, const std::string& start,
                     const std::string& problem) {
  std::map<std::string, std::string> lines, groups;  // their cards
  for (const WallCard& card : wall.cards) {
    const std::string html = selection.Shows(card) ? card.html : "<li hidden" + card.html.substr(3);
    (selection.by_line ? lines[card.line] : groups[card.group]) += html;
  }
  std::string lists;
  if (selection.by_line) {
    for (const auto& [line, cards] : lines) lists += ListHtml("line " + line, line, cards);
  } else {
    lists = ListHtml("person", "Need a person", groups["person"]) +
            ListHtml("note", "To know", groups["note"]) +
            ListHtml("rest", "In order", groups["rest"]);
  }
  WallStrip strip = wall.strip;
  if (!problem.empty()) strip = {"lost", "○", "LOST", problem};
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{} - Plumbline</title>\n<link rel=\"icon\" href=\"icon.svg\" "
      "type=\"image/svg+xml\">\n"
      "<link rel=\"stylesheet\" href=\"page.css\">\n<script src=\"wall.js\" defer></script>\n"
      "</head>\n<body data-version=\"{}-{}\">\n{}\n{}\n<main{}>{}</main>\n<footer><a "
      "href=\"status.json\">status.json</a></footer>\n</body>\n</html>\n",
      EscapedHtml(strip.headline), start, wall.version, StripHtml(strip, wall.now_utc),
      SelectionHtml(selection), selection.by_line ? " class=\"lines\"" : "", lists);
}

std::string WallUpdateJson(const Wall& wall, std::uint64_t since, const std::string& start,
                           const std::string& problem) {
  WallStrip strip = wall.strip;
  if (!problem.empty()) strip = {"lost", "○", "LOST", problem};
  nlohmann::ordered_json json = {{"version", fmt::format("{}-{}", start, wall.version)},
                                 {"time", TimeText(wall.now_utc)},
                                 {"strip",
                                  {{"style", strip.style},
                                   {"glyph", strip.glyph},
                                   {"headline", strip.headline},
                                   {"reason", strip.reason}}},
                                 {"order", nlohmann::ordered_json::array()},
                                 {"cards", nlohmann::ordered_json::array()}};
  for (const WallCard& card : wall.cards) {
    json["order"].push_back(card.cell);
    if (card.changed > since) json["cards"].push_back(card.html);
  }
  return text::JsonText(json);
}

std::uint64_t VersionFromText(std::string_view text, const std::string& start) {
  if (!text.starts_with(start + "-")) return 0;
  text.remove_prefix(start.size() + 1);
  std::uint64_t version = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), version);
  return read.ec == std::errc() && read.ptr == text.data() + text.size() ? version : 0;
}

}  // namespace plumbline::plant
