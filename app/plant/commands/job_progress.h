// What the commands on jobs have in common: options, output files, and the wait for jobs.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "app/plant/database/connection.h"

namespace plumbline::plant {

/// Prints the reason. @return  kExitFault
int FailCommand(std::string_view reason);

/// Writes a file, or standard output for "-"; prints the reason on failure.
/// @param option  that names the file
bool WriteCommandOutput(const std::string& path, std::string_view text, std::string_view option);

/// Adds an option that takes a UTC time, "2026-11-21T07:30:00Z", or a date for its beginning.
void AddUtcOption(CLI::App& command, const char* name, std::string& value, const char* help);

/// Prints cells that take no part, each with the reason.
void PrintLeftOut(const std::vector<std::string>& left_out);

/// Waits until workers have ended all of these jobs; prints progress, and how to start a worker if
/// none takes them. Interrupting it loses nothing.
/// @param what  the jobs, "diagnoses"
Result<void> AwaitJobs(Connection& connection, const std::vector<std::int64_t>& jobs,
                       const std::string& what);

}  // namespace plumbline::plant
