// Benchmarks that use the tests' fixtures, whose checks need a running Catch session. Define
// CATCH_CONFIG_RUNNER before the first include, and write the benchmark as a TEST_CASE.
#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "tests/bench/rows.h"

namespace plumbline::bench {

/// Of this run.
inline Effort effort = Effort::kWhole;
/// Value of `--NAME VALUE`; 0 without it.
inline double ArgumentOf(int argc, char** argv, const std::string& name) {
  for (int k = 1; k + 1 < argc; ++k) {
    if (argv[k] == "--" + name) return std::strtod(argv[k + 1], nullptr);
  }
  return 0;
}

inline int RunBenchmark(int argc, char** argv) {
  effort = EffortFrom(argc, argv);
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  char* const name_alone[] = {argv[0], nullptr};
  return Catch::Session().run(1, name_alone);
}

}  // namespace plumbline::bench
