#include "app/view/alarm_pictures.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <vector>

#include "app/view/png_file.h"

namespace plumbline {
namespace {

constexpr std::size_t kMostWaiting = 8;  ///< pictures; alarms that come faster are told, not drawn
constexpr int kPictureNice = 10;

std::string NameOfAlarm(std::uint16_t alarms, double utc_s) {
  const double seconds = std::clamp(utc_s, 0.0, 253402300799.0);
  return fmt::format("alarm-{:%Y%m%dT%H%M%SZ}-{:04X}",
                     fmt::gmtime(static_cast<std::time_t>(seconds)), alarms);
}

bool IsOurs(const std::filesystem::path& file) {
  return file.extension() == ".png" && file.filename().string().rfind("alarm-", 0) == 0;
}

}  // namespace

AlarmPictures::AlarmPictures(std::string folder, AlarmPictureLimits limits, Sink sink)
    : folder_(std::move(folder)),
      limits_(limits),
      sink_(std::move(sink)),
      thread_([this] { Run(); }) {}

AlarmPictures::~AlarmPictures() {
  {
    const std::lock_guard lock(mutex_);
    end_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void AlarmPictures::Remember(RgbImage picture, double now_s) {
  remembered_s_ = now_s;
  if (after_alarm_) {
    after_alarm_ = false;
    Keep(picture);
  }
  remembered_.push_back(std::move(picture));
  if (remembered_.size() > kBefore) remembered_.pop_front();
}

void AlarmPictures::Observe(std::uint16_t alarms, double utc_s) {
  const bool raised = (alarms & ~alarms_) != 0;
  alarms_ = alarms;
  // What stands at the start was raised before anybody looked.
  if (!observed_) {
    observed_ = true;
    return;
  }
  if (!raised) return;
  name_ = NameOfAlarm(alarms, utc_s);
  number_ = 0;
  for (RgbImage& picture : remembered_) Keep(std::move(picture));
  remembered_.clear();
  after_alarm_ = true;
}

void AlarmPictures::Keep(RgbImage picture) {
  {
    const std::lock_guard lock(mutex_);
    if (jobs_.size() >= kMostWaiting) return;
    jobs_.push_back({fmt::format("{}/{}-{}.png", folder_, name_, ++number_), std::move(picture)});
  }
  wake_.notify_one();
}

void AlarmPictures::MakeRoom() const {
  struct File {
    std::filesystem::path path;
    std::uint64_t bytes;
  };
  std::vector<File> files;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder_, ignored)) {
    if (IsOurs(entry.path())) files.push_back({entry.path(), entry.file_size(ignored)});
  }
  std::sort(files.begin(), files.end(),
            [](const File& a, const File& b) { return a.path < b.path; });
  std::uint64_t bytes = 0;
  for (const File& file : files) bytes += file.bytes;
  for (std::size_t k = 0; k < files.size(); ++k) {
    if (files.size() - k < limits_.files && bytes <= limits_.bytes) return;
    std::filesystem::remove(files[k].path, ignored);
    bytes -= files[k].bytes;
  }
}

void AlarmPictures::Run() {
  setpriority(PRIO_PROCESS, static_cast<id_t>(syscall(SYS_gettid)), kPictureNice);
  for (;;) {
    Job job;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return end_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    std::error_code error;
    std::filesystem::create_directories(folder_, error);
    MakeRoom();
    if (const auto why = WritePng(job.name, job.picture, true)) {
      sink_(true, "picture of an alarm not kept: " + why->message);
    } else {
      sink_(false, "picture of an alarm kept: " + job.name);
    }
  }
}

}  // namespace plumbline
