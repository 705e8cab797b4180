#include "app/cli/program_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/base/text/json_text.h"
#include "app/base/text/sha256.h"
#include "app/base/text/text.h"
#include "app/cli/output_file.h"
#include "drivers/files/open_failure.h"
#include "drivers/files/replace_file.h"
#include "drivers/files/text_file.h"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

constexpr files::SizeLimit kProgramSize{64'000'000, "a robot program",
                                        "Check that this is the right file"};

std::string RecordPath(const std::string& path) {
  return path + ".plumbline.json";
}

/// Lines of the index: numbers digest, date, name of the file.
std::string IndexPath(const std::string& cell) {
  return cell + ".corrected";
}

std::string TextIfAny(const std::string& path) {
  std::error_code absent;
  if (!fs::is_regular_file(path, absent)) return "";
  const auto text = files::ReadFileUpTo(files::kTableSize, path);
  return text ? *text : std::string();
}

std::optional<ProgramInput> ReadInput(const std::string& path) {
  Result<std::string> bytes = files::ReadFileUpTo(kProgramSize, path);
  if (!bytes) {
    std::cerr << path << ": " << files::ReadErrorText(path, bytes.error()) << '\n';
    return std::nullopt;
  }
  return ProgramInput{{path, std::move(bytes).value()}, TextIfAny(RecordPath(path)), path};
}

/// Puts the original in place of a corrected file.
bool TakeOriginal(ProgramInput& input) {
  const auto original = programs::OriginalFrom(input.record);
  if (!original) {
    std::cerr << input.given << ": --again needs the record beside it, " << RecordPath(input.given)
              << ", which names the original\n";
    return false;
  }
  const fs::path path = fs::path(original->path).is_absolute()
                            ? fs::path(original->path)
                            : fs::path(input.given).parent_path() / original->path;
  Result<std::string> bytes = files::ReadFileUpTo(kProgramSize, path.string());
  if (!bytes || text::Sha256Hex(*bytes) != original->sha256) {
    std::cerr << input.given << ": the original " << path.string()
              << (bytes ? " has been changed since" : " cannot be read")
              << "; give the program to be corrected instead of this file\n";
    return false;
  }
  input.file = {path.lexically_normal().string(), std::move(bytes).value()};
  input.record.clear();
  return true;
}

/// True if an existing file is byte for byte what an earlier run wrote.
bool WrittenByEarlierRun(const std::string& path, std::string_view bytes) {
  const auto record = text::JsonFromText(TextIfAny(RecordPath(path)));
  return record && record->is_object() && record->contains("corrected_sha256") &&
         (*record)["corrected_sha256"] == text::Sha256Hex(bytes);
}

bool MayReplace(const ProgramOutput& output, const std::string& path, const ProgramInput& input,
                std::string_view new_bytes) {
  std::error_code unknown;
  if (output.force || !fs::is_regular_file(path, unknown)) return true;
  if (output.again && SameFile(path, input.given)) return true;
  const Result<std::string> bytes = files::ReadFileUpTo(kProgramSize, path);
  if (bytes && (*bytes == new_bytes || WrittenByEarlierRun(path, *bytes))) return true;
  std::cerr << path
            << ": exists, and is not what an earlier run wrote or was edited since. No program is "
               "written; choose another --output, or give --force to replace it\n";
  return false;
}

}  // namespace

std::optional<std::vector<ProgramInput>> ReadProgramInputs(const std::vector<std::string>& paths) {
  std::vector<ProgramInput> inputs;
  for (const std::string& path : paths) {
    const bool again = std::ranges::any_of(
        inputs, [&](const ProgramInput& other) { return SameFile(path, other.given); });
    if (again) continue;
    std::optional<ProgramInput> input = ReadInput(path);
    if (!input) return std::nullopt;
    inputs.push_back(std::move(*input));
  }
  return inputs;
}

std::vector<programs::SourceFile> FilesOf(const std::vector<ProgramInput>& inputs) {
  std::vector<programs::SourceFile> list;
  for (const ProgramInput& input : inputs) list.push_back(input.file);
  return list;
}

std::optional<std::vector<bool>> CorrectedBefore(const std::string& cell, bool again,
                                                 const programs::Brand& brand,
                                                 programs::Reading& reading,
                                                 std::vector<ProgramInput>& inputs) {
  std::vector<bool> corrected(inputs.size(), false);
  bool edited = false, replaced = false;
  const std::string index = TextIfAny(IndexPath(cell));
  for (std::size_t f = 0; f < inputs.size(); ++f) {
    programs::FileState state = programs::StateOf(reading.program, f, inputs[f].record);
    const std::string numbers = programs::NumbersDigest(reading.program, f);
    const bool in_index = ("\n" + index).find("\n" + numbers + " ") != std::string::npos;
    if (state == programs::FileState::kOriginal && in_index) {
      state = programs::FileState::kCorrected;
    }
    if (state == programs::FileState::kOriginal) continue;
    if (again) {
      if (!TakeOriginal(inputs[f])) return std::nullopt;
      replaced = true;
    } else if (state == programs::FileState::kEdited) {
      edited = true;
      std::cerr
          << inputs[f].given
          << ": was corrected, and its points were changed since. Nothing is written; correct "
             "the original, or give --again to start from it without these changes\n";
    } else {
      corrected[f] = true;
      std::cerr << inputs[f].given << ": is already corrected"
                << (in_index ? ", by its numbers in " + IndexPath(cell) : "")
                << "; it stays as it is\n";
    }
  }
  if (edited) return std::nullopt;
  if (replaced) reading = brand.Read(FilesOf(inputs));
  return corrected;
}

