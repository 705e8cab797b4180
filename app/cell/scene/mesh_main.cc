// plumbline-mesh: sandboxed parser of one mesh file. Started by plumbline, plumblined and
// plumbline-view, which survive its crash; the only program linked to the mesh parsing libraries.
//
//   plumbline-mesh FORMAT TRIANGLES MEMORY_BYTES CPU_S < FILE > ANSWER
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <iostream>
#include <new>

#include "app/cell/scene/mesh_file.h"
#include "app/cell/scene/mesh_parser.h"
#include "app/version.h"
#include "drivers/os/sandbox.h"

namespace {

using namespace plumbline;

using namespace plumbline::cell;

bool WriteAnswer(const Result<RawMesh>& answer) {
  const std::vector<std::uint8_t> bytes = EncodeMeshResponse(answer);
  for (std::size_t done = 0; done < bytes.size();) {
    const ssize_t wrote = write(STDOUT_FILENO, bytes.data() + done, bytes.size() - done);
    if (wrote < 0 && errno == EINTR) continue;
    if (wrote <= 0) return false;
    done += static_cast<std::size_t>(wrote);
  }
  return true;
}

Result<RawMesh> Parse(MeshFormat format, std::uint64_t triangles, std::uint64_t memory_bytes,
                      unsigned cpu_s) {
  if (format == MeshFormat::kVrml) PrepareVrmlParser();
  struct stat about {};
  if (fstat(STDIN_FILENO, &about) != 0 || about.st_size <= 0) return Error{"the file is empty"};
  const auto size = static_cast<std::size_t>(about.st_size);
  const void* const at = mmap(nullptr, size, PROT_READ, MAP_PRIVATE, STDIN_FILENO, 0);
  if (at == MAP_FAILED) return Error{"the file cannot be mapped into memory"};
  std::set_new_handler([] { _exit(kMeshOutOfMemory); });
  if (auto closed = os::EnterSandbox(memory_bytes, cpu_s); !closed) return closed.failure();
  return ParseMesh(format, {static_cast<const std::uint8_t*>(at), size}, triangles);
}

}  // namespace

int main(int argc, char** argv) {
  const auto format = argc == 5 ? MeshFormatOfWord(argv[1]) : std::nullopt;
  if (!format) {
    std::cerr << "plumbline-mesh " PLUMBLINE_VERSION
                 ": started by plumbline, plumblined and plumbline-view; see plumbline mesh check "
                 "--help\n";
    return 2;
  }
  const auto answer =
      Parse(*format, std::strtoull(argv[2], nullptr, 10), std::strtoull(argv[3], nullptr, 10),
            static_cast<unsigned>(std::strtoul(argv[4], nullptr, 10)));
  // Skip destructors: those of a malicious scene could take arbitrarily long.
  _exit(WriteAnswer(answer) ? 0 : 1);
}
