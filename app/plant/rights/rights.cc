#include "app/plant/rights/rights.h"

#include <fmt/format.h>
#include <openssl/evp.h>
#include <sys/random.h>

#include <algorithm>

#include "app/base/config/mqtt_config.h"

namespace plumbline::plant {
namespace {

constexpr std::size_t kSaltBytes = 12, kHashBytes = 64;
constexpr std::string_view kBridgePrefix = "bridge-";

std::string Base64(const unsigned char* bytes, std::size_t size) {
  std::string text(4 * ((size + 2) / 3) + 1, '\0');
  EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), bytes, static_cast<int>(size));
  text.pop_back();  // the terminating zero
  return text;
}

/// A level of the topic that can also be written to the access list and the password file, where a
/// colon ends the user and outer spaces are lost.
bool IsName(std::string_view name) {
  return config::IsTopicLevel(name) && name.find(':') == std::string_view::npos &&
         name.front() != ' ' && name.back() != ' ';
}

std::string NameProblem(std::string_view what, std::string_view name) {
  return fmt::format(
      "\"{}\" cannot be the name of a {}: write 1 to {} characters without / + # : and without "
      "spaces at the ends",
      name, what, config::kMaxTopicLevel);
}

std::string_view UserOfLine(std::string_view line) {
  return line.substr(0, line.find(':'));
}

template <typename Visit>
void ForEachLine(std::string_view text, Visit visit) {
  while (!text.empty()) {
    const auto end = std::min(text.find('\n'), text.size());
    if (end > 0) visit(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

}  // namespace

Result<CellUser> CellUserFrom(std::string_view text) {
  const auto slash = text.find('/');
  if (slash == std::string_view::npos) {
    return Error{fmt::format(
        "\"{}\" is not GROUP/NODE, the group and node of [mqtt] in the cell's plumbline.toml",
        text)};
  }
  const std::string_view group = text.substr(0, slash), node = text.substr(slash + 1);
  if (!IsName(group)) return Error{NameProblem("group", group)};
  if (!IsName(node)) return Error{NameProblem("node", node)};
  return CellUser{std::string(group), std::string(node)};
}

std::string UserOf(const CellUser& cell) {
  return cell.group + "/" + cell.node;
}

Result<void> CheckGroup(std::string_view group) {
  if (!IsName(group)) return Error{NameProblem("group", group)};
  return {};
}

std::string BridgeUserOf(const std::string& group) {
  return std::string(kBridgePrefix) + group;
}

std::string AclText(std::vector<CellUser> cells, std::vector<std::string> bridged_groups) {
  std::sort(cells.begin(), cells.end());
  std::sort(bridged_groups.begin(), bridged_groups.end());
  std::string text =
      "# Written by plumbline from the users of the password file beside it; changes are lost.\n"
      "# Each cell writes its own topics, and nobody reads.\n";
  for (const CellUser& cell : cells) {
    text += fmt::format("\nuser {}\ntopic write plumblineV1/{}/+/{}\n", UserOf(cell), cell.group,
                        cell.node);
  }
  for (const std::string& group : bridged_groups) {
    text += fmt::format("\nuser {}\ntopic write plumblineV1/{}/+/+\n", BridgeUserOf(group), group);
  }
  return text;
}

std::string RandomSalt() {
  std::string salt(kSaltBytes, '\0');
  // Never interrupted or short for so few bytes, once the kernel's generator is initialised.
  while (getrandom(salt.data(), salt.size(), 0) != static_cast<ssize_t>(salt.size())) {
  }
  return salt;
}

Result<std::string> PasswordLine(const std::string& user, const std::string& password,
                                 const std::string& salt, int iterations) {
  unsigned char hash[kHashBytes];
  const auto* const salt_bytes = reinterpret_cast<const unsigned char*>(salt.data());
  if (PKCS5_PBKDF2_HMAC(password.data(), static_cast<int>(password.size()), salt_bytes,
                        static_cast<int>(salt.size()), iterations, EVP_sha512(), kHashBytes,
                        hash) != 1) {
    return Error{"the password cannot be hashed: OpenSSL lacks PBKDF2 with SHA-512"};
  }
  return fmt::format("{}:$7${}${}${}", user, iterations, Base64(salt_bytes, salt.size()),
                     Base64(hash, kHashBytes));
}

std::string WithoutUser(std::string_view file, std::string_view user) {
  std::string text;
  ForEachLine(file, [&](std::string_view line) {
    if (UserOfLine(line) != user) text.append(line) += '\n';
  });
  return text;
}

std::string WithPasswordLine(std::string_view file, const std::string& line) {
  return WithoutUser(file, UserOfLine(line)) + line + "\n";
}

BrokerUsers UsersIn(std::string_view password_file) {
  BrokerUsers users;
  ForEachLine(password_file, [&](std::string_view line) {
    const std::string_view user = UserOfLine(line);
    const std::string_view group = user.substr(std::min(kBridgePrefix.size(), user.size()));
    if (auto cell = CellUserFrom(user)) {
      users.cells.push_back(std::move(cell).value());
    } else if (user.starts_with(kBridgePrefix) && IsName(group)) {
      users.bridged_groups.emplace_back(group);
    } else {
      users.others.emplace_back(user);
    }
  });
  return users;
}

}  // namespace plumbline::plant
