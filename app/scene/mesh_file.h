// A mesh file read in a process of its own, which may die, stall or lie.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/scene/mesh_format.h"
#include "app/scene/mesh_message.h"
#include "drivers/os/child_process.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/scene/mesh_facts.h"

namespace plumbline {

/// What plumbline-mesh exits with where its memory did not suffice.
inline constexpr int kMeshOutOfMemory = 3;

/// The program beside the running one.
std::string MeshProgram();

/// A file that was read and checked.
struct MeshFile {
  CheckedMesh checked;  ///< in metres
  MeshFormat format = MeshFormat::kStl;
  std::uint64_t bytes = 0;
  std::uint64_t other_elements = 0;
  std::vector<std::string> outside;
  std::uint64_t outside_count = 0;
};

/// Reads one file after another through `program`. Poll waits only for the time that it is given;
/// the checks of a mesh of two million triangles take it about two seconds. The kernel ends
/// the process when the thread that started it ends. Used by one thread.
class MeshReader {
 public:
  explicit MeshReader(MeshLimits limits = {}, std::string program = MeshProgram());
  MeshReader(const MeshReader&) = delete;
  MeshReader& operator=(const MeshReader&) = delete;

  bool idle() const { return !child_.started(); }
  /// Begins to read; only while idle.
  /// @param unit_m  the length that 1 in the file stands for [m]
  /// @return        why there is nothing to begin: no such file, not regular, too large, no suffix
  ///                that is known, no process
  Result<void> Start(const std::string& file, double unit_m);
  /// The answer, once; nothing where it has not come within `wait_s`.
  std::optional<Result<MeshFile>> Poll(double wait_s);

 private:
  Result<void> StartProcess(int file);
  Result<MeshFile> Finish();
  std::string WhyEnded(const ChildEnd& end) const;
  ChildEnd End(double patience_s);  ///< closes the pipe, too

  const MeshLimits limits_;
  const std::string program_;
  Descriptor pipe_;
  ChildProcess child_;
  double started_s_ = 0, unit_m_ = 1;
  MeshFile found_;
  std::vector<std::uint8_t> answer_;
};

/// Reads a file and waits for it.
Result<MeshFile> ReadMeshFile(const std::string& file, double unit_m, const MeshLimits& limits = {},
                              const std::string& program = MeshProgram());

}  // namespace plumbline
