// Any bytes as a mesh file of any format: the reading process may die, its caller gets a checked
// mesh, a reason, or nothing. Each input is parsed in a process of its own, forked from this one,
// because Coin and Assimp do crash; what is tested is that nothing of that comes out.
#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "app/scene/mesh_parser.h"
#include "firmware-like/scene/mesh_facts.h"

namespace {

using namespace plumbline;

constexpr MeshLimits kLimits{.triangles = 20'000};
constexpr int kPatience_ms = 2000;  ///< some inputs keep Assimp busy for ever

[[noreturn]] void ParseInChild(MeshFormat format, std::span<const std::uint8_t> bytes, int answer) {
  // Not the sanitizer's report: a crash of these libraries is expected, and slow to tell.
  for (const int crash : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL}) signal(crash, SIG_DFL);
  const int nothing = open("/dev/null", O_WRONLY);
  dup2(nothing, STDERR_FILENO);
  const rlimit cpu{1, 1}, none{0, 0};
  setrlimit(RLIMIT_CPU, &cpu);
  setrlimit(RLIMIT_CORE, &none);
  const std::vector<std::uint8_t> told =
      BytesOfMeshAnswer(ParseMesh(format, bytes, kLimits.triangles));
  for (std::size_t done = 0; done < told.size();) {
    const ssize_t wrote = write(answer, told.data() + done, told.size() - done);
    if (wrote <= 0) break;
    done += static_cast<std::size_t>(wrote);
  }
  _exit(0);
}

std::vector<std::uint8_t> AnswerFor(MeshFormat format, std::span<const std::uint8_t> bytes) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) std::abort();
  const pid_t pid = fork();
  if (pid < 0) std::abort();
  if (pid == 0) ParseInChild(format, bytes, ends[1]);
  close(ends[1]);
  std::vector<std::uint8_t> answer;
  std::array<std::uint8_t, 65536> piece{};
  for (;;) {
    pollfd readable{ends[0], POLLIN, 0};
    const int ready = poll(&readable, 1, kPatience_ms);
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) break;
    const ssize_t got = read(ends[0], piece.data(), piece.size());
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    answer.insert(answer.end(), piece.begin(), piece.begin() + got);
  }
  close(ends[0]);
  kill(pid, SIGKILL);
  waitpid(pid, nullptr, 0);
  return answer;
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  PrepareVrmlParser();
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 2) return 0;
  const auto format = static_cast<MeshFormat>(data[0] % 6);
  const std::span bytes(data + 1, size - 1);
  AnnouncedTriangles(format, bytes);  // here too, where the fuzzer sees which way they go
  IsTruncated(format, bytes);
  const auto answer = MeshAnswerOfBytes(AnswerFor(format, bytes), kLimits);
  if (!answer || !*answer) return 0;
  RawMesh raw = answer->value();
  const auto checked = CheckMesh(std::move(raw.mesh), 1e-3);
  if (!checked) return 0;
  for (const Vec3f& p : checked->mesh.vertices_O) {
    if (!p.allFinite()) std::abort();
  }
  for (const Triangle& triangle : checked->mesh.triangles) {
    for (const std::uint32_t i : triangle) {
      if (i >= checked->mesh.vertices_O.size()) std::abort();
    }
  }
  return 0;
}
