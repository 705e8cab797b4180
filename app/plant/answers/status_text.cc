#include "app/plant/answers/status_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/base/text/json_text.h"
#include "app/base/text/text.h"
#include "app/plant/answers/state_words.h"

namespace plumbline::plant {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kCellColumns = 24, kAgeColumns = 8;
constexpr std::size_t kMostListed = 10;

std::string CountsText(const std::vector<RankedCell>& ranked) {
  const std::vector<std::string> counts = CountsByWord(ranked);
  std::string text = fmt::format("{} {}", ranked.size(), ranked.size() == 1 ? "cell" : "cells");
  if (!counts.empty()) text += fmt::format(": {}", fmt::join(counts, ", "));
  return text + "\n";
}

std::string CellsTable(const std::vector<RankedCell>& ranked, double now_utc) {
  std::string text =
      fmt::format("\n  {:<10} {:<24} {:<8} {}\n", "state", "line/cell", "last", "why");
  for (const RankedCell& one : ranked) {
    const CellState& cell = *one.cell;
    const std::string last =
        cell.received_utc ? AgeText(now_utc - *cell.received_utc) : std::string("never");
    std::string head =
        fmt::format("{} {:<10} {} {}", WordOf(one).glyph, WordOf(one).word,
                    Padded(cell.line + "/" + ShownName(cell.node, cell.name), kCellColumns),
                    Padded(last, kAgeColumns));
    if (one.findings.empty()) {
      head.erase(head.find_last_not_of(' ') + 1);
      text += head + "\n";
    }
    for (const Finding& finding : one.findings) {
      text += fmt::format("{} {}\n", head, finding.text);
      head = std::string(2 + 10 + 1 + kCellColumns + 1 + kAgeColumns, ' ');
    }
  }
  return text;
}

std::string MissingText(const PlantState& plant) {
  std::int64_t missing = 0, unexplained = 0, refused = 0, behind = 0, queued = 0;
  double most_behind_s = 0, newest_utc = 0;
  for (const CellState& cell : plant.cells) {
    missing += cell.missing;
    unexplained += cell.unexplained;
    refused += cell.refused;
    if (!cell.received_utc) continue;
    newest_utc = std::max(newest_utc, *cell.received_utc);
    const double behind_s = *cell.received_utc - cell.state_utc.value_or(*cell.received_utc);
    behind += behind_s > kBehind_s;
    queued += behind_s > kBehind_s ? cell.queued : 0;
    most_behind_s = std::max(most_behind_s, behind_s);
  }
  std::string text = "\n";
  text += newest_utc > 0 ? fmt::format("collector    newest message stored {} ago\n",
                                       AgeText(plant.now_utc - newest_utc))
                         : std::string("collector    no message has been stored yet\n");
  if (behind > 0) {
    text += fmt::format(
        "backlog      {} {} catching up, at most {} behind; {} messages were\n"
        "             queued when they connected\n",
        behind, behind == 1 ? "cell is" : "cells are", AgeText(most_behind_s), queued);
  }
  text += fmt::format(
      "missing      {} messages: {} reported by the cells as dropped from full\n"
      "             queues or still expected, {} unexplained\n",
      missing, missing - unexplained, unexplained);
  if (refused > 0)
    text += fmt::format("refused      {} messages of cells that send too many\n", refused);
  const JobCounts jobs = plant.jobs.value_or(JobCounts{});
  if (jobs.waiting + jobs.running + jobs.failed > 0) {
    text += fmt::format("jobs         {} waiting, {} running, {} failed within a day\n",
                        jobs.waiting, jobs.running, jobs.failed);
  }
  return text;
}

Json FindingsJson(const std::vector<Finding>& findings) {
  Json list = Json::array();
  for (const Finding& finding : findings) {
    list.push_back(
        {{"needs_person", finding.urgency >= Urgency::kAttention}, {"text", finding.text}});
  }
  return list;
}

Json TimeOrNull(const std::optional<double>& utc) {
  return utc ? Json(text::TextFromUtc(*utc)) : Json(nullptr);
}

Json CellJson(const RankedCell& one) {
  const CellState& cell = *one.cell;
  return {{"line", cell.line},
          {"node", cell.node},
          {"name", cell.name},
          {"state", WordOf(one).name},
          {"online", cell.online},
          {"last", TimeOrNull(cell.received_utc)},
          {"state_time", TimeOrNull(cell.state_utc)},
          {"health", cell.health ? Json(*cell.health) : Json(nullptr)},
          {"model", cell.model},
          {"proposed_model", cell.proposed_model},
          {"arm_model", cell.arm_model},
          {"arm_series", cell.arm_series},
          {"version", cell.version},
          {"page", cell.page},
          {"missing", cell.missing},
          {"unexplained", cell.unexplained},
          {"queued", cell.queued},
          {"refused", cell.refused},
          {"findings", FindingsJson(one.findings)}};
}

}  // namespace

