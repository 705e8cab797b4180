#include "app/display/view_process/alarm_pictures.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <filesystem>
#include <utility>
#include <vector>

#include "app/display/view_process/png_file.h"
#include "app/display/view_process/view_entries.h"

namespace plumbline::display {
namespace {

constexpr std::size_t kMaxJobs = 8;  ///< further alarms are logged, without pictures
constexpr int kPictureNice = 10;

std::string AlarmFileName(std::uint16_t alarms, double utc_s) {
  const double seconds = std::clamp(utc_s, 0.0, 253402300799.0);
  return fmt::format("alarm-{:%Y%m%dT%H%M%SZ}-{:04X}",
                     fmt::gmtime(static_cast<std::time_t>(seconds)), alarms);
}

bool IsOurs(const std::filesystem::path& file) {
  return file.extension() == ".png" && file.filename().string().rfind("alarm-", 0) == 0;
}

}  // namespace

AlarmPictures::AlarmPictures(std::string folder, AlarmPictureLimits limits, log::LogSink sink)
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

void AlarmPictures::Remember(display::RgbImage picture, double now_s) {
  remembered_s_ = now_s;
  if (Enqueue({std::move(picture), after_alarm_, ""})) after_alarm_ = false;
}

void AlarmPictures::Observe(std::uint16_t alarms, double utc_s) {
  const bool raised = (alarms & ~alarms_) != 0;
  alarms_ = alarms;
  // Alarms present in the first state were raised earlier, without a picture.
  if (!observed_) {
    observed_ = true;
    return;
  }
  if (!raised) return;
  if (Enqueue({{}, false, AlarmFileName(alarms, utc_s)})) after_alarm_ = true;
}

bool AlarmPictures::Enqueue(Job job) {
  {
    const std::lock_guard lock(mutex_);
    const auto only_remembered = [](const Job& one) {
      return one.name.empty() && !one.after_alarm;
    };
    // Of pictures without an alarm, only the last kBefore can ever be written.
    const auto last = std::find_if_not(jobs_.rbegin(), jobs_.rend(), only_remembered).base();
    if (only_remembered(job) && jobs_.end() - last >= static_cast<std::ptrdiff_t>(kBefore)) {
      jobs_.erase(last);
    }
    if (jobs_.size() < kMaxJobs) {
      jobs_.push_back(std::move(job));
      wake_.notify_one();
      return true;
    }
  }
  if (!job.name.empty()) {
    sink_(
        ViewFault("alarm without pictures: the previous alarms' pictures are still being stored"));
  }
  return false;
}

void AlarmPictures::DeleteOldest() const {
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
    Process(job);
  }
}

void AlarmPictures::Process(const Job& job) {
  if (!job.name.empty()) {
    name_ = job.name;
    number_ = 0;
    for (const std::string& png : remembered_) Write(png);
    remembered_.clear();
    return;
  }
  auto png = PngOf(job.picture, true);
  if (!png) {
    sink_(ViewFault("picture of an alarm not stored: " + png.error()));
    return;
  }
  if (job.after_alarm) Write(*png);
  remembered_.push_back(std::move(png).value());
  if (remembered_.size() > kBefore) remembered_.pop_front();
}

void AlarmPictures::Write(const std::string& png) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  DeleteOldest();
  const std::string file = fmt::format("{}/{}-{}.png", folder_, name_, ++number_);
  if (const auto written = WritePngBytes(file, png); !written) {
    sink_(ViewFault("picture of an alarm not stored: " + written.error()));
  } else if (number_ == 1) {  // one entry for all pictures of an alarm, or they bury the events
    sink_({log::Event::kAlarmPicture,
           "pictures of an alarm stored, the first in " + file,
           {{"FILE", file}}});
  }
}

}  // namespace plumbline::display
