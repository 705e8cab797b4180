// Fuzzer: a lens store file with arbitrary byte changes (three input bytes per change: position and
// value) or truncated: every lens is recovered from the file or its backup, or it is rejected with
// the remedy.
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "app/vision/lens_store/lens_store.h"
#include "tests/file_text.h"

namespace {

using namespace plumbline;  // NOLINT(google-build-using-namespace)

constexpr int kLenses = 3;

void Require(bool condition) {
  if (!condition) std::abort();
}

vision::LensEntry EntryOf(int number) {
  vision::LensEntry entry;
  entry.key = {"SN", "GREY 64x48@20", 1000 * number, 7};
  entry.lens = {1000.0 + number, 1001, 31.5, 23.5, -0.1, 0.05, 1e-5, -2e-5, 0};
  entry.covariance.diagonal().setConstant(1e-4);
  entry.size = {64, 48};
  entry.board = "chessboard 17x11, 10 mm";
  entry.utc = "2026-11-21T07:30:00Z";
  entry.corners.assign(40, static_cast<std::uint8_t>(number));
  return entry;
}

/// Temporary folder, removed by the destructor.
struct Place {
  std::string folder = (std::filesystem::temp_directory_path() / "lensesXXXXXX").string();
  std::string sound;
  Place() {
    Require(mkdtemp(folder.data()) != nullptr);
    {
      auto store = vision::LensStore::Open(path());
      Require(store.ok());
      for (int k = 0; k < kLenses; ++k) Require(store.value().Append(EntryOf(k)).ok());
    }
    sound = test::FileText(path());
  }
  ~Place() { std::filesystem::remove_all(folder); }
  std::string path() const { return folder + "/lenses.sqlite"; }
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const Place place;
  const bool backup = size % 3 != 1;
  std::string content = place.sound;
  for (std::size_t k = 0; k + 2 < size; k += 3) {
    content[(data[k] + 256U * data[k + 1]) % content.size()] = static_cast<char>(data[k + 2]);
  }
  if (size % 3 == 2) content.resize(content.size() * data[size - 1] / 256);
  for (const auto& file : std::filesystem::directory_iterator(place.folder)) {
    std::filesystem::remove(file.path());
  }
  std::ofstream(place.path(), std::ios::binary) << content;
  if (backup) std::ofstream(place.path() + ".backup", std::ios::binary) << place.sound;
  auto store = vision::LensStore::Open(place.path());
  if (!store) {
    Require(!store.error().empty());
    return 0;
  }
  const auto count = store.value().Count();
  if (content.empty() && count && *count == 0) return 0;  // same as a missing file
  const auto entries = store.value().All();
  Require(entries.ok() && entries->size() == kLenses);
  for (int k = 0; k < kLenses; ++k) {
    Require(vision::ChecksumOf((*entries)[static_cast<std::size_t>(k)]) ==
            vision::ChecksumOf(EntryOf(k)));
  }
  Require(store.value().Append(EntryOf(kLenses)).ok());
  return 0;
}
