// Tolerant scans of XML, JSON, YAML and TOML to named values.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/base/recognition/outline.h"

namespace plumbline::recognition {

/// What a scan found.
struct Scan {
  std::vector<Entry> entries;
  std::string open_at_end;
  std::size_t end = std::string::npos;  ///< of the value in braces
};

// Names nested deeper than 32 are not entered. Values point into the text.

Scan ScanXml(std::string_view text);
/// JSON, and what resembles it: single quotes, comments, `=` for `:`, missing quotes.
Scan ScanBraces(std::string_view text);
/// YAML; the entries of all documents of a stream follow each other.
Scan ScanYaml(std::string_view text);
/// TOML and other files with [headers] and `key = value`.
Scan ScanToml(std::string_view text);

}  // namespace plumbline::recognition
