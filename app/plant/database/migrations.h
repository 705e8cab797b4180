// SQL of the plant's schema, version by version.
#pragma once

#include <span>

namespace plumbline::plant {

/// Element k brings version k to version k + 1. A released one is never changed: tests/app/plant
/// keeps a database of each version.
std::span<const char* const> Migrations();

/// Roles and grants of the newest version; may be run again.
extern const char* const kRights;

}  // namespace plumbline::plant
