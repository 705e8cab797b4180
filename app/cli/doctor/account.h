// User account of the service, whose file permissions are checked instead of the caller's.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace plumbline::cli {

struct Account {
  std::string name;
  uid_t user = 0;
  std::vector<gid_t> groups;
};

/// The account of that name; if there is none, that of the calling user.
Account AccountByName(const std::string& name);

/// The reason why `account` may not read (and write) `path`, from the modes of the file and its
/// parent directories; empty if it may. Ignores access control lists and security modules.
std::string AccessProblem(const Account& account, const std::string& path, bool write);

}  // namespace plumbline::cli
