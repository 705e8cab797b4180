#include "app/daemon/boot_session.h"

#include <fstream>

namespace plumbline {

std::string SessionOfBoot(const std::string& session) {
  constexpr std::size_t kDigits = 8;
  std::string id;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
  if (id.size() < kDigits) return session;
  return session + (session.empty() ? "boot " : " boot ") + id.substr(0, kDigits);
}

}  // namespace plumbline
