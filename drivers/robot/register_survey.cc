#include "drivers/robot/register_survey.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <limits>

namespace plumbline::robot {
namespace {

using Kind = ReadOutcome::Kind;

bool IsSilent(const ReadOutcome& outcome) {
  return !outcome.ok() && outcome.kind != Kind::kException;
}

constexpr int kUnitIds[] = {1, 255, 0};
constexpr int kUsualLast = 1023;       // every register up to here is tried
constexpr int kSampleDistance = 1000;  // beyond, the first two registers of each thousand
constexpr int kIsland = 512;           // registers that are tried around a sample that answers
constexpr double kSamples_s = 4;       // time for the samples of one table
constexpr int kStages = 4;             // of the progress: ranges and samples of two tables
constexpr RegisterTable kTables[] = {RegisterTable::kHolding, RegisterTable::kInput};

/// The codes of a gateway that has no such unit.
bool DeniesUnit(const ReadOutcome& outcome) {
  return outcome.kind == Kind::kException && (outcome.exception == 10 || outcome.exception == 11);
}

bool AnswersUnit(const ReadOutcome& outcome) {
  return !IsSilent(outcome) && !DeniesUnit(outcome);
}

/// The unit that a device has, of a silent one and another one that answered: a device that is
/// slow, or loses requests, answers to any unit at times. nullopt if both answer irregularly.
std::optional<int> UnitOf(RegisterClient& client, int silent, int other, RegisterTable table) {
  constexpr int kRounds = 3;
  for (int round = 0; round < kRounds; ++round) {
    if (AnswersUnit(client.Read(silent, {table, 0, 1}))) return silent;
    if (!AnswersUnit(client.Read(other, {table, 0, 1}))) return std::nullopt;
  }
  return other;
}

std::string UnitsText(const std::vector<int>& units) {
  return fmt::format("{}", fmt::join(units, ", "));
}

/// Remedy for a device that answers no request at all in the way of Modbus TCP.
std::string FramingText(RegisterClient& client, int unit, const ReadOutcome& answer) {
  if (answer.kind == Kind::kForeign) {
    return answer.what.starts_with("transaction id")
               ? "the device does not repeat the transaction id of the request (" + answer.what +
                     "), so a late answer cannot be distinguished from the next one: update its "
                     "firmware, "
                     "or use another gateway"
               : "what answers is not a Modbus TCP server, or not this unit (" + answer.what +
                     "): check port and unit id";
  }
  if (client.AnswersRtuFrames(unit)) {
    return "RTU frames over TCP: the gateway passes serial frames through; set it to Modbus TCP "
           "(often \"Modbus TCP to RTU\" instead of \"transparent\" or \"TCP server\")";
  }
  return "";
}

/// Reads ranges of one table into an image.
class TableSurvey {
 public:
  TableSurvey(RegisterClient& client, const SurveyOptions& options, int unit, RegisterTable table,
              int& max_count, double until_s)
      : client_(client), options_(options), unit_(unit), max_count_(max_count), until_s_(until_s) {
    image_.table = table;
  }

  bool unknown_function() const { return unknown_function_; }
  bool stopped() const { return stopped_; }
  bool lost() const { return lost_; }
  RegisterImage& image() { return image_; }
  void Begin(int stage) { stage_ = stage; }

  /// Registers from `at` on that can be read; fewer than `count`. Even counts first, because a
  /// device may refuse half of a 32-bit value.
  int Prefix(int at, int count) {
    int good = 0, bad = (count + 1) / 2;  // in pairs
    while (bad - good > 1) {
      const int middle = (good + bad) / 2;
      (Read(at, 2 * middle) ? good : bad) = middle;
    }
    if (2 * good + 1 < count && Read(at, 2 * good + 1)) return 2 * good + 1;
    return 2 * good;
  }

