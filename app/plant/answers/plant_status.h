// State of the plant: every cell's last word, what is missing, refused or unreadable.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/plant/database/connection.h"

namespace plumbline::plant {

/// Row of one cell, as the database has it. Texts come from the cell and are not trusted. Times are
/// seconds of UTC since 1970.
struct CellState {
  std::int64_t cell = 0;
  std::string line, node;
  std::string name;  ///< as the cell calls itself, else its node
  std::string arm_model, arm_series, page, version;
  bool born = false;    ///< an NBIRTH has been stored
  bool online = false;  ///< no newer NDEATH
  bool clean_shutdown = false;
  std::optional<double> received_utc, state_utc;
  std::optional<int> health;  ///< HealthSeverity of its newest state
  std::string health_reason;
  std::optional<double> drift_statistic;  ///< of the drift monitor; it alarms above 1
  int model = 0, proposed_model = 0;
  std::string stale_lens;        ///< "camera: reason" of the first camera whose lens is stale
  std::int64_t missing = 0;      ///< messages that have not arrived
  std::int64_t unexplained = 0;  ///< of these, settled and not reported as dropped by the cell
  std::int64_t queued = 0;       ///< messages waiting at the cell when it connected last
  std::int64_t refused = 0;      ///< because there were too many, since the cell was first seen
  std::string refused_reason;    ///< of the newest
  std::optional<double> refused_utc;  ///< of the newest
};

/// What a finding means for whoever looks at the plant, least urgent first.
enum class Urgency { kNone, kNotice, kAbsent, kAttention, kAlarm };

struct Finding {
  Urgency urgency = Urgency::kNone;
  std::string text;  ///< one line
};

/// Period within which a refusal or an unreadable message counts as present.
inline constexpr double kRecent_s = 86400;
/// A cell that is online and silent for longer is reported. The longest period of states that
/// plumbline-fleet allows is an hour; its default is seconds.
inline constexpr double kSilent_s = 300;
/// Age of a newest state at its arrival from which a cell counts as catching up; as far in the
/// future, its clock is wrong.
inline constexpr double kBehind_s = 120;

/// Why someone should look at the cell, most urgent first; empty if everything is in order. Pure.
std::vector<Finding> FindingsOf(const CellState& cell, double now_utc);

/// Whether the cell is known not to send now, so that what it said last is history.
bool IsAbsent(const CellState& cell, double now_utc);

/// The most urgent of the findings.
Urgency UrgencyOf(const std::vector<Finding>& findings);
/// Whether a person has to act: absent cells that were shut down cleanly and notices do not need
/// one.
bool NeedsPerson(const std::vector<Finding>& findings);

struct CountedReason {
  std::string reason;
  std::int64_t messages = 0;
  double newest_utc = 0;
  std::string example;  ///< topic of one of them
};

struct JobCounts {
  std::int64_t waiting = 0, running = 0, failed = 0;  ///< failed: within kRecent_s
};

struct PlantState {
  double now_utc = 0;  ///< by the database's clock
  std::vector<CellState> cells;
  /// Of the last week, most frequent first, ten at most; nullopt: not read.
  std::optional<std::vector<CountedReason>> dead_letters;
  std::optional<JobCounts> jobs;  ///< nullopt: not read
};

/// One snapshot. Reads one row a cell and never a message.
Result<std::vector<CellState>> ReadCells(Connection& connection, double& now_utc);
Result<PlantState> ReadPlantState(Connection& connection);

/// Findings of the plant as a whole. Pure.
std::vector<Finding> FindingsOf(const PlantState& plant);

struct RankedCell {
  const CellState* cell;
  std::vector<Finding> findings;
  bool absent = false;
};
/// The cells, most urgent first; of the same urgency by line and name.
std::vector<RankedCell> RankedCells(const std::vector<CellState>& cells, double now_utc);

/// "3 s", "12 min", "5 h", "3 d".
std::string AgeText(double age_s);

}  // namespace plumbline::plant
