// Output of `plumbline model list` and `show`: versions of the cell's model and their facts.
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "app/cell/model_store/model_store.h"

namespace plumbline::cli {

nlohmann::json VersionJson(const cell::ModelVersion& version, const cell::ModelState& state);

/// Table with one line for each version.
void PrintVersions(const std::vector<cell::ModelVersion>& versions, const cell::ModelState& state,
                   std::ostream& out);

/// The facts of a version, as comments that may precede its text.
void PrintVersion(const cell::ModelVersion& version, const cell::ModelState& state,
                  const std::string& report_file, std::ostream& out);

/// Explains why an applied version is not in force, and lists the keys that changed.
void PrintSetAside(const cell::ModelState& state, const std::string& state_directory,
                   std::ostream& out);

}  // namespace plumbline::cli
