// Fingerprint of a cell file, which binds a validated radius to the model that was validated.
#pragma once

#include <string>

#include "app/config/toml_reader.h"

namespace plumbline {

/// 64-bit FNV-1a hash, as 16 hex digits, over every key and value of a parsed cell file, except
/// what changes no prediction (`robot.name`, `from` of an [[effect]]) and `[domain] fingerprint`
/// itself. Comments, blank lines, the order of keys and the spelling of numbers do not change it;
/// the order of tables in a list does. It protects against mistakes, not against forgery.
///
/// The values are hashed as the file states them, not as a CellModel holds them: conversion to SI
/// may differ in its last bit from computer to computer, and a later version with more defaults
/// would disown every model written before. A default that is written out thus changes it.
std::string ModelFingerprint(const TomlDocument& document);

}  // namespace plumbline
