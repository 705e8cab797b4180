// How a command finds the daemon of a state directory.
#pragma once

#include <string>

#include "app/model_store/durable_file.h"

namespace plumbline {

/// Taken by the daemon for its whole life: `daemon.pid` in the state directory, locked, with the
/// process id in it. An old file without a lock means nothing.
/// @return the lock, or why another daemon has it
Result<FileLock> AnnounceDaemon(const std::string& state_directory);

enum class Notified { kYes, kNoDaemon };
/// Sends SIGHUP to the daemon of that directory. @return whether there is one, or why it could not
/// be told (another user's)
Result<Notified> NotifyDaemon(const std::string& state_directory);

}  // namespace plumbline
