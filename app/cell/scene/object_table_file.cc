#include "app/cell/scene/object_table_file.h"

#include <sys/stat.h>

#include "app/base/config/required_file.h"

namespace plumbline::cell {

FileStamp StampOfFile(const std::string& path) {
  struct stat about {};
  if (stat(path.c_str(), &about) != 0) return {};
  return {std::int64_t{about.st_mtim.tv_sec} * 1'000'000'000 + about.st_mtim.tv_nsec,
          static_cast<std::uint64_t>(about.st_size), about.st_ino, true};
}

std::optional<ObjectTableUpdate> ObjectTableFile::Poll() {
  const FileStamp now = StampOfFile(path_);
  const bool stable = !seen_ || now == *seen_;
  seen_ = now;
  if (!stable || (read_ && now == *read_)) return std::nullopt;
  read_ = now;
  ObjectTableUpdate news;
  const auto text = config::ReadRequiredFile(path_, news.faults);
  if (!text) return news;
  if (auto table = ObjectTableFromText(*text, path_, tags_, news.faults)) {
    table_ = std::move(table);
    news.accepted = true;
  }
  return news;
}

}  // namespace plumbline::cell
