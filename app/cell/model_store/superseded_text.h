// Text about an applied model that is no longer in force.
#pragma once

#include <string>
#include <vector>

#include "app/cell/model_store/model_store.h"

namespace plumbline::cell {

/// The first texts, followed by the number of the others.
std::vector<std::string> Abbreviated(std::vector<std::string> texts, std::size_t max_count);

/// Why the applied model is not in force, what that means and what to do, as a paragraph.
/// @param state  must have set_aside
std::string SupersededText(const ModelState& state, const std::string& state_directory);

}  // namespace plumbline::cell
