#include "app/plant/answers/plant_status.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "firmware-like/cell_health.h"

namespace plumbline::plant {
namespace {

// A cell repeats after a new connection what the broker may have lost, so a gap settles for ten
// minutes before it counts as unexplained. Values of `state` are read as text: a cell may send
// anything there, and a cast that fails would fail for all cells.
constexpr const char* kCells = R"sql(
SELECT c.cell, c.line, c.node, coalesce(nullif(c.name, ''), c.node), c.arm_model, c.arm_series,
       c.page, c.version, c.birth IS NOT NULL,
       c.birth IS NOT NULL AND (c.death IS NULL OR c.death < c.birth),
       coalesce(c.clean_shutdown, false),
       extract(epoch FROM c.last_received), extract(epoch FROM c.state_utc), c.health,
       left(c.state->>'health_reason', 200), left(c.state->>'drift_statistic', 40),
       coalesce(c.model, 0), left(c.state->>'proposed_model', 20),
       (SELECT left(camera || ': ' || reason, 200) FROM camera_now l
         WHERE l.cell = c.cell AND l.lens = 'stale' ORDER BY camera LIMIT 1),
       coalesce(least(g.missing, 1e15)::bigint, 0),
       -- What was refused is missing, too, and known.
       coalesce(least(greatest(g.unexplained - c.limited, 0), 1e15)::bigint, 0),
       c.limited, left(c.limited_reason, 200), extract(epoch FROM c.limited_last),
       extract(epoch FROM now()), coalesce(c.waiting, 0)
FROM cell c LEFT JOIN (
  SELECT cell, sum(coalesce(missing, 0) + given_up) AS missing,
         sum(greatest(0, coalesce(settled, 0) + given_up - dropped)) AS unexplained
  FROM stream LEFT JOIN (
    SELECT cell, stream, sum(last_seq - first_seq + 1) AS missing,
           sum(last_seq - first_seq + 1)
             FILTER (WHERE noticed < now() - interval '10 minutes') AS settled
    FROM gap GROUP BY 1, 2) lost USING (cell, stream)
  GROUP BY cell) g USING (cell)
ORDER BY c.line, c.node)sql";

constexpr const char* kDeadLetters = R"sql(
SELECT left(reason, 200), sum(messages)::bigint, extract(epoch FROM max(hour)), left(max(topic), 200)
FROM dead_letter WHERE received > now() - interval '7 days'
GROUP BY 1 ORDER BY 2 DESC, 1 LIMIT 10)sql";

constexpr const char* kJobs = R"sql(
SELECT count(*) FILTER (WHERE finished IS NULL AND coalesce(lease_until < now(), true)),
       count(*) FILTER (WHERE finished IS NULL AND lease_until >= now()),
       count(*) FILTER (WHERE finished > now() - interval '1 day' AND failed IS NOT NULL)
FROM job WHERE finished IS NULL OR finished > now() - interval '1 day')sql";

std::string TextAt(const Rows& rows, int row, int column) {
  return rows.TextOrNull(row, column).value_or("");
}

std::optional<double> FiniteNumber(const Rows& rows, int row, int column) {
  const std::string text = TextAt(rows, row, column);
  double value = 0;
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  const bool whole = read.ec == std::errc() && read.ptr == text.data() + text.size();
  return whole && std::isfinite(value) ? std::optional(value) : std::nullopt;
}

CellState CellAt(const Rows& rows, int k) {
  CellState cell;
  cell.cell = rows.Integer(k, 0);
  cell.line = rows.Text(k, 1);
  cell.node = rows.Text(k, 2);
  cell.name = rows.Text(k, 3);
  cell.arm_model = TextAt(rows, k, 4);
  cell.arm_series = TextAt(rows, k, 5);
  cell.page = TextAt(rows, k, 6);
  cell.version = TextAt(rows, k, 7);
  cell.born = rows.Bool(k, 8);
  cell.online = rows.Bool(k, 9);
  cell.clean_shutdown = rows.Bool(k, 10);
  cell.received_utc = rows.NumberOrNull(k, 11);
  cell.state_utc = rows.NumberOrNull(k, 12);
  if (!rows.IsNull(k, 13)) cell.health = static_cast<int>(rows.Integer(k, 13));
  cell.health_reason = TextAt(rows, k, 14);
  cell.drift_statistic = FiniteNumber(rows, k, 15);
  cell.model = static_cast<int>(rows.Integer(k, 16));
  const double proposed = FiniteNumber(rows, k, 17).value_or(0);
  if (proposed > 0 && proposed < 1e9) cell.proposed_model = static_cast<int>(proposed);
  cell.stale_lens = TextAt(rows, k, 18);
  cell.missing = rows.Integer(k, 19);
  cell.unexplained = rows.Integer(k, 20);
  cell.refused = rows.Integer(k, 21);
  cell.refused_reason = TextAt(rows, k, 22);
  cell.refused_utc = rows.NumberOrNull(k, 23);
  cell.queued = rows.Integer(k, 25);
  return cell;
}

