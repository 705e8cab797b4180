// A corrected program as files: edits applied, the mark of the correction, and its record.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/programs/correction/program_correction.h"

namespace plumbline::programs {

/// The files with their edits applied. Edits must not overlap; insertions at one place keep their
/// order.
std::vector<SourceFile> WithEdits(const std::vector<SourceFile>& files, std::vector<Edit> edits);

// The mark of a correction, one line of comment in a file.

struct Mark {
  std::string version, date;  ///< of Plumbline; of the correction, 2026-11-29
  std::string model;          ///< first 12 hexadecimal digits of the cell file's SHA-256
  std::string numbers;        ///< NumbersDigest() of the corrected file
  bool operator==(const Mark&) const = default;
};

/// "plumbline 0.1.0 2026-11-29 model 0123456789ab numbers 0123456789ab".
std::string MarkText(const Mark& mark);
/// The mark in a text that may have more before and after it.
std::optional<Mark> MarkFrom(std::string_view text);

/// First 12 hexadecimal digits of the SHA-256 of the texts of all numbers and configurations of a
/// file's points, in the order of the file.
std::string NumbersDigest(const Program& program, std::size_t file);

/// First 12 hexadecimal digits of the SHA-256 of bytes.
std::string ShortDigest(std::string_view bytes);

/// What a file is, by its mark or by the record beside it.
enum class FileState {
  kOriginal,
  kCorrected,  ///< by an earlier run, and unchanged since
  kEdited,     ///< corrected by an earlier run; numbers of its points were changed since
};

/// @param record  the text of the record beside the file; empty: there is none
FileState StateOf(const Program& program, std::size_t file, std::string_view record);

// The record beside a corrected file.

/// What was corrected: for each point the texts taught and corrected, digests of both files.
nlohmann::json RecordOf(const Program& program, std::size_t file,
                        const ProgramCorrection& correction, const Mark& mark,
                        const std::string& original_path, const std::string& corrected_bytes);

/// Path of the original file that a record names, and its digest.
struct RecordedOriginal {
  std::string path, sha256;
};
std::optional<RecordedOriginal> OriginalFrom(std::string_view record);

/// The corrected program.
struct Rewritten {
  std::vector<SourceFile> files;  ///< all, also those that do not change
  std::vector<bool> changed;
  std::vector<Mark> marks;  ///< of each file; the place of a mark may be only the record
};

/// Applies all edits and marks the changed files, and reads the result again.
/// @param mark  version, date and model
/// @return      an error if the result does not read as it was written, which is a defect
Result<Rewritten> Rewrite(const Brand& brand, const Program& program,
                          const ProgramCorrection& correction, const Mark& mark);

}  // namespace plumbline::programs
