// SHA-256 digest of a text, for identifying the files of a report.
#pragma once

#include <string>
#include <string_view>

namespace plumbline::text {

/// The digest of FIPS 180-4 as 64 hexadecimal digits; empty if the library refuses to compute it.
std::string Sha256Hex(std::string_view bytes);

}  // namespace plumbline::text
