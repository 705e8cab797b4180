// Fingerprint of a cell file: binds a validated radius to the model that was validated.
#pragma once

#include <string>

#include "app/base/config/toml_reader.h"

namespace plumbline::config {

/// 64-bit FNV-1a hash, as 16 hex digits, over every key and value of a parsed cell file, except
/// those that do not affect predictions (name, model, series and installation date
/// of the robot, `from` of an [[effect]]) and `[domain] fingerprint` itself. Comments, blank lines,
/// the order of keys and the notation of numbers do not change it; the order of tables in a list
/// does. It protects against mistakes, not against forgery.
///
/// The values are hashed as written in the file, not as stored in a CellModel: the conversion to SI
/// may differ in the last bit between computers, and a later version with additional defaults would
/// invalidate every existing model. Writing out a default therefore changes the fingerprint.
std::string ModelFingerprint(const TomlDocument& document);

}  // namespace plumbline::config
