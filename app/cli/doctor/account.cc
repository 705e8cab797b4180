#include "app/cli/doctor/account.h"

#include <fmt/format.h>
#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

namespace plumbline::cli {
namespace {

constexpr mode_t kRead = 4, kWrite = 2, kSearch = 1;

bool Allows(const struct stat& file, const Account& account, mode_t wanted) {
  if (account.user == 0) return true;
  const bool in_group =
      std::find(account.groups.begin(), account.groups.end(), file.st_gid) != account.groups.end();
  const unsigned shift = file.st_uid == account.user ? 6 : in_group ? 3 : 0;
  return ((file.st_mode >> shift) & wanted) == wanted;
}

std::string OwnerText(const struct stat& file) {
  const passwd* const user = getpwuid(file.st_uid);
  const group* const of_group = getgrgid(file.st_gid);
  return fmt::format("{}:{} {:03o}", user != nullptr ? user->pw_name : std::to_string(file.st_uid),
                     of_group != nullptr ? of_group->gr_name : std::to_string(file.st_gid),
                     file.st_mode & 0777);
}

}  // namespace

Account AccountByName(const std::string& name) {
  const passwd* found = getpwnam(name.c_str());
  if (found == nullptr) found = getpwuid(geteuid());
  if (found == nullptr) return {std::to_string(geteuid()), geteuid(), {getegid()}};
  Account account{found->pw_name, found->pw_uid, {}};
  int count = 64;
  account.groups.resize(static_cast<std::size_t>(count));
  if (getgrouplist(found->pw_name, found->pw_gid, account.groups.data(), &count) < 0) {
    account.groups.resize(static_cast<std::size_t>(count));
    getgrouplist(found->pw_name, found->pw_gid, account.groups.data(), &count);
  }
  account.groups.resize(static_cast<std::size_t>(count));
  return account;
}

std::string AccessProblem(const Account& account, const std::string& path, bool write) {
  std::error_code unknown;
  const std::filesystem::path place = std::filesystem::weakly_canonical(path, unknown);
  std::filesystem::path above;
  for (const std::filesystem::path& part : place.parent_path()) {
    above /= part;
    struct stat folder {};
    if (stat(above.c_str(), &folder) != 0) {
      return fmt::format("{}: {}", above.string(), std::strerror(errno));
    }
    if (!Allows(folder, account, kSearch)) {
      return fmt::format("{} ({}) may not be entered by {}", above.string(), OwnerText(folder),
                         account.name);
    }
  }
  struct stat file {};
  if (stat(place.c_str(), &file) != 0) {
    return fmt::format("{}: {}", place.string(), std::strerror(errno));
  }
  if (!Allows(file, account, write ? kRead | kWrite : kRead)) {
    return fmt::format("{} ({}) may not be {} by {}", place.string(), OwnerText(file),
                       write ? "read and written" : "read", account.name);
  }
  return {};
}

}  // namespace plumbline::cli
