// Web page configuration of plumbline-view, [page] of plumbline.toml.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace plumbline::config {

class TomlTable;

struct PageConfig {
  std::string listen = "127.0.0.1";  ///< IP address of this computer
  std::optional<int> port;           ///< 0 for any free port; nullopt for a socket of systemd only
  std::string token;                 ///< required from every browser; empty: local access only
  std::vector<std::string> hosts;    ///< further accepted host names, in lower case

  bool operator==(const PageConfig&) const = default;
};

/// True for a loopback address, which only this computer can reach.
bool IsLoopback(const std::string& address);
/// True for the wildcard address (0.0.0.0 or ::), which means all addresses of this computer.
bool IsWildcardAddress(const std::string& address);

/// Address by which other computers reach the page; empty if they do not, or if its port is not
/// fixed.
/// @param own_name  name of this computer, for a page that listens on all addresses
std::string PageUrl(const PageConfig& page, const std::string& own_name);

PageConfig PageFromToml(const TomlTable& table);

}  // namespace plumbline::config
