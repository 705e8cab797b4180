// Output of `plumbline model list` and `show`: versions of the cell's model and their facts.
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <string>
#include <vector>

#include "app/model_store/model_store.h"

namespace plumbline::cli {

nlohmann::json VersionJson(const model_store::ModelVersion& version,
                           const model_store::ModelState& state);

/// Table with one line for each version.
void PrintVersions(const std::vector<model_store::ModelVersion>& versions,
                   const model_store::ModelState& state, std::ostream& out);

/// The facts of a version, as comments that may precede its text.
void PrintVersion(const model_store::ModelVersion& version, const model_store::ModelState& state,
                  const std::string& report_file, std::ostream& out);

/// Explains why an applied version is not in force, and lists the keys that changed.
void PrintSetAside(const model_store::ModelState& state, const std::string& state_directory,
                   std::ostream& out);

}  // namespace plumbline::cli
