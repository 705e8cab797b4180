// Reader of plumbline.toml together with the cell, robot profile and other files it refers to.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "app/base/config/daemon_config.h"
#include "app/base/config/fault.h"
#include "app/base/config/posture_check.h"
#include "firmware-like/result.h"

namespace plumbline::config {

/// Directory of the installed cells and profiles: ../share/plumbline relative to the running
/// program's directory, else the installation prefix of the build.
std::string InstalledDataDirectory();

/// Returns the content of a file; files::ReadTextFile() in production, replaceable in tests.
using FileSource = std::function<Result<std::string>(const std::string& path)>;

/// Parses a configuration and the files it refers to. config/plumbline.toml documents every key
/// with its default and range.
///
/// A relative path is resolved in the directory of the configuration file, then in
/// `data_directory`. A bare name ("ur10") of a cell or profile means cells/ur10.toml or
/// profiles/ur10.toml.
///
/// @param file      path of the configuration, used in faults and to resolve relative paths
/// @param faults    receives the faults and warnings of all files, each with file and line
/// @param postures  largest number of points whose posture is checked, see
///                  WarnAboutUnlikelyPostures(); a thread under watchdog supervision must limit it
/// @return          the configuration, or nullopt if any of the files has a fault
std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files,
                                                 const std::string& data_directory,
                                                 FaultList& faults,
                                                 std::size_t postures = kAllPostures);

/// The same with the installed data directory.
std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files, FaultList& faults,
                                                 std::size_t postures = kAllPostures);

/// The same with the file system and the installed data directory.
std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 FaultList& faults,
                                                 std::size_t postures = kAllPostures);

/// DaemonConfigFromText() on the content of a file; a file that cannot be read is a fault.
std::optional<DaemonConfig> ReadDaemonConfig(const std::string& path, FaultList& faults,
                                             std::size_t postures = kAllPostures);

}  // namespace plumbline::config