std::string StatusText(const PlantState& plant) {
  const std::vector<RankedCell> ranked = RankedCells(plant.cells, plant.now_utc);
  std::string text = CountsText(ranked);
  for (const Finding& finding : FindingsOf(plant)) text += fmt::format("▲ {}\n", finding.text);
  text += CellsTable(ranked, plant.now_utc) + MissingText(plant);
  const auto dead_letters = plant.dead_letters.value_or(std::vector<CountedReason>{});
  if (!dead_letters.empty()) text += "\nunreadable messages of the last seven days\n";
  for (const CountedReason& letters : dead_letters) {
    text += fmt::format("{:>9}  {}, for example {}\n", letters.messages, letters.reason,
                        letters.example);
  }
  std::vector<const CellState*> refused;
  for (const CellState& cell : plant.cells) {
    if (cell.refused > 0) refused.push_back(&cell);
  }
  std::sort(refused.begin(), refused.end(),
            [](const CellState* a, const CellState* b) { return a->refused > b->refused; });
  if (!refused.empty()) text += "\nrefused messages by cell\n";
  for (std::size_t k = 0; k < std::min(refused.size(), kMostListed); ++k) {
    text += fmt::format("{:>9}  {}/{}: {}\n", refused[k]->refused, refused[k]->line,
                        ShownName(refused[k]->node, refused[k]->name), refused[k]->refused_reason);
  }
  return text;
}

std::string StatusJson(const PlantState& plant) {
  Json json = {{"schema", 1},
               {"time", text::TextFromUtc(plant.now_utc)},
               {"needs_person", NeedsPerson(plant)},
               {"findings", FindingsJson(FindingsOf(plant))},
               {"cells", Json::array()}};
  const std::vector<RankedCell> ranked = RankedCells(plant.cells, plant.now_utc);
  for (const RankedCell& one : ranked) json["cells"].push_back(CellJson(one));
  if (plant.dead_letters) json["unreadable"] = Json::array();
  for (const CountedReason& letters : plant.dead_letters.value_or(std::vector<CountedReason>{})) {
    json["unreadable"].push_back({{"reason", letters.reason},
                                  {"messages", letters.messages},
                                  {"newest", text::TextFromUtc(letters.newest_utc)},
                                  {"example", letters.example}});
  }
  if (plant.jobs) {
    json["jobs"] = {{"waiting", plant.jobs->waiting},
                    {"running", plant.jobs->running},
                    {"failed", plant.jobs->failed}};
  }
  return text::JsonText(json, 1) + "\n";
}

bool NeedsPerson(const PlantState& plant) {
  const auto needs = [&](const CellState& cell) {
    return NeedsPerson(FindingsOf(cell, plant.now_utc));
  };
  return NeedsPerson(FindingsOf(plant)) ||
         std::any_of(plant.cells.begin(), plant.cells.end(), needs);
}

}  // namespace plumbline::plant
