// Files that are known by their first bytes: images, archives, documents, databases, recordings.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>

#include "app/base/recognition/kinds.h"
#include "app/base/recognition/lens_facts.h"

namespace plumbline::recognition {
namespace {

using std::string_view_literals::operator""sv;

/// A number of up to 4 bytes; 0 beyond the end.
std::uint32_t Number(std::string_view bytes, std::size_t at, std::size_t count, bool big_endian) {
  if (at + count > bytes.size()) return 0;
  std::uint32_t value = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t from = big_endian ? at + k : at + count - 1 - k;
    value = value << 8U | static_cast<unsigned char>(bytes[from]);
  }
  return value;
}

// Images.

void ReadPng(const Outline& file, Recognition& found) {
  const std::string_view bytes = file.bytes();
  AddFact(found, "image size",
          fmt::format("{} x {} px", Number(bytes, 16, 4, true), Number(bytes, 20, 4, true)));
  const std::string_view tail =
      bytes.substr(bytes.size() - std::min<std::size_t>(64, bytes.size()));
  if (tail.find("IEND") == std::string_view::npos) {
    Contradict(found, "end", "the end mark IEND is missing: the file is cut; copy it again");
  }
}

/// Walks the segments to the one with the size.
void ReadJpeg(const Outline& file, Recognition& found) {
  const std::string_view bytes = file.bytes();
  for (std::size_t at = 2; at + 9 < bytes.size() && bytes[at] == '\xFF';) {
    const auto marker = static_cast<unsigned char>(bytes[at + 1]);
    if (marker >= 0xC0 && marker <= 0xCF && marker != 0xC4 && marker != 0xC8 && marker != 0xCC) {
      AddFact(found, "image size",
              fmt::format("{} x {} px", Number(bytes, at + 7, 2, true),
                          Number(bytes, at + 5, 2, true)));
      break;
    }
    at += 2 + std::max<std::uint32_t>(2, Number(bytes, at + 2, 2, true));
  }
  const std::string_view tail =
      bytes.substr(bytes.size() - std::min<std::size_t>(64, bytes.size()));
  if (tail.find("\xFF\xD9"sv) == std::string_view::npos) {
    Contradict(found, "end", "the end mark FF D9 is missing: the file is cut; copy it again");
  }
}

void ReadBmp(const Outline& file, Recognition& found) {
  const std::string_view bytes = file.bytes();
  AddFact(found, "image size",
          fmt::format("{} x {} px", Number(bytes, 18, 4, false), Number(bytes, 22, 4, false)));
  const std::uint32_t size = Number(bytes, 2, 4, false);
  if (size > bytes.size()) {
    Contradict(found, "size",
               fmt::format("the header states {} bytes, the file has {}: it is cut; copy it again",
                           size, bytes.size()));
  }
}

/// P1 to P6, width, height. Lines of a point list, "P1 100 200 300", look similar.
std::optional<Fact> IsPnm(const Outline& file) {
  const std::string_view bytes = file.bytes();
  if (bytes.size() < 8 || bytes[0] != 'P' || bytes[1] < '1' || bytes[1] > '6') return std::nullopt;
  const std::string_view head = bytes.substr(2, 200);
  int numbers = 0;
  bool comment = false, digits = false;
  for (const char c : head) {
    if (c == '#') comment = true;
    if (c == '\n') comment = false;
    if (comment) continue;
    const bool digit = c >= '0' && c <= '9',
               blank = c == ' ' || c == '\n' || c == '\r' || c == '\t';
    numbers += digit && !digits ? 1 : 0;
    digits = digit;
    // The numbers of a binary one are followed by anything.
    if (!digit && !blank) return std::nullopt;
    if (bytes[1] >= '4' && numbers == (bytes[1] == '4' ? 2 : 3) && blank) break;
  }
  if (numbers < 2) return std::nullopt;
  return Fact{"", fmt::format("first bytes {}", bytes.substr(0, 2)), 1};
}

// Compressed files and archives.

/// The name that gzip keeps of the original.
std::string GzipName(std::string_view bytes) {
  constexpr std::size_t kHead = 10;
  if (bytes.size() < kHead || (bytes[3] & 8) == 0) return "";
  std::size_t at = kHead;
  if ((bytes[3] & 4) != 0) at += 2 + Number(bytes, at, 2, false);
  if (at >= bytes.size()) return "";
  const std::size_t end = std::min(bytes.find('\0', at), std::min(at + 200, bytes.size()));
  return Quoted(bytes.substr(at, end - at));
}

void ReadGzip(const Outline& file, Recognition& found) {
  const std::string name = GzipName(file.bytes());
  if (!name.empty()) AddFact(found, "original name", name);
  if (file.extension() == "urp") {
    found.name = "a program of a Universal Robots controller (.urp, gzip)";
    found.content = Content::kProgram;
    found.command = "plumbline program CELL.toml {}";
  }
}

bool IsZip(const Outline& file) {
  return file.bytes().starts_with("PK\x03\x04");
}

/// A name of a part in the first entries of a zip archive.
std::optional<Fact> ZipWith(const Outline& file, std::string_view part) {
  if (!IsZip(file)) return std::nullopt;
  const std::string_view bytes = file.bytes();
  constexpr std::size_t kEnds = 256 * 1024;
  const std::string_view front = bytes.substr(0, kEnds);
  const std::string_view back = bytes.substr(bytes.size() - std::min(kEnds, bytes.size()));
  if (front.find(part) == std::string_view::npos && back.find(part) == std::string_view::npos) {
    return std::nullopt;
  }
  return Fact{"", fmt::format("zip archive with {}", part), 0};
}

std::optional<Fact> IsTar(const Outline& file) {
  return FirstBytes(file, "ustar"sv, "\"ustar\" at byte 257", 257);
}

// Databases and recordings.

bool IsSqlite(const Outline& file) {
  return file.bytes().starts_with("SQLite format 3\0"sv);
}

/// A table of the schema, whose text is in the first pages.
std::optional<Fact> SqliteWith(const Outline& file, std::string_view table) {
  if (!IsSqlite(file)) return std::nullopt;
  const std::string_view pages = file.bytes().substr(0, 64 * 1024);
  if (pages.find(fmt::format("CREATE TABLE {} (", table)) == std::string_view::npos &&
      pages.find(fmt::format("CREATE TABLE {}(", table)) == std::string_view::npos) {
    return std::nullopt;
  }
  return Fact{"", fmt::format("SQLite database with the table {}", table), 0};
}

void ReadSqlite(const Outline& file, Recognition& found) {
  AddFact(found, "schema version", fmt::format("{}", Number(file.bytes(), 60, 4, true)));
}

// Lens files.

constexpr std::array<std::pair<std::size_t, int>, 5> kArToolKitSizes = {
    {{136, 1}, {144, 2}, {152, 3}, {176, 4}, {240, 5}}};

constexpr std::size_t kFactors = 104;  // where they begin, behind image size and matrix

double Real(std::string_view bytes, std::size_t at) {
  const std::uint64_t bits =
      std::uint64_t{Number(bytes, at, 4, true)} << 32U | Number(bytes, at + 4, 4, true);
  return std::bit_cast<double>(bits);
}

/// Big-endian image size, matrix and factors; the size of the file shows the version.
int ArToolKitVersion(const Outline& file) {
  const std::string_view bytes = file.bytes();
  const auto found =
      std::ranges::find(kArToolKitSizes, bytes.size(), &std::pair<std::size_t, int>::first);
  if (found == kArToolKitSizes.end()) return 0;
  constexpr std::uint32_t kLargestSide = 65536;
  const std::uint32_t width = Number(bytes, 0, 4, true), height = Number(bytes, 4, 4, true);
  const bool sizes = width > 0 && width <= kLargestSide && height > 0 && height <= kLargestSide;
  // The factors start with the distortion terms, or in old versions with the principal point.
  const double first = Real(bytes, kFactors), second = Real(bytes, kFactors + 8);
  const bool centre = first > 1 && first < width && second > 1 && second < height;
  return sizes && centre == (found->second < 4) ? found->second : 0;
}

std::optional<Fact> ArToolKit(const Outline& file, bool readable) {
  const int version = ArToolKitVersion(file);
  if (version == 0 || (version >= 4) != readable) return std::nullopt;
  return Fact{"", fmt::format("{} bytes, which start with an image size", file.bytes().size()), 0};
}

void ReadArToolKit(const Outline& file, Recognition& found) {
  const std::string_view bytes = file.bytes();
  const int version = ArToolKitVersion(file);
  AddFact(found, "version", fmt::format("{} of the distortion model", version));
  LensFacts lens;
  lens.width = {static_cast<double>(Number(bytes, 0, 4, true)), 0};
  lens.height = {static_cast<double>(Number(bytes, 4, 4, true)), 0};
  if (version >= 4) {
    const std::size_t count = version == 4 ? 4 : 12;
    std::vector<double> factors;
    for (std::size_t k = 0; k < count + 4; ++k) factors.push_back(Real(bytes, kFactors + 8 * k));
    lens.fx = {factors[count], 0};
    lens.fy = {factors[count + 1], 0};
    lens.cx = {factors[count + 2], 0};
    lens.cy = {factors[count + 3], 0};
    factors.resize(count);
    lens.terms = {factors, 0};
    lens.opencv_order = true;
  }
  AddLens(lens, found);
}

/// Text in UTF-16 without a byte-order mark: every other byte is zero.
std::optional<Fact> IsBareUtf16(const Outline& file) {
  const std::string_view sample = file.bytes().substr(0, 4096);
  if (sample.size() < 8 || file.syntax() != Syntax::kBinary) return std::nullopt;
  std::array<std::size_t, 2> zeros{};
  for (std::size_t k = 0; k < sample.size(); ++k) zeros.at(k % 2) += sample[k] == '\0' ? 1 : 0;
  const std::size_t half = sample.size() / 2, most = std::max(zeros[0], zeros[1]);
  if (most < half * 9 / 10 || std::min(zeros[0], zeros[1]) > half / 50) return std::nullopt;
  return Fact{"", "every other byte is zero", 0};
}

constexpr const char *kTrack =
                         "plumbline track --image {} --intrinsics LENS.json --tag-size-mm SIZE",
                     *kUnpack = "Unpack it, and run `plumbline explain` on the files in it.",
                     *kAsCsv = "Save the sheet as CSV, then: plumbline import FILE.csv --preview";

constexpr std::array kBinaryKinds = {
    Kind{"empty", "an empty file", Content::kEmpty,
         [](const Outline& file) -> std::optional<Fact> {
           if (file.syntax() != Syntax::kEmpty) return std::nullopt;
           return Fact{"", fmt::format("{} bytes, none of them visible", file.bytes().size()), 0};
         },
         [](const Outline& file, Recognition& found) {
           Contradict(found, "content",
                      file.extension().empty()
                          ? "there is none"
                          : fmt::format("there is none, though the name ends in .{}",
                                        Quoted(file.extension())));
         },
         "", "Copy it again from where it came from."},
    Kind{"artoolkit-lens", "a lens file of ARToolKit (camera_para.dat)", Content::kLens,
         [](const Outline& file) { return ArToolKit(file, true); }, ReadArToolKit,
         "plumbline track --image IMAGE --intrinsics {} --tag-size-mm SIZE", ""},
    Kind{"artoolkit-old-lens", "a lens file of ARToolKit 1 to 3 (camera_para.dat)",
         Content::kLensOfOthers, [](const Outline& file) { return ArToolKit(file, false); },
         ReadArToolKit, "",
         "Its distortion model cannot be converted: calibrate the camera again, with plumbline "
         "calibrate-lens."},
    Kind{"png", "a PNG image", Content::kImage,
         [](const Outline& file) { return FirstBytes(file, "\x89PNG\r\n\x1A\n", "89 PNG"); }, ReadPng,
         kTrack, ""},
    Kind{"jpeg", "a JPEG image", Content::kImage,
         [](const Outline& file) { return FirstBytes(file, "\xFF\xD8\xFF", "FF D8 FF"); }, ReadJpeg,
         kTrack, ""},
    Kind{"bmp", "a BMP image", Content::kImage,
         [](const Outline& file) -> std::optional<Fact> {
           const std::uint32_t head = Number(file.bytes(), 14, 4, false);
           if (file.syntax() != Syntax::kBinary || head < 12 || head > 124) return std::nullopt;
           return FirstBytes(file, "BM", "BM");
         },
         ReadBmp, kTrack, ""},
    Kind{"tiff", "a TIFF image", Content::kImage,
         [](const Outline& file) {
           const auto little = FirstBytes(file, "II*\0"sv, "II*");
           return little ? little : FirstBytes(file, "MM\0*"sv, "MM *");
         },
         nullptr, kTrack, ""},
    Kind{"pnm", "a PGM or PPM image", Content::kImage, IsPnm, nullptr, kTrack, ""},
    Kind{"gif", "a GIF image", Content::kImage,
         [](const Outline& file) { return FirstBytes(file, "GIF8", "GIF8"); }, nullptr, "",
         "Convert it without loss to PNG: convert {} image.png"},
    Kind{"webp", "a WebP image", Content::kImage,
         [](const Outline& file) -> std::optional<Fact> {
           if (!file.bytes().starts_with("RIFF")) return std::nullopt;
           return FirstBytes(file, "WEBP", "\"WEBP\" at byte 8", 8);
         },
         nullptr, "", "Convert it to PNG: convert {} image.png"},
    Kind{"avi", "a video (AVI)", Content::kImage,
         [](const Outline& file) -> std::optional<Fact> {
           if (!file.bytes().starts_with("RIFF")) return std::nullopt;
           return FirstBytes(file, "AVI ", "\"AVI\" at byte 8", 8);
         },
         nullptr, "", "Extract single images: ffmpeg -i {} frame_%04d.png"},
    Kind{"mp4", "a video (MP4, MOV)", Content::kImage,
         [](const Outline& file) -> std::optional<Fact> {
           if (file.syntax() != Syntax::kBinary) return std::nullopt;
           return FirstBytes(file, "ftyp", "\"ftyp\" at byte 4", 4);
         },
         nullptr, "", "Extract single images: ffmpeg -i {} frame_%04d.png"},
    Kind{"pdf", "a PDF document", Content::kDocument,
         [](const Outline& file) { return FirstBytes(file, "%PDF-", "%PDF-"); },
         [](const Outline& file, Recognition& found) {
           AddFact(found, "version", Quoted(file.bytes().substr(5, 3)), 1);
           const std::string_view bytes = file.bytes();
           constexpr std::size_t kTail = 2048;
           if (bytes.substr(bytes.size() - std::min(kTail, bytes.size())).find("%%EOF") ==
               std::string_view::npos) {
             Contradict(found, "end", "the end mark %%EOF is missing: the file is cut");
           }
         },
         "", "Ask for the data as CSV or text; numbers of a PDF are not read."},
    Kind{"xlsx", "a spreadsheet of Excel (.xlsx)", Content::kDocument,
         [](const Outline& file) { return ZipWith(file, "xl/"); }, nullptr, "", kAsCsv},
    Kind{"docx", "a document of Word (.docx)", Content::kDocument,
         [](const Outline& file) { return ZipWith(file, "word/"); }, nullptr, "",
         "Copy the table into a text file, then: plumbline import FILE.txt --preview"},
    Kind{"ods", "a spreadsheet of LibreOffice (.ods)", Content::kDocument,
         [](const Outline& file) {
           return ZipWith(file, "application/vnd.oasis.opendocument.spreadsheet");
         },
         nullptr, "", kAsCsv},
    Kind{"3mf", "a model for 3D printing (.3mf)", Content::kMeshOfOthers,
         [](const Outline& file) { return ZipWith(file, "3D/3dmodel.model"); }, nullptr, "",
         "Export it as STL or OBJ from the program that made it."},
    Kind{"zip", "a zip archive", Content::kContainer,
         [](const Outline& file) { return FirstBytes(file, "PK\x03\x04", "PK 03 04"); }, nullptr, "",
         kUnpack},
    Kind{"ole", "an old Office document or CAD part (OLE)", Content::kDocument,
         [](const Outline& file) {
           return FirstBytes(file, "\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1", "D0 CF 11 E0");
         },
         [](const Outline& file, Recognition& found) {
           if (file.extension() == "xls") found.name = "a spreadsheet of Excel 97 to 2003 (.xls)";
           if (file.extension().starts_with("sld")) {
             found.name = "a part or assembly of SolidWorks";
             found.content = Content::kMeshOfOthers;
             found.conversion = "Export it as STL or VRML97 from SolidWorks.";
           }
         },
         "", kAsCsv},
    Kind{"gzip", "a file compressed by gzip", Content::kContainer,
         [](const Outline& file) { return FirstBytes(file, "\x1F\x8B\x08", "1F 8B 08"); }, ReadGzip, "",
         "Unpack it: gunzip --keep {} (a file without the ending .gz: zcat {} > NEW), and run "
         "`plumbline explain` on the result."},
    Kind{"xz", "a file compressed by xz", Content::kContainer,
         [](const Outline& file) { return FirstBytes(file, "\xFD\x37zXZ\0"sv, "FD 7zXZ"); }, nullptr, "",
         kUnpack},
    Kind{"bzip2", "a file compressed by bzip2", Content::kContainer,
         [](const Outline& file) -> std::optional<Fact> {
           // The level, then pi in BCD, or its square root in an empty file.
           const std::string_view block = file.bytes().substr(std::min<std::size_t>(4, file.bytes().size()));
           const bool begins = block.starts_with("1AY&SY") || block.starts_with("\x17\x72\x45\x38\x50\x90");
           return begins ? FirstBytes(file, "BZh", "BZh") : std::nullopt;
         },
         nullptr, "", kUnpack},
    Kind{"zstd", "a file compressed by zstd", Content::kContainer,
         [](const Outline& file) { return FirstBytes(file, "\x28\xB5\x2F\xFD", "28 B5 2F FD"); },
         nullptr, "", kUnpack},
    Kind{"7z", "a 7-Zip archive", Content::kContainer,
         [](const Outline& file) { return FirstBytes(file, "7z\xBC\xAF\x27\x1C", "7z BC AF"); }, nullptr,
         "", kUnpack},
    Kind{"rar", "a RAR archive", Content::kContainer,
         [](const Outline& file) { return FirstBytes(file, "Rar!\x1A\x07", "Rar!"); }, nullptr, "",
         kUnpack},
    Kind{"tar", "a tar archive", Content::kContainer, IsTar, nullptr, "", kUnpack},
    Kind{"rosbag1", "a recording of ROS 1 (.bag)", Content::kRecording,
         [](const Outline& file) { return FirstBytes(file, "#ROSBAG V", "#ROSBAG V"); },
         [](const Outline& file, Recognition& found) {
           AddFact(found, "version", Quoted(file.bytes().substr(8, 4)), 1);
         },
         "",
         "Write the topic as a table: rostopic echo -b {} -p /joint_states > joints.csv, then "
         "plumbline import POINTS.csv --joints joints.csv --preview"},
    Kind{"mcap", "a recording of ROS 2 (.mcap)", Content::kRecording,
         [](const Outline& file) { return FirstBytes(file, "\x89MCAP0\r\n", "89 MCAP0"); }, nullptr, "",
         "Write the topic as CSV, such as with PlotJuggler, then: plumbline import FILE.csv "
         "--preview"},
    Kind{"rosbag2", "a recording of ROS 2 (.db3)", Content::kRecording,
         [](const Outline& file) { return SqliteWith(file, "topics"); }, ReadSqlite, "",
         "Write the topic as CSV, such as with PlotJuggler, then: plumbline import FILE.csv "
         "--preview"},
    Kind{"journal", "a journal of measurements of the daemon (journal.sqlite)", Content::kState,
         [](const Outline& file) { return SqliteWith(file, "measurement"); }, ReadSqlite,
         "plumbline journal list --state FOLDER", ""},
    Kind{"lens-store", "lenses calibrated by the daemon (lenses.sqlite)", Content::kState,
         [](const Outline& file) { return SqliteWith(file, "lens"); }, ReadSqlite,
         "plumbline lens list --state FOLDER", ""},
    Kind{"fleet-queue", "a queue of plumbline-fleet", Content::kState,
         [](const Outline& file) { return SqliteWith(file, "stream"); }, ReadSqlite, "",
         "It belongs to plumbline-fleet; nothing is to be done with it."},
    Kind{"sqlite", "an SQLite database", Content::kContainer,
         [](const Outline& file) { return FirstBytes(file, "SQLite format 3\0"sv, "\"SQLite format 3\""); },
         ReadSqlite, "", "Export the table as CSV: sqlite3 -header -csv {} 'select * from TABLE'"},
    Kind{"numpy", "an array of NumPy (.npy)", Content::kTable,
         [](const Outline& file) { return FirstBytes(file, "\x93NUMPY", "93 NUMPY"); },
         [](const Outline& file, Recognition& found) {
           const std::string_view head = file.bytes().substr(0, 256);
           const std::size_t at = head.find("'shape':");
           if (at == std::string_view::npos) return;
           const std::string_view shape = head.substr(at + 8);
           AddFact(found, "shape", Quoted(shape.substr(0, shape.find(')') + 1)));
         },
         "",
         "Write it as CSV: python3 -c \"import numpy as n; n.savetxt('table.csv', n.load('{}'), "
         "delimiter=',')\", then: plumbline import table.csv --preview"},
    Kind{"matlab", "data of MATLAB (.mat)", Content::kTable,
         [](const Outline& file) { return FirstBytes(file, "MATLAB 5.0 MAT-file", "MATLAB 5.0"); },
         nullptr, "", "Write the matrix as CSV: writematrix(A, 'table.csv')"},
    Kind{"hdf5", "HDF5 data (also .mat of MATLAB 7.3)", Content::kTable,
         [](const Outline& file) { return FirstBytes(file, "\x89HDF\r\n\x1A\n", "89 HDF"); }, nullptr,
         "", "Write the table as CSV, then: plumbline import FILE.csv --preview"},
    Kind{"program-file", "an executable program", Content::kDocument,
         [](const Outline& file) {
           const auto elf = FirstBytes(file, "\x7F" "ELF", "7F ELF");
           if (elf || file.syntax() != Syntax::kBinary || file.bytes().size() < 256) return elf;
           return FirstBytes(file, "MZ", "MZ");
         },
         nullptr, "", "It is no data; check the name."},
    Kind{"old-line-ends", "a text whose lines end in a carriage return only", Content::kContainer,
         [](const Outline& file) -> std::optional<Fact> {
           const std::string_view text = file.text();
           const std::size_t end = text.find('\r');
           if (end == std::string_view::npos || end + 1 >= text.size() ||
               text.find('\n') != std::string_view::npos) {
             return std::nullopt;
           }
           return Fact{"", "carriage returns, and no line feed", 1};
         },
         nullptr, "",
         "Write it with line feeds: tr '\\r' '\\n' < {} > NEW, and run `plumbline explain NEW`."},
    Kind{"bare-utf16", "a text in UTF-16 without a byte-order mark", Content::kContainer, IsBareUtf16,
         nullptr, "",
         "Write it as UTF-8: iconv -f UTF-16LE -t UTF-8 {} > NEW, and run `plumbline explain NEW`."},
};

}  // namespace

std::span<const Kind> BinaryKinds() {
  return kBinaryKinds;
}

}  // namespace plumbline::recognition
