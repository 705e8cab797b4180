#include "drivers/files/open_failure.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <system_error>

namespace plumbline::files {
namespace {

namespace fs = std::filesystem;

using NameBuffer = std::array<char, 4096>;  // for the reentrant account functions

std::string ReasonOf(int error) {
  return std::generic_category().message(error);
}

std::string UserName(uid_t user) {
  NameBuffer buffer;
  passwd entry{};
  passwd* found = nullptr;
  getpwuid_r(user, &entry, buffer.data(), buffer.size(), &found);
  return found != nullptr ? found->pw_name : std::to_string(user);
}

std::string GroupName(gid_t id) {
  NameBuffer buffer;
  group entry{};
  group* found = nullptr;
  getgrgid_r(id, &entry, buffer.data(), buffer.size(), &found);
  return found != nullptr ? found->gr_name : std::to_string(id);
}

std::string JoinGroup(const std::string& user, const std::string& group) {
  return fmt::format("sudo usermod -aG {} {}, then log in again", group, user);
}

bool Allowed(const fs::path& place, int wanted) {
  return faccessat(AT_FDCWD, place.c_str(), wanted, AT_EACCESS) == 0;
}

/// Remedy for missing permissions on `place`: its owner and mode, and how to get access.
std::string PermissionRemedy(const fs::path& place, int wanted) {
  struct stat about {};
  const std::string user = UserName(geteuid());
  const char* action = (wanted & W_OK) != 0 ? "written" : (wanted & R_OK) != 0 ? "read" : "entered";
  if (stat(place.c_str(), &about) != 0) return fmt::format("; user {} has no access to it", user);
  const std::string group = GroupName(about.st_gid);
  const auto bits = static_cast<mode_t>(wanted) << 3;  // R_OK, W_OK, X_OK are the bits of a mode
  const bool by_group = about.st_gid != 0 && (about.st_mode & bits) == bits;
  return fmt::format("; {} ({}:{} {:03o}) may not be {} by user {}: {}, or use sudo",
                     place.string(), UserName(about.st_uid), group, about.st_mode & 0777, action,
                     user, by_group ? JoinGroup(user, group) : "change its mode or owner");
}

/// Absolute path, so that a remedy does not depend on the current directory.
fs::path Absolute(const std::string& path) {
  std::error_code unknown;
  fs::path absolute = fs::absolute(path, unknown).lexically_normal();
  return unknown ? fs::path(path) : absolute;
}

/// Remedy for a parent of `place` that is missing, is not a folder, or is inaccessible to this
/// user.
std::string FolderRemedy(const fs::path& place) {
  fs::path folder;
  std::error_code unknown;
  for (const fs::path& part : place.parent_path()) {
    folder /= part;
    const fs::file_status status = fs::status(folder, unknown);
    if (status.type() == fs::file_type::not_found) {
      return fmt::format("; there is no folder {}: check the path", folder.string());
    }
    if (fs::exists(status) && !fs::is_directory(status)) {
      return fmt::format("; {} is not a folder: check the path", folder.string());
    }
    if (!Allowed(folder, X_OK)) return PermissionRemedy(folder, X_OK);
  }
  return "";
}

}  // namespace

std::string ReadRemedy(const std::string& path) {
  const fs::path place = Absolute(path);
  if (path.empty()) return "; give a path";
  if (std::string remedy = FolderRemedy(place); !remedy.empty()) return remedy;
  std::error_code unknown;
  const fs::file_status status = fs::status(place, unknown);
  if (status.type() == fs::file_type::not_found) {
    if (fs::is_symlink(place, unknown)) {
      return fmt::format("; it is a link to {}, which does not exist",
                         fs::read_symlink(place, unknown).string());
    }
    return fmt::format("; check the name: ls {}", place.parent_path().string());
  }
  if (!Allowed(place, R_OK)) return PermissionRemedy(place, R_OK);
  return "";
}

std::string WriteRemedy(const std::string& path) {
  const fs::path place = Absolute(path);
  if (path.empty()) return "; give a path";
  if (std::string remedy = FolderRemedy(place); !remedy.empty()) return remedy;
  std::error_code unknown;
  if (fs::is_directory(place, unknown)) return "; it is a folder: name a file in it";
  for (const fs::path& target : {place, place.parent_path()}) {
    if (!fs::exists(target, unknown) || Allowed(target, W_OK)) continue;
    if (errno == EROFS) return "; its file system is mounted read-only: see mount";
    if (errno == EACCES) return PermissionRemedy(target, W_OK);
  }
  const fs::space_info space = fs::space(place.parent_path(), unknown);
  if (!unknown && space.available == 0) return "; the disk is full: free space (df -h)";
  return "";
}

std::string ReadErrorText(const std::string& path, std::string_view reason) {
  std::string remedy = ReadRemedy(path);
  if (reason == ReasonOf(EISDIR)) remedy = "; it is a folder: name a file in it";
  if (reason == ReasonOf(ENOTDIR) && remedy.empty()) remedy = "; it is not a folder: name a folder";
  if (reason == ReasonOf(EIO)) remedy = "; the disk or share reports an error: see journalctl -k";
  return fmt::format("cannot be read: {}{}", reason, remedy);
}

std::string WriteErrorText(const std::string& path, std::string_view reason) {
  std::string remedy = WriteRemedy(path);
  if (reason == ReasonOf(ENOSPC)) remedy = "; the disk is full: free space (df -h)";
  if (reason == ReasonOf(EIO)) remedy = "; the disk or share reports an error: see journalctl -k";
  return fmt::format("cannot be written: {}{}", reason, remedy);
}

std::string OpenErrorText(int error, const DeviceKind& kind) {
  std::string remedy;
  switch (error) {
    case ENOENT:
    case ENOTDIR:
    case ENXIO:
    case ENODEV:
      remedy = kind.if_absent;
      break;
    case EACCES:
    case EPERM: {
      const std::string user = UserName(geteuid());
      remedy = fmt::format("user {} must be in the group {}: {}", user, kind.group,
                           JoinGroup(user, kind.group));
      break;
    }
    case EBUSY:
      remedy = "another program uses it: close that program";
      break;
    case ENOTTY:
    case EINVAL:
    case EISDIR:
      remedy = kind.if_wrong;
      break;
    case EIO:
      remedy = "the device reports an error: unplug it and plug it in again";
      break;
    default:
      remedy = "see journalctl -k";
      break;
  }
  return fmt::format("cannot be opened: {}; {}", ReasonOf(error), remedy);
}

}  // namespace plumbline::files