  /// @param one_island  end at the first register that is missing
  void Range(int first, int end, bool one_island) {
    int at = first;
    if (!one_island) from_ = first, to_ = end;
    while (at < end && Going(at)) {
      const int count = std::min(max_count_, end - at);
      if (Read(at, count)) {
        at += count;
        continue;
      }
      if (unknown_function_) return;
      const int answered = Prefix(at, count);
      at += answered;
      if (answered > 0 && at < end && Read(at, std::min(2, end - at))) {
        // Either the request was too long, or it crossed a boundary that none may cross.
        if (Read(at, std::min(answered + 1, end - at)) || answered + 1 > end - at) {
          image_.starts.insert(at);
        } else {
          max_count_ = answered;
        }
        continue;
      }
      if (one_island) return;
      at = NextIsland(at + 1, end);
    }
  }

  /// The first two registers of each thousand, and what lies behind those that answer.
  void SampleThousands(double until_s) {
    from_ = kSampleDistance, to_ = 65536;
    for (int sample = kSampleDistance; sample < 65500; sample += kSampleDistance) {
      if (MonotonicSeconds() > until_s) {
        stopped_ = true;
        return;
      }
      if (!Going(sample)) return;
      for (const int first : {sample, sample + 1}) {
        if (image_.words.contains(first) || !Read(first, 2)) continue;
        Range(first, std::min(first + max_count_, 65536), true);
        const auto from = image_.words.lower_bound(first);
        const bool empty = std::all_of(from, image_.words.end(),
                                       [](const auto& word) { return word.second == 0; });
        if (empty) {
          image_.words.erase(from, image_.words.end());
        } else {
          Range(first + max_count_, std::min(first + kIsland, 65536), true);
        }
        break;
      }
    }
  }

 private:
  bool Going(int at) {
    if (stopped_ || lost_) return false;
    const double share = static_cast<double>(at - from_) / (to_ - from_);
    const bool goes_on =
        !options_.progress || options_.progress((stage_ + std::clamp(share, 0.0, 1.0)) / kStages,
                                                fmt::format("{} registers", NameOf(image_.table)));
    stopped_ = !goes_on || MonotonicSeconds() > until_s_ ||
               image_.words.size() >= options_.max_words ||
               client_.requests() >= client_.options().max_requests;
    return !stopped_;
  }

  bool Read(int first, int count) {
    const ReadOutcome answer = ReadTwice(client_, unit_, {image_.table, first, count});
    if (answer.ok()) image_.Set(first, answer.words);
    silent_in_a_row_ = IsSilent(answer) ? silent_in_a_row_ + 1 : 0;
    lost_ = lost_ || silent_in_a_row_ >= 3;
    unknown_function_ =
        unknown_function_ || (answer.kind == Kind::kException && answer.exception == 1);
    return answer.ok();
  }

  int NextIsland(int first, int end) {
    // Odd, so that values which are only read whole are met at an even and at an odd address.
    const int step = std::max(3, options_.joints - 1 - options_.joints % 2);
    for (int at = first; at + 1 < end && Going(at); at += step) {
      if (!Read(at, 2)) continue;
      // By pairs first: a device may refuse half of a 32-bit value.
      int start = at;
      while (start - 2 >= first && Read(start - 2, 2)) start -= 2;
      if (start - 1 >= first && Read(start - 1, 2)) --start;
      return start;
    }
    return end;
  }

