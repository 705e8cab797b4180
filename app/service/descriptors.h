// How many files and sockets this process may have open.
#pragma once

namespace plumbline {

/// Raises the soft limit to `wanted` where it is lower and the hard limit allows it.
/// @return  the limit now in force
int RaiseDescriptorLimit(int wanted);

}  // namespace plumbline