Urgency UrgencyOfHealth(int health) {
  if (health <= static_cast<int>(HealthSeverity::kGood)) return Urgency::kNone;
  if (health == static_cast<int>(HealthSeverity::kNotice)) return Urgency::kNotice;
  return health == static_cast<int>(HealthSeverity::kAttention) ? Urgency::kAttention
                                                                : Urgency::kAlarm;
}

/// Whether the cell is connected and sends; if not, why its state says nothing about now.
std::optional<Finding> AbsenceOf(const CellState& cell, double now_utc) {
  const double heard_utc = cell.received_utc.value_or(0);
  const auto since = [&] { return AgeText(now_utc - heard_utc); };
  if (!cell.born) return Finding{Urgency::kAbsent, "has not announced itself yet"};
  if (!cell.online && cell.clean_shutdown) {
    return Finding{Urgency::kAbsent, fmt::format("shut down {} ago", since())};
  }
  if (!cell.online) {
    return Finding{Urgency::kAttention,
                   fmt::format("offline for {}: its connection broke", since())};
  }
  if (now_utc - heard_utc > kSilent_s) {
    return Finding{Urgency::kAttention, fmt::format("connected, but silent for {}", since())};
  }
  return std::nullopt;
}

/// Order of names in which "cell 9" comes before "cell 10".
bool IsBefore(const std::string& a, const std::string& b) {
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  std::size_t i = 0, k = 0;
  while (i < a.size() && k < b.size()) {
    if (is_digit(a[i]) && is_digit(b[k])) {
      const auto number = [&](const std::string& text, std::size_t& at) {
        while (at + 1 < text.size() && text[at] == '0' && is_digit(text[at + 1])) ++at;
        const std::size_t begin = at;
        while (at < text.size() && is_digit(text[at])) ++at;
        return std::string_view(text).substr(begin, at - begin);
      };
      const std::string_view left = number(a, i), right = number(b, k);
      if (left.size() != right.size()) return left.size() < right.size();
      if (left != right) return left < right;
    } else {
      if (a[i] != b[k]) return a[i] < b[k];
      ++i;
      ++k;
    }
  }
  return a.size() - i < b.size() - k;
}

}  // namespace

std::string AgeText(double age_s) {
  const double s = std::max(0.0, age_s);
  if (s < 120) return fmt::format("{:.0f} s", s);
  if (s < 7200) return fmt::format("{:.0f} min", s / 60);
  if (s < 172800) return fmt::format("{:.0f} h", s / 3600);
  return fmt::format("{:.0f} d", s / 86400);
}

std::vector<Finding> FindingsOf(const CellState& cell, double now_utc) {
  std::vector<Finding> findings;
  const std::optional<Finding> absence = AbsenceOf(cell, now_utc);
  const bool absent = absence.has_value();
  if (absent) findings.push_back(*absence);
  // What an absent cell said last is history.
  const bool drifts = !absent && cell.drift_statistic.value_or(0) > 1;
  const bool proposed = !absent && cell.proposed_model > 0;
  if (!absent && cell.health) {
    const std::string& reason = cell.health_reason;
    const Urgency urgency = UrgencyOfHealth(*cell.health);
    // A reason of which a finding below says more; never one that is more urgent than it.
    const bool said_below =
        reason.empty() ? drifts || proposed
                       : (drifts && reason == Describe(HealthReason::kDrift)) ||
                             (proposed && reason == Describe(HealthReason::kProposalWaiting));
    const bool covered = said_below && urgency <= (drifts ? Urgency::kAttention : Urgency::kNotice);
    if (urgency != Urgency::kNone && !covered) {
      findings.push_back({urgency, reason.empty() ? "no reason given" : reason});
    }
  }
  if (drifts) {
    findings.push_back(
        {Urgency::kAttention, fmt::format("drift: {:.3g} times the limit", *cell.drift_statistic)});
  }
  if (!cell.stale_lens.empty()) {
    findings.push_back({Urgency::kAttention, "lens stale, " + cell.stale_lens});
  }
  if (cell.unexplained > 0) {
    findings.push_back(
        {Urgency::kAttention, fmt::format("{} {} lost, unexplained", cell.unexplained,
                                          cell.unexplained == 1 ? "message" : "messages")});
  }
  if (cell.refused_utc && now_utc - *cell.refused_utc < kRecent_s) {
    findings.push_back(
        {Urgency::kAttention, fmt::format("messages refused: {}", cell.refused_reason)});
  }
  const double behind_s = cell.received_utc.value_or(0) - cell.state_utc.value_or(0);
  if (!absent && cell.state_utc && behind_s > kBehind_s) {
    std::string text = fmt::format("catching up, its state is {} old", AgeText(behind_s));
    if (cell.queued > 0) text += fmt::format("; {} queued when it connected", cell.queued);
    findings.push_back({Urgency::kNotice, text});
  }
  if (cell.state_utc && -behind_s > kBehind_s) {
    findings.push_back(
        {Urgency::kAttention, fmt::format("its clock was {} ahead", AgeText(-behind_s))});
  }
  if (proposed) {
    findings.push_back(
        {Urgency::kNotice, fmt::format("model {} awaits approval", cell.proposed_model)});
  }
  std::stable_sort(findings.begin(), findings.end(),
                   [](const Finding& a, const Finding& b) { return a.urgency > b.urgency; });
  return findings;
}

