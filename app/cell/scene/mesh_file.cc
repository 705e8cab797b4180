#include "app/cell/scene/mesh_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <csignal>
#include <cstring>
#include <limits>

#include "drivers/clock.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/package_paths.h"

namespace plumbline::cell {
namespace {

constexpr int kReaderNice = 5;
constexpr double kEndTimeout_s = 1;
constexpr std::size_t kPiece = 1 << 20;  ///< bytes read at a time

constexpr double kCoarsest = 0.01;  ///< rounding that is not worth a warning [mm]

/// Distance of neighbouring single-precision numbers.
double PrecisionAt(double value) {
  const auto low = static_cast<float>(value);
  return std::nextafter(low, std::numeric_limits<float>::infinity()) - low;
}

double Mebibytes(std::uint64_t bytes) {
  return static_cast<double>(bytes) / (1 << 20);
}

}  // namespace

std::string MeshProgram() {
  return files::SiblingProgram("plumbline-mesh");
}

MeshReader::MeshReader(MeshLimits limits, std::string program)
    : limits_(limits), program_(std::move(program)) {}

Result<void> MeshReader::Start(const std::string& file, double unit_m) {
  const auto format = MeshFormatOfName(file);
  if (!format)
    return Error{fmt::format("unknown file type; its name must end in {}", kMeshFormats)};
  const os::Descriptor opened(open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (!opened) return Error{files::ReadErrorText(file, std::strerror(errno))};
  struct stat about {};
  found_ = {};
  found_.format = *format;
  unit_m_ = unit_m;
  if (fstat(opened.get(), &about) != 0 || !S_ISREG(about.st_mode)) {
    return Error{"cannot be read: not a regular file; name a mesh file, not a folder or device"};
  }
  if (about.st_size == 0) return Error{"is empty"};
  found_.bytes = static_cast<std::uint64_t>(about.st_size);
  if (found_.bytes > limits_.file_bytes) {
    return Error{
        fmt::format("{:.0f} MiB; the limit is {:.0f} MiB: simplify the model, or export it with a "
                    "coarser mesh",
                    Mebibytes(found_.bytes), Mebibytes(limits_.file_bytes))};
  }
  return StartProcess(opened.get());
}

Result<void> MeshReader::StartProcess(int file) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) {
    return Error{fmt::format("cannot create a pipe to the mesh reader: {}", std::strerror(errno))};
  }
  os::Descriptor read_end(ends[0]);
  const os::Descriptor write_end(ends[1]);
  auto child = os::ChildProcess::Start(
      {.arguments = {program_, std::string(WordOf(found_.format)),
                     std::to_string(limits_.triangles), std::to_string(limits_.memory_bytes),
                     std::to_string(limits_.cpu_s)},
       .descriptors = {{STDIN_FILENO, file}, {STDOUT_FILENO, write_end.get()}},
       .nice = kReaderNice});
  if (!child) return Error{fmt::format("cannot start the mesh reader: {}", child.error())};
  child_ = std::move(child).value();
  pipe_ = std::move(read_end);
  fcntl(pipe_.get(), F_SETFL, O_NONBLOCK);
  answer_.clear();
  started_s_ = MonotonicSeconds();
  return {};
}

os::ExitStatus MeshReader::End(double timeout_s) {
  const os::ExitStatus end = child_.End(timeout_s);
  pipe_.Reset();
  return end;
}

std::string MeshReader::WhyEnded(const os::ExitStatus& end) const {
  if (end.signal == SIGXCPU) {
    return fmt::format("not read within {} s of CPU time: simplify the model", limits_.cpu_s);
  }
  if (end.signal != 0) {
    return fmt::format(
        "the mesh reader crashed ({}): the file is damaged, nested too deeply, or needs more than "
        "{:.0f} MiB of memory; repair the model, or export it in another format",
        strsignal(end.signal), Mebibytes(limits_.memory_bytes));
  }
  if (end.exit_code == kMeshOutOfMemory) {
    return fmt::format(
        "reading it needs more than {:.0f} MiB of memory: the file is damaged or too large; "
        "repair or simplify the model",
        Mebibytes(limits_.memory_bytes));
  }
  if (end.exit_code == os::ExitStatus::kNotRun) {
    return fmt::format("{} cannot be started; {}", program_, files::kRestoreProgram);
  }
  return fmt::format("{} returned an invalid result; is it of the same version as this program?",
                     program_);
}

Result<MeshFile> MeshReader::Finish() {
  auto answer = DecodeMeshResponse(answer_, limits_);
  answer_ = {};
  // The child has closed the pipe and is about to exit; if it does not, it is killed.
  const os::ExitStatus end = End(answer ? 0 : kEndTimeout_s);
  if (!answer) return Error{WhyEnded(end)};
  if (!*answer) return answer->failure();
  RawMesh raw = std::move(*answer).value();
  auto checked = scene::CheckMesh(std::move(raw.mesh), unit_m_);
  if (!checked) return checked.failure();
  found_.checked = std::move(checked).value();
  found_.other_elements = raw.other_elements;
  found_.outside = std::move(raw.outside);
  found_.outside_count = raw.outside_count;
  found_.largest_m = unit_m_ * raw.largest_coordinate;
  found_.precision_m = unit_m_ * PrecisionAt(raw.largest_coordinate);
  return std::move(found_);
}

std::string PrecisionProblem(const MeshFile& file, double scale, std::string_view unit) {
  if (!(scale * file.precision_m > kCoarsest)) return "";
  return fmt::format(
      "its coordinates reach {:.4g} {} from the origin, where single precision has steps of {:.2g} "
      "{}, to which the shape is rounded: export it near the origin, and give its place in "
      "objects.toml",
      scale * file.largest_m, unit, scale * file.precision_m, unit);
}

std::optional<Result<MeshFile>> MeshReader::Poll(double wait_s) {
  if (idle()) return std::nullopt;
  const double until_s = MonotonicSeconds() + wait_s;
  for (;;) {
    const std::size_t before = answer_.size();
    answer_.resize(before + kPiece);
    const ssize_t got = read(pipe_.get(), answer_.data() + before, kPiece);
    answer_.resize(before + static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    if (answer_.size() > MaxMeshResponseBytes(limits_)) {
      End(0);
      return Error{fmt::format("{} returned more data than allowed", program_)};
    }
    if (got == 0) return Finish();
    if (got > 0) continue;
    const double now_s = MonotonicSeconds();
    if (now_s - started_s_ > limits_.wall_s) {
      End(0);
      return Error{fmt::format("not read within {:g} s: simplify the model", limits_.wall_s)};
    }
    if (now_s >= until_s) return std::nullopt;
    pollfd readable{.fd = pipe_.get(), .events = POLLIN, .revents = 0};
    poll(&readable, 1, static_cast<int>(1e3 * std::min(1.0, until_s - now_s)) + 1);
  }
}

Result<MeshFile> ReadMeshFile(const std::string& file, double unit_m, const MeshLimits& limits,
                              const std::string& program) {
  MeshReader reader(limits, program);
  if (auto started = reader.Start(file, unit_m); !started) return started.failure();
  for (;;) {
    if (auto answer = reader.Poll(1)) return *std::move(answer);
  }
}

}  // namespace plumbline::cell
