// Mesh file reader: parses untrusted files in a sandboxed child process.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/cell/scene/mesh_format.h"
#include "drivers/os/child_process.h"
#include "drivers/os/descriptor.h"
#include "firmware-like/scene/mesh_facts.h"

namespace plumbline::cell {

/// Exit code of plumbline-mesh if its memory limit was reached.
inline constexpr int kMeshOutOfMemory = 3;

/// Path of plumbline-mesh, in the folder of the running program.
std::string MeshProgram();

/// A mesh file that was read and checked.
struct MeshFile {
  scene::CheckedMesh checked;  ///< in metres
  MeshFormat format = MeshFormat::kStl;
  std::uint64_t bytes = 0;
  std::uint64_t other_elements = 0;  ///< as in RawMesh
  std::vector<std::string> outside;  ///< as in RawMesh
  std::uint64_t outside_count = 0;
  double largest_m = 0;    ///< largest coordinate at any stage, in the scale of the whole
  double precision_m = 0;  ///< distance of neighbouring single-precision numbers there
};

/// "its coordinates reach ...", with the remedy, if the shape is rounded to more than 0.01 mm;
/// empty otherwise.
/// @param scale  from metres to the unit of the text
std::string PrecisionProblem(const MeshFile& file, double scale = 1e3,
                             std::string_view unit = "mm");

/// Reads one file at a time through `program`. In addition to its wait, Poll() checks a mesh that
/// has arrived, which takes about two seconds for two million triangles. The kernel kills the child
/// process when the thread that started it ends. Used by one thread.
class MeshReader {
 public:
  explicit MeshReader(MeshLimits limits = {}, std::string program = MeshProgram());
  MeshReader(const MeshReader&) = delete;
  MeshReader& operator=(const MeshReader&) = delete;

  bool idle() const { return !child_.started(); }
  /// Starts reading; call only while idle.
  /// @param unit_m  length unit of the file [m]
  /// @return        or why reading cannot start: no such file, not a regular file, too large,
  ///                unknown suffix, no process
  Result<void> Start(const std::string& file, double unit_m);
  /// Returns the result, once; nullopt if it is not complete within `wait_s`.
  std::optional<Result<MeshFile>> Poll(double wait_s);

 private:
  Result<void> StartProcess(int file);
  Result<MeshFile> Finish();
  std::string WhyEnded(const os::ExitStatus& end) const;
  os::ExitStatus End(double timeout_s);  ///< ends the child and closes the pipe

  const MeshLimits limits_;
  const std::string program_;
  os::Descriptor pipe_;
  os::ChildProcess child_;
  double started_s_ = 0, unit_m_ = 1;
  MeshFile found_;
  std::vector<std::uint8_t> answer_;
};

/// Reads a file; blocks until it is complete.
Result<MeshFile> ReadMeshFile(const std::string& file, double unit_m, const MeshLimits& limits = {},
                              const std::string& program = MeshProgram());

}  // namespace plumbline::cell
