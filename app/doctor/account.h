// Whose rights count: the service runs as its own user, the doctor mostly does not.
#pragma once

#include <sys/types.h>

#include <string>
#include <vector>

namespace plumbline {

struct Account {
  std::string name;
  uid_t user = 0;
  std::vector<gid_t> groups;
};

/// The user of that name, or who runs this where there is none.
Account AccountOf(const std::string& name);

/// What keeps `account` from reading (and writing) `path`, by the modes of the file and of the
/// folders above it; empty: nothing. Access lists and security modules are not looked at.
std::string WhyNoAccess(const Account& account, const std::string& path, bool write);

}  // namespace plumbline
