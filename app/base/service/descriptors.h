// Limit on the open files and sockets of this process.
#pragma once

namespace plumbline::service {

/// Raises the soft limit to `wanted`, or to the hard limit if that is lower. Never lowers it.
/// @return  the limit now in effect
int RaiseDescriptorLimit(int wanted);

}  // namespace plumbline::service
