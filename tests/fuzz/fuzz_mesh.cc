// Fuzzer: arbitrary bytes as a mesh file of any format: the reading process may crash, its caller
// gets a validated mesh, a reason, or nothing. Inputs are parsed in a forked process that is
// restarted after a crash, because Coin and Assimp do crash; the test is that the caller is not
// affected.
#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <vector>

#include "app/cell/scene/mesh_parser.h"
#include "firmware-like/scene/mesh_facts.h"

namespace {

using namespace plumbline;

constexpr cell::MeshLimits kLimits{.triangles = 20'000};
constexpr int kPatience_ms = 5000;
constexpr suseconds_t kComputing_us = 50'000;  ///< some inputs keep Assimp busy forever
constexpr int kMaxInputs = 300;                ///< per process, because it leaks

bool Put(int to, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const char*>(data);
  while (size > 0) {
    const ssize_t wrote = send(to, bytes, size, MSG_NOSIGNAL);
    if (wrote <= 0) return false;
    bytes += wrote;
    size -= static_cast<std::size_t>(wrote);
  }
  return true;
}

bool Take(int from, void* data, std::size_t size) {
  auto* bytes = static_cast<char*>(data);
  while (size > 0) {
    pollfd readable{from, POLLIN, 0};
    if (poll(&readable, 1, kPatience_ms) <= 0) return false;
    const ssize_t got = read(from, bytes, size);
    if (got <= 0) return false;
    bytes += got;
    size -= static_cast<std::size_t>(got);
  }
  return true;
}

[[noreturn]] void ServeInChild(int link) {
  // Suppress the sanitizer report: crashes of these libraries are expected, and reporting is slow.
  for (const int end : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGPROF, SIGALRM}) {
    signal(end, SIG_DFL);
  }
  dup2(open("/dev/null", O_WRONLY), STDERR_FILENO);
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  for (;;) {
    std::array<std::uint32_t, 2> about{};
    std::vector<std::uint8_t> bytes;
    pollfd readable{link, POLLIN, 0};
    poll(&readable, 1, -1);
    if (!Take(link, about.data(), sizeof about)) _exit(0);
    bytes.resize(about[1]);
    if (!Take(link, bytes.data(), bytes.size())) _exit(0);
    const itimerval computing{{0, 0}, {0, kComputing_us}};
    setitimer(ITIMER_PROF, &computing, nullptr);
    const auto told = cell::EncodeMeshResponse(
        cell::ParseMesh(static_cast<cell::MeshFormat>(about[0]), bytes, kLimits.triangles));
    const std::uint64_t size = told.size();
    if (!Put(link, &size, sizeof size) || !Put(link, told.data(), told.size())) _exit(0);
  }
}

/// The parsing process, restarted after a crash.
class Reader {
 public:
  /// nullopt if the process died or did not answer.
  std::vector<std::uint8_t> Ask(cell::MeshFormat format, std::span<const std::uint8_t> bytes) {
    if (pid_ < 0) Start();
    const std::array<std::uint32_t, 2> about{static_cast<std::uint32_t>(format),
                                             static_cast<std::uint32_t>(bytes.size())};
    std::uint64_t size = 0;
    std::vector<std::uint8_t> answer;
    bool good = Put(link_, about.data(), sizeof about) && Put(link_, bytes.data(), bytes.size()) &&
                Take(link_, &size, sizeof size) && size <= cell::MaxMeshResponseBytes(kLimits);
    if (good) {
      answer.resize(size);
      good = Take(link_, answer.data(), size);
    }
    if (!good || ++inputs_ >= kMaxInputs) End();
    return good ? answer : std::vector<std::uint8_t>();
  }

 private:
  void Start() {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, ends.data()) != 0) std::abort();
    pid_ = fork();
    if (pid_ < 0) std::abort();
    if (pid_ == 0) {
      close(ends[0]);
      ServeInChild(ends[1]);
    }
    close(ends[1]);
    link_ = ends[0];
    inputs_ = 0;
  }
  void End() {
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    close(link_);
    pid_ = -1;
  }

  pid_t pid_ = -1;
  int link_ = -1, inputs_ = 0;
};

}  // namespace

/// Memory that Coin holds until exit.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libCoin\n";
}

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  cell::PrepareVrmlParser();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const auto format = static_cast<cell::MeshFormat>(data[0] % 6);
  const std::span bytes(data + 1, size - 1);
  cell::AnnouncedTriangles(format,
                           bytes);  // also in this process, where the fuzzer sees the coverage
  cell::IsTruncated(format, bytes);
  static Reader reader;
  const auto answer = cell::DecodeMeshResponse(reader.Ask(format, bytes), kLimits);
  if (!answer || !*answer) return 0;
  cell::RawMesh raw = answer->value();
  const auto checked = scene::CheckMesh(std::move(raw.mesh), 1e-3);
  if (!checked) return 0;
  for (const Vec3f& p : checked->mesh.vertices_O) {
    if (!p.allFinite()) std::abort();
  }
  for (const scene::Triangle& triangle : checked->mesh.triangles) {
    for (const std::uint32_t i : triangle) {
      if (i >= checked->mesh.vertices_O.size()) std::abort();
    }
  }
  return 0;
}
