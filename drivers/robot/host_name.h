// Whether a host has an address, told apart from a host that does not answer.
#pragma once

#include <string>

namespace plumbline {

/// Why `host` (a name or an address) leads to no address, in words that last; null where it does.
/// May wait for a name server.
const char* WhyUnresolved(const std::string& host);

/// Whether `host` is an address already, so that no name server is asked.
bool IsAddress(const std::string& host);

}  // namespace plumbline
