// [page] of plumbline.toml: to whom plumbline-view shows itself over HTTP.
#pragma once

#include <optional>
#include <string>
#include <vector>

namespace plumbline {

class TomlTable;

struct PageConfig {
  std::string listen = "127.0.0.1";  ///< an address of this computer
  std::optional<int> port;           ///< 0: any free one; nothing: no page but by a socket unit
  std::string token;                 ///< asked of everybody; empty: only this computer may look
  std::vector<std::string> hosts;    ///< names by which browsers reach it, in small letters

  bool operator==(const PageConfig&) const = default;
};

/// Why a token can be guessed: shorter than 128 random bits, a pattern, or the one of an old
/// manual; with how to make one. Nothing where it cannot. Never repeats the token.
std::optional<std::string> WhyTokenWeak(const std::string& token);

/// An address that only this computer reaches.
bool IsLoopback(const std::string& address);
/// One that stands for all of this computer's.
bool IsEveryAddress(const std::string& address);

PageConfig PageFromToml(const TomlTable& table);

}  // namespace plumbline
