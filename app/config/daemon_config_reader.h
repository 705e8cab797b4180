// plumbline.toml, and the cell and robot profile that it names -> DaemonConfig.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "app/config/daemon_config.h"
#include "app/config/fault.h"
#include "app/config/posture_check.h"
#include "firmware-like/result.h"

namespace plumbline {

/// Where an installed plumbline has its ready cells and profiles: share/plumbline beside the folder
/// of the running program, else where the build would install it.
std::string InstalledDataDirectory();

/// The content of a file by its path; ReadTextFile, or a test's own.
using FileSource = std::function<Result<std::string>(const std::string& path)>;

/// Reads a configuration by its text. config/plumbline.toml documents every key, its default and
/// its range.
///
/// A relative path in it is looked for beside the configuration file, then in `data_directory`.
/// A profile or cell that is only a name ("ur10") stands for cells/ur10.toml or profiles/....
///
/// @param file      path of the configuration, used in faults and to find the other files
/// @param faults    gets the faults and warnings of all three files, each with its own place
/// @param postures  of how many points the posture is checked, as of WarnOfUnlikelyPostures(): a
///                  thread that is watched cannot wait for a thousand
/// @return          the configuration; nothing where any of the three has a fault
std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files,
                                                 const std::string& data_directory,
                                                 FaultList& faults,
                                                 std::size_t postures = kEveryPosture);

/// The same with the installed data directory.
std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 const FileSource& files, FaultList& faults,
                                                 std::size_t postures = kEveryPosture);

/// The same with the files of this machine and the installed data directory.
std::optional<DaemonConfig> DaemonConfigFromText(std::string_view text, const std::string& file,
                                                 FaultList& faults,
                                                 std::size_t postures = kEveryPosture);

/// DaemonConfigFromText of a file's content; a file that cannot be read is a fault.
std::optional<DaemonConfig> ReadDaemonConfig(const std::string& path, FaultList& faults,
                                             std::size_t postures = kEveryPosture);

}  // namespace plumbline