std::optional<std::vector<std::string>> OutputPathsOf(const ProgramOutput& output,
                                                      const std::vector<ProgramInput>& inputs,
                                                      const std::vector<bool>& corrected_before) {
  std::vector<std::string> paths(inputs.size());
  for (std::size_t f = 0; f < inputs.size(); ++f) {
    if (corrected_before[f]) continue;
    const ProgramInput& input = inputs[f];
    const fs::path file(input.file.name);
    const bool beside_corrected =
        output.again && std::ranges::any_of(inputs, [&](const ProgramInput& other) {
          return other.file.name != other.given &&
                 fs::path(other.given).parent_path() == file.parent_path();
        });
    const fs::path folder = !output.folder.empty() ? fs::path(output.folder)
                            : beside_corrected     ? file.parent_path()
                                                   : file.parent_path() / "corrected";
    const std::string path = (folder / file.filename()).string();
    for (const ProgramInput& other : inputs) {
      if (!SameFile(path, other.file.name) && !SameFile(path, other.given)) continue;
      if (output.again && SameFile(path, input.given)) continue;
      std::cerr << "plumbline program: " << path
                << " is a file of the program; choose another --output\n";
      return std::nullopt;
    }
    if (std::ranges::find(paths, path) != paths.end()) {
      std::cerr << "plumbline program: two files would be written to " << path
                << "; correct them one after the other with different --output\n";
      return std::nullopt;
    }
    paths[f] = path;
  }
  return paths;
}

bool WriteProgram(const ProgramOutput& output, std::vector<std::string>& paths,
                  const std::vector<ProgramInput>& inputs, const programs::Program& program,
                  const programs::ProgramCorrection& correction,
                  const programs::Rewritten& rewritten,
                  const std::pair<std::string, std::string>& report) {
  std::vector<files::NewFile> list;
  bool may = true;
  for (std::size_t f = 0; f < paths.size(); ++f) {
    // With --again, a file beside corrected ones whose own original is not known.
    if (SameFile(paths[f], inputs[f].file.name)) {
      if (rewritten.changed[f]) {
        std::cerr << paths[f]
                  << ": would be replaced by its own correction, as no record names an original. "
                     "Nothing is written; correct it without --again, or choose another --output\n";
        return false;
      }
      paths[f].clear();
    }
    if (paths[f].empty()) continue;
    const std::string& bytes = rewritten.files[f].bytes;
    may = MayReplace(output, paths[f], inputs[f], bytes) && may;
    std::error_code failed;
    const fs::path original =
        fs::relative(inputs[f].file.name, fs::absolute(paths[f]).parent_path(), failed);
    const nlohmann::json record = programs::RecordOf(
        program, f, correction, rewritten.marks[f],
        failed || original.empty() ? fs::absolute(inputs[f].file.name).string() : original.string(),
        bytes);
    list.push_back({paths[f], bytes});
    list.push_back({RecordPath(paths[f]), text::JsonText(record, 1) + "\n"});
  }
  if (!may) return false;
  if (!report.first.empty()) list.push_back({report.first, report.second});
  for (const std::string& path : paths) {
    std::error_code failed;
    const fs::path folder = fs::path(path).parent_path();
    if (!folder.empty()) fs::create_directories(folder, failed);
    if (failed) {
      std::cerr << folder.string() << ": this folder cannot be made: " << failed.message()
                << ". Nothing is written; choose another --output\n";
      return false;
    }
  }
  const Result<void> written = files::ReplaceFiles(list);
  if (!written) {
    std::cerr << written.error() << ". Nothing is written; choose another --output or --report\n";
  }
  return written.ok();
}

void RememberUnmarked(const std::string& cell, const programs::Brand& brand,
                      const std::vector<std::string>& paths, const programs::Rewritten& rewritten) {
  std::string lines;
  for (std::size_t f = 0; f < paths.size(); ++f) {
    if (paths[f].empty() || !rewritten.changed[f] || brand.Mark(rewritten.files[f], "")) continue;
    const programs::Mark& mark = rewritten.marks[f];
    lines += fmt::format("{} {} {}\n", mark.numbers, mark.date,
                         text::Visible(fs::path(paths[f]).filename().string()));
    std::cerr << paths[f] << ": has no place for a mark. Keep " << RecordPath(paths[f])
              << " beside it, by which a second run recognises it\n";
  }
  if (lines.empty()) return;
  const std::string path = IndexPath(cell);
  std::string index = TextIfAny(path);
  for (std::istringstream all(lines); std::getline(all, lines);) {
    if (index.find(lines) == std::string::npos) index += lines + '\n';
  }
  if (const Result<void> written = files::ReplaceFile(path, index); !written) {
    std::cerr << path << ": cannot be written: " << written.error()
              << ". Without that index, only the record beside a file shows that it is corrected\n";
  }
}

}  // namespace plumbline::cli