bool IsAbsent(const CellState& cell, double now_utc) {
  return AbsenceOf(cell, now_utc).has_value();
}

Urgency UrgencyOf(const std::vector<Finding>& findings) {
  return findings.empty() ? Urgency::kNone : findings.front().urgency;
}

bool NeedsPerson(const std::vector<Finding>& findings) {
  return UrgencyOf(findings) >= Urgency::kAttention;
}

std::vector<Finding> FindingsOf(const PlantState& plant) {
  std::vector<Finding> findings;
  double newest_utc = 0;
  int online = 0;
  for (const CellState& cell : plant.cells) {
    newest_utc = std::max(newest_utc, cell.received_utc.value_or(0));
    online += cell.online;
  }
  if (online > 0 && plant.now_utc - newest_utc > kSilent_s) {
    findings.push_back(
        {Urgency::kAlarm,
         fmt::format("no message from any cell for {}: check plumbline-collect and the broker",
                     AgeText(plant.now_utc - newest_utc))});
  }
  for (const CountedReason& letters : plant.dead_letters.value_or(std::vector<CountedReason>{})) {
    if (plant.now_utc - letters.newest_utc > kRecent_s) continue;
    findings.push_back(
        {Urgency::kAttention, fmt::format("{} unreadable: {}", letters.messages, letters.reason)});
  }
  if (const auto failed = plant.jobs ? plant.jobs->failed : 0; failed > 0) {
    findings.push_back(
        {Urgency::kAttention,
         fmt::format("{} failed within a day",
                     failed == 1 ? std::string("1 job") : fmt::format("{} jobs", failed))});
  }
  return findings;
}

std::vector<RankedCell> RankedCells(const std::vector<CellState>& cells, double now_utc) {
  std::vector<RankedCell> ranked;
  for (const CellState& cell : cells) {
    ranked.push_back({&cell, FindingsOf(cell, now_utc), IsAbsent(cell, now_utc)});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const RankedCell& a, const RankedCell& b) {
    const Urgency urgency_a = UrgencyOf(a.findings), urgency_b = UrgencyOf(b.findings);
    if (urgency_a != urgency_b) return urgency_a > urgency_b;
    if (a.cell->line != b.cell->line) return IsBefore(a.cell->line, b.cell->line);
    return IsBefore(a.cell->name, b.cell->name);
  });
  return ranked;
}

Result<std::vector<CellState>> ReadCells(Connection& connection, double& now_utc) {
  const auto rows = connection.RunPrepared(kCells, {});
  if (!rows) return rows.failure();
  std::vector<CellState> cells;
  for (int k = 0; k < rows->size(); ++k) {
    cells.push_back(CellAt(*rows, k));
    now_utc = rows->Number(k, 24);
  }
  return cells;
}

Result<PlantState> ReadPlantState(Connection& connection) {
  PlantState plant;
  const auto now = connection.Run("SELECT extract(epoch FROM now())");
  if (!now) return now.failure();
  plant.now_utc = now->Number(0, 0);
  auto cells = ReadCells(connection, plant.now_utc);
  if (!cells) return cells.failure();
  plant.cells = std::move(cells).value();
  const auto letters = connection.Run(kDeadLetters);
  if (!letters) return letters.failure();
  plant.dead_letters.emplace();
  for (int k = 0; k < letters->size(); ++k) {
    plant.dead_letters->push_back({std::string(letters->Text(k, 0)), letters->Integer(k, 1),
                                   letters->Number(k, 2), std::string(letters->Text(k, 3))});
  }
  const auto jobs = connection.Run(kJobs);
  if (!jobs) return jobs.failure();
  plant.jobs = JobCounts{jobs->Integer(0, 0), jobs->Integer(0, 1), jobs->Integer(0, 2)};
  return plant;
}

}  // namespace plumbline::plant