  RegisterClient& client_;
  const SurveyOptions& options_;
  int unit_;
  int& max_count_;
  double until_s_;
  RegisterImage image_;
  int from_ = 0, to_ = 1, stage_ = 0;
  int silent_in_a_row_ = 0;
  bool unknown_function_ = false, stopped_ = false, lost_ = false;
};

/// The unit that answers, with notes on those that do not.
std::optional<int> FindUnit(RegisterClient& client, const SurveyOptions& options, DeviceMap& map) {
  std::vector<int> units(std::begin(kUnitIds), std::end(kUnitIds));
  if (options.unit) units = {*options.unit};
  std::vector<std::string> refusals;
  std::optional<int> silent;  // the first one
  ReadOutcome last;
  for (const int unit : units) {
    const auto read = [&](int of_unit) {
      ReadOutcome outcome = ReadTwice(client, of_unit, {RegisterTable::kHolding, 0, 1});
      if (outcome.kind == Kind::kException && outcome.exception == 1)
        outcome = ReadTwice(client, of_unit, {RegisterTable::kInput, 0, 1});
      return outcome;
    };
    last = read(unit);
    if (AnswersUnit(last)) {
      if (silent && UnitOf(client, *silent, unit, RegisterTable::kHolding) == silent) return silent;
      if (!refusals.empty()) {
        map.notes.push_back(fmt::format("{}: unit {} answers", fmt::join(refusals, ", "), unit));
      }
      return unit;
    }
    if (!silent && IsSilent(last)) silent = unit;
    refusals.push_back(fmt::format("{} from unit {}", last.Text(), unit));
    if (last.kind == Kind::kUnreachable) {
      map.notes.push_back(last.what +
                          ": check address, port and cable, and switch the controller's Modbus "
                          "server on");
      return std::nullopt;
    }
  }
  const std::string framing = FramingText(client, units.front(), last);
  map.notes.push_back(!framing.empty()
                          ? framing
                          : fmt::format("no unit id answers ({}): give the right one with --unit",
                                        fmt::join(refusals, ", ")));
  return std::nullopt;
}

}  // namespace

ReadOutcome ReadTwice(RegisterClient& client, int unit, const RegisterBlock& block) {
  ReadOutcome outcome = client.Read(unit, block);
  if (IsSilent(outcome) && outcome.kind != Kind::kUnreachable) outcome = client.Read(unit, block);
  return outcome;
}

DeviceMap Survey(RegisterClient& client, const SurveyOptions& options) {
  DeviceMap map;
  map.unit = FindUnit(client, options, map);
  if (!map.unit) return map;
  const double until_s = MonotonicSeconds() + options.max_s;
  std::vector<TableSurvey> tables;
  tables.reserve(std::size(kTables));
  for (const RegisterTable table : kTables) {
    tables.emplace_back(client, options, *map.unit, table, map.max_count, until_s);
    std::vector<std::pair<int, int>> ranges = options.ranges;
    if (ranges.empty()) ranges = {{0, kUsualLast}};
    tables.back().Begin(static_cast<int>(tables.size()) - 1);
    for (const auto& [first, last] : ranges) tables.back().Range(first, last + 1, false);
  }
  if (options.ranges.empty()) {
    int stage = static_cast<int>(tables.size());
    for (TableSurvey& table : tables) {
      table.Begin(stage++);
      if (table.unknown_function()) continue;
      table.SampleThousands(std::min(until_s, MonotonicSeconds() + kSamples_s));
    }
  }
  for (TableSurvey& table : tables) {
    map.complete = map.complete && !table.stopped() && !table.lost();
    if (table.unknown_function() && table.image().table == RegisterTable::kHolding) {
      map.notes.push_back(fmt::format("function {} ({} registers) is unknown to the device",
                                      static_cast<int>(table.image().table),
                                      NameOf(table.image().table)));
    }
    if (table.image().words.size() >= options.max_words) {
      map.notes.push_back(
          fmt::format("{} {} registers answer, and no more are read: limit the scan "
                      "with --range to those that the controller's manual names",
                      table.image().words.size(), NameOf(table.image().table)));
    }
    if (table.image().words.empty()) continue;
    // Many devices serve the same registers by both functions.
    if (!map.images.empty() && map.images.front().words == table.image().words) continue;
    map.images.push_back(std::move(table.image()));
  }
  if (map.max_count < kMaxRegistersOfRead) {
    map.notes.push_back(
        fmt::format("requests of more than {} registers are refused", map.max_count));
  }
  if (client.closings() > 2) {
    map.notes.emplace_back(
        "the device closes the connection after each answer, so that the daemon reads it only a "
        "few "
        "times in a second: set robot.stale_after_ms to 1000, and see its settings for a "
        "persistent "
        "connection");
  }
  return map;
}

Result<RegisterImage> ReadAgain(RegisterClient& client, const DeviceMap& map,
                                const RegisterImage& image) {
  RegisterImage again;
  again.table = image.table;
  again.starts = image.starts;
  for (auto at = image.words.begin(); at != image.words.end();) {
    const int first = at->first;
    int count = 0;
    while (at != image.words.end() && at->first == first + count && count < map.max_count &&
           (count == 0 || !image.starts.contains(at->first))) {
      ++count;
      ++at;
    }
    const ReadOutcome answer = ReadTwice(client, *map.unit, {image.table, first, count});
    again.read_s[first] = MonotonicSeconds();
    if (!answer.ok()) {
      return Error{fmt::format("the device does not give its {} {} registers from {} again: {}",
                               count, NameOf(image.table), first, answer.Text())};
    }
    again.Set(first, answer.words);
  }
  return again;
}

std::string RangesText(const RegisterImage& image) {
  std::vector<std::string> ranges;
  for (auto at = image.words.begin(); at != image.words.end();) {
    const int first = at->first;
    int last = first - 1;
    for (; at != image.words.end() && at->first == last + 1; ++at) ++last;
    ranges.push_back(first == last ? std::to_string(first) : fmt::format("{}-{}", first, last));
  }
  return fmt::format("{}", fmt::join(ranges, ", "));
}

LinkRemedyText ExamineLink(RegisterClient& client, int unit,
                           const std::vector<RegisterBlock>& blocks) {
  for (const RegisterBlock& block : blocks) {
    const ReadOutcome answer = ReadTwice(client, unit, block);
    if (answer.ok()) continue;
    if (answer.kind == Kind::kUnreachable) return {};  // the link's own message says it
    const std::string refusal = fmt::format("{} from unit {}", answer.Text(), unit);
    if (!AnswersUnit(answer)) {
      for (const int other : kUnitIds) {
        if (other == unit || !client.Read(other, {block.table, block.first, 1}).ok()) continue;
        if (IsSilent(answer) && UnitOf(client, unit, other, block.table) != other) {
          return {refusal + ", but later from time to time",
                  "the device answers late, or not every request: set a larger robot.timeout_ms, "
                  "and check the network and the load of the controller"};
        }
        return {fmt::format("{}: unit {} answers", refusal, other),
                fmt::format("set unit_id = {} in [robot] or in the profile", other)};
      }
      const std::string framing = FramingText(client, unit, answer);
      if (!framing.empty()) return {refusal, framing};
      if (answer.kind != Kind::kException) return {};
      return {fmt::format("{}: units {} do not answer either", refusal,
                          UnitsText({std::begin(kUnitIds), std::end(kUnitIds)})),
              "set robot.unit_id to that of the controller behind the gateway"};
    }
    if (answer.exception == 1) {
      for (const RegisterTable other : kTables) {
        if (other == block.table || !client.Read(unit, {other, block.first, 1}).ok()) continue;
        return {fmt::format("function {} is unknown to the device, function {} is answered",
                            static_cast<int>(block.table), static_cast<int>(other)),
                fmt::format("set table = \"{}\" in the profile", NameOf(other))};
      }
      return {refusal,
              "use another table in the profile: function 3 reads \"holding\", 4 \"input\""};
    }
    if (answer.exception != 2 && answer.exception != 3)
      return {refusal, "see the controller's log"};
    const std::string request =
        fmt::format("exception 0x{:02X} at {} x {}", answer.exception, block.first, block.count);
    SurveyOptions options;
    int max_count = kMaxRegistersOfRead;
    TableSurvey table(client, options, unit, block.table, max_count,
                      std::numeric_limits<double>::infinity());
    const int answered = table.Prefix(block.first, block.count);
    if (answered == 0) {
      return {
          fmt::format("{}: register {} is missing", request, block.first),
          "check the addresses of the profile (a manual's 40001 is 0 here); plumbline registers "
          "scan shows which registers the device has"};
    }
    const int next = block.first + answered;
    const bool there = client.Read(unit, {block.table, next, 1}).ok() ||
                       client.Read(unit, {block.table, next, 2}).ok();
    if (there) {
      return {fmt::format("{}: a request of {} registers is refused, {} are answered", request,
                          block.count, answered),
              fmt::format("split [[read]] into requests of at most {} registers", answered)};
    }
    return {fmt::format("{}: the first missing register is {}", request, next),
            fmt::format("shorten [[read]] to the registers in use, or split it, so that none "
                        "contains {}",
                        next)};
  }
  return {};
}

}  // namespace plumbline::robot
