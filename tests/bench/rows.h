// Rows of the benchmark table: printed, and appended as JSON to the file $PLUMBLINE_BENCH_ROWS.
// tests/bench/run makes the table from them; see tests/README.md.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <string>
#include <string_view>

namespace plumbline::bench {

/// How long a benchmark measures. kSmoke: seconds, only to see that it runs; nothing is judged.
enum class Effort { kSmoke, kQuick, kWhole };

/// From --smoke or --quick, anywhere among the arguments.
inline Effort EffortFrom(int argc, char** argv) {
  for (int k = 1; k < argc; ++k) {
    if (std::string_view(argv[k]) == "--smoke") return Effort::kSmoke;
    if (std::string_view(argv[k]) == "--quick") return Effort::kQuick;
  }
  return Effort::kWhole;
}

template <typename T>
T Choose(Effort effort, T smoke, T quick, T whole) {
  return effort == Effort::kSmoke ? smoke : effort == Effort::kQuick ? quick : whole;
}

/// Bound of our value, or of its ratio to the peer's.
struct Goal {
  const char* of = "";     ///< "ours", "ratio"; empty: no goal
  const char* sense = "";  ///< "<=", ">="
  double bound = 0;
};
inline Goal AtMost(double bound) {
  return {"ours", "<=", bound};
}
inline Goal RatioAtMost(double bound) {
  return {"ratio", "<=", bound};
}
inline Goal RatioAtLeast(double bound) {
  return {"ratio", ">=", bound};
}

struct Row {
  std::string what;
  double ours = 0;
  std::string unit = {};
  Goal goal = {};
  /// Another program or library, or the physical limit; never a variant of our own code. Empty: the
  /// row is listed apart.
  std::string peer = {};
  double peers = std::numeric_limits<double>::quiet_NaN();  ///< its value, in the same unit
  bool timed = true;  ///< changes with the load of the machine: not judged on a loaded one
};

namespace internal {

inline std::string Quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c == '\n' || c == '\t' ? ' ' : c;
  }
  return quoted + "\"";
}

inline std::string Number(double value) {
  return std::isfinite(value) ? fmt::format("{:.9g}", value) : "null";
}

inline void Append(const std::string& line) {
  const char* const file = std::getenv("PLUMBLINE_BENCH_ROWS");
  if (file != nullptr) std::ofstream(file, std::ios::app) << line << "\n";
}

}  // namespace internal

/// A value that is not finite is an error, which the runner reports.
inline void Report(const Row& row) {
  using internal::Number, internal::Quoted;
  fmt::print("> {}: {:.4g} {}", row.what, row.ours, row.unit);
  if (!row.peer.empty()) {
    fmt::print("; {}: {:.4g} {}, ratio {:.3g}", row.peer, row.peers, row.unit,
               row.ours / row.peers);
  }
  if (*row.goal.of != '\0') {
    fmt::print("; goal: {} {} {:g}", row.goal.of, row.goal.sense, row.goal.bound);
  }
  fmt::print("\n");
  internal::Append(fmt::format(
      R"({{"what": {}, "ours": {}, "unit": {}, "of": {}, "sense": {}, "bound": {}, "peer": {}, "peers": {}, "timed": {}}})",
      Quoted(row.what), Number(row.ours), Quoted(row.unit), Quoted(row.goal.of),
      Quoted(row.goal.sense), Number(row.goal.bound), Quoted(row.peer), Number(row.peers),
      row.timed));
}

/// What cannot be measured here, and why.
inline void ReportSkipped(const std::string& what, const std::string& reason) {
  fmt::print("SKIPPED: {}: {}\n", what, reason);
  internal::Append(fmt::format(R"({{"what": {}, "skipped": {}}})", internal::Quoted(what),
                               internal::Quoted(reason)));
}

}  // namespace plumbline::bench
