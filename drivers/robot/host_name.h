// Host name resolution, to distinguish an unknown name from a host that does not answer.
#pragma once

#include <string>

namespace plumbline::robot {

/// Reason why `host` (a name or an address) cannot be resolved, a static string; nullptr if it can.
/// May block on a name server.
const char* ResolveFailure(const std::string& host);

/// True if `host` is a numeric address, so that no name server is needed.
bool IsAddress(const std::string& host);

}  // namespace plumbline::robot
