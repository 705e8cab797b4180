// Rights at the plant's broker: user names, access list and passwords for mosquitto.
#pragma once

#include <compare>
#include <string>
#include <string_view>
#include <vector>

#include "firmware-like/result.h"

namespace plumbline::plant {

/// A cell as its topics name it: plumblineV1/GROUP/TYPE/NODE.
struct CellUser {
  std::string group, node;
  auto operator<=>(const CellUser&) const = default;
};

/// From "GROUP/NODE". @return  or what is wrong with it, and how to write it
Result<CellUser> CellUserFrom(std::string_view text);
/// User name, and client id, of a cell: "GROUP/NODE".
std::string UserOf(const CellUser& cell);

/// Whether the broker that is bridged to the plant's, for all cells of a group, may have this name.
/// @return  or what is wrong with it
Result<void> CheckGroup(std::string_view group);
/// User name, and client id, of such a broker: "bridge-GROUP".
std::string BridgeUserOf(const std::string& group);

/// Access list of the cells' listener: each cell writes its own topics, each bridge those of its
/// group, and nobody reads anything.
std::string AclText(std::vector<CellUser> cells, std::vector<std::string> bridged_groups = {});

/// 12 random bytes, as mosquitto_passwd uses.
std::string RandomSalt();

/// Line of mosquitto's password file, as mosquitto_passwd writes it: "USER:$7$ITERATIONS$SALT$HASH"
/// with PBKDF2-HMAC-SHA512. Few iterations suffice for a random password (config::GeneratedToken),
/// and the broker computes them at each connection.
Result<std::string> PasswordLine(const std::string& user, const std::string& password,
                                 const std::string& salt = RandomSalt(), int iterations = 101);

/// The content of a password file with this line, in place of the user's previous one if any.
std::string WithPasswordLine(std::string_view file, const std::string& line);
/// The content without the user.
std::string WithoutUser(std::string_view file, std::string_view user);

/// The users of a password file: the access list is written from them.
struct BrokerUsers {
  std::vector<CellUser> cells;
  std::vector<std::string> bridged_groups;
  std::vector<std::string> others;  ///< neither: the access list gives them nothing
};
BrokerUsers UsersIn(std::string_view password_file);

}  // namespace plumbline::plant
