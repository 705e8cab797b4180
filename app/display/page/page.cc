#include "app/display/page/page.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <set>
#include <string_view>
#include <system_error>

#include "app/base/http/http_files.h"
#include "app/base/text/json_text.h"
#include "app/display/page/page_files.h"
#include "app/display/page/report_name.h"
#include "app/display/page/residual_trend.h"
#include "app/display/page/status_json.h"
#include "drivers/clock.h"
#include "firmware-like/result.h"

namespace plumbline::display {
namespace {

/// True if a shell takes the word literally, and no program takes it for an option.
bool IsPlainWord(const std::string& word) {
  const auto is_plain = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
           std::string_view("@._:/-").find(c) != std::string_view::npos;
  };
  return !word.empty() && word.front() != '-' && std::all_of(word.begin(), word.end(), is_plain);
}

/// The name under which `plumbline cameras --choose` finds the camera. A serial number of a few
/// digits could be a place in its list, so the port is added.
std::string SelectorOf(const camera::V4l2Device& node,
                       const std::vector<camera::V4l2Device>& nodes) {
  constexpr std::size_t kLongestPlace = 4;
  if (node.port.empty()) return node.path;
  const std::string name = camera::StableName(node, nodes);
  const bool is_place =
      name.size() <= kLongestPlace && name.find_first_not_of("0123456789") == std::string::npos;
  return is_place ? camera::NameWithPort(node) : name;
}

}  // namespace

std::string CameraListJson(const std::vector<camera::V4l2Device>& nodes) {
  nlohmann::ordered_json json = {{"cameras", nlohmann::ordered_json::array()}};
  std::set<std::string> listed;
  for (const camera::V4l2Device& node : nodes) {
    const std::string select = SelectorOf(node, nodes);
    if (!listed.insert(select).second) continue;
    nlohmann::ordered_json command = nullptr;
    if (IsPlainWord(select)) command = "plumbline cameras --choose " + select;
    json["cameras"].push_back({{"name", node.name},
                               {"device", node.path},
                               {"select", select},
                               {"serial", node.serial},
                               {"port", node.port},
                               {"command", command}});
  }
  return text::JsonText(json);
}

namespace {

// Reports and alarm pictures in the state directory, for reading.

struct ReportFile {
  std::string name;  ///< as ReportKindOf() accepts it
  ReportKind kind = ReportKind::kNone;
  std::uint64_t bytes = 0;
  double utc_s = 0;  ///< time of the last change
};

/// Lists reports, newest first, at most kMaxReports of each kind. Unreadable files are left out.
constexpr std::size_t kMaxReports = 100;

/// Reads a regular file of at most kMaxReportBytes; follows no symbolic link.
/// @param name  untrusted
/// @return      its bytes, or why it cannot be read
constexpr std::size_t kMaxReportBytes = 32U << 20U;

namespace fs = std::filesystem;

/// Folder of a kind of report, below the state directory.
const char* FolderOf(ReportKind kind) {
  return kind == ReportKind::kModel       ? "/models"
         : kind == ReportKind::kDiagnosis ? "/diagnosis"
                                          : "/alarms";
}

/// File name of a report; differs from its name on the page for the newest diagnosis only.
std::string FileOf(ReportKind kind, const std::string& name) {
  return kind == ReportKind::kDiagnosis ? "report.html" : name;
}

void AddReports(const std::string& state_directory, ReportKind kind,
                std::vector<ReportFile>& reports) {
  std::vector<ReportFile> found;
  std::error_code error;
  for (fs::directory_iterator at(state_directory + FolderOf(kind), error), end; !error && at != end;
       at.increment(error)) {
    std::string name = at->path().filename().string();
    if (kind == ReportKind::kDiagnosis) {
      if (name != FileOf(kind, "")) continue;
      name = "diagnosis.html";
    }
    struct stat file {};
    if (ReportKindOf(name) != kind || lstat(at->path().c_str(), &file) != 0) continue;
    if (!S_ISREG(file.st_mode)) continue;
    found.push_back({name, kind, static_cast<std::uint64_t>(file.st_size),
                     static_cast<double>(file.st_mtim.tv_sec)});
  }
  // Names of one kind increase with time.
  std::sort(found.begin(), found.end(),
            [](const ReportFile& a, const ReportFile& b) { return a.name > b.name; });
  found.resize(std::min(found.size(), kMaxReports));
  reports.insert(reports.end(), found.begin(), found.end());
}

std::vector<ReportFile> ListReports(const std::string& state_directory) {
  std::vector<ReportFile> reports;
  for (const ReportKind kind :
       {ReportKind::kDiagnosis, ReportKind::kModel, ReportKind::kAlarmPicture}) {
    AddReports(state_directory, kind, reports);
  }
  return reports;
}

Result<std::string> ReadReport(const std::string& state_directory, const std::string& name) {
  const ReportKind kind = ReportKindOf(name);
  if (kind == ReportKind::kNone) return Error{"no such report"};
  const std::string path = state_directory + FolderOf(kind) + "/" + FileOf(kind, name);
  const os::Descriptor opened(open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  const int fd = opened.get();
  if (!opened) return Error{"no such report"};
  struct stat file {};
  std::string bytes;
  bool whole = false;
  if (fstat(fd, &file) == 0 && S_ISREG(file.st_mode) &&
      file.st_size <= static_cast<off_t>(kMaxReportBytes)) {
    bytes.resize(static_cast<std::size_t>(file.st_size));
    std::size_t got = 0;
    for (ssize_t n = 1; n > 0 && got<bytes.size(); got += n> 0 ? static_cast<std::size_t>(n) : 0) {
      n = read(fd, bytes.data() + got, bytes.size() - got);
    }
    whole = got == bytes.size();
  }
  if (!whole) {
    return Error{
        "the report cannot be read: it is being replaced or too large. Reload the list and try "
        "again"};
  }
  return bytes;
}

// Embedded files of the page by their paths, with their content types.

std::span<const http::StaticFile> Files() {
  static const http::StaticFile kFiles[] = {
      {"/", page_files::kPage, http::kHtmlType},
      {"/page.js", page_files::kScript, http::kScriptType},
      {"/trend.js", page_files::kTrendScript, http::kScriptType},
      {"/pictures.js", page_files::kPicturesScript, http::kScriptType},
      {"/cameras.js", page_files::kCamerasScript, http::kScriptType},
      {"/chart.js", page_files::kChartScript, http::kScriptType},
      {"/page.css", page_files::kStyle, http::kStyleType},
      {"/login.js", http::files::kLoginScript, http::kScriptType},
      {"/icon.svg", http::files::kIcon, http::kIconType},
  };
  return kFiles;
}

constexpr double kCachePeriod_s = 5;           ///< for the trend and the list of reports
constexpr double kPicturePollPeriod_s = 0.05;  ///< between checks for a newer picture
constexpr double kMaxPictureAge_s = 10;        ///< older pictures are not served as live
constexpr const char* kJson = "application/json";
constexpr const char* kMetricsText = "text/plain; version=0.0.4; charset=utf-8";
/// Reports have inline styles and drawings, and may not run any script.
constexpr const char* kReportPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; img-src data:; sandbox; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string NewStartId() {
  std::random_device chance;
  return fmt::format("{:08x}{:08x}", chance(), chance());
}

/// One part of the multipart stream: boundary, headers, picture.
std::string MultipartFrame(const JpegPicture& picture) {
  return fmt::format("--frame\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n\r\n",
                     picture.bytes.size()) +
         picture.bytes + "\r\n";
}

}  // namespace

std::string CachedText::Get(double now_s, double period_s,
                            const std::function<std::string()>& make) {
  const std::lock_guard lock(mutex_);
  if (now_s - made_s_ >= period_s) {
    text_ = make();
    made_s_ = now_s;
  }
  return text_;
}

Page::Page(PageOptions options, display::DisplayMailbox& shown, log::LogSink sink)
    : options_(std::move(options)),
      sink_(std::move(sink)),
      access_({options_.config.token, options_.config.hosts,
               [this](const std::string& client) {
                 sink_({log::Event::kPageRefused,
                        fmt::format("the page was asked with a wrong token by {}", client),
                        {{"CLIENT", client}}});
               }}),
      shown_(shown),
      feed_(shown),
      start_id_(NewStartId()) {}

Result<std::unique_ptr<Page>> Page::Start(PageOptions options, display::DisplayMailbox& shown,
                                          log::LogSink sink, os::Descriptor listener) {
  const config::PageConfig& config = options.config;
  auto opened = listener ? Result(os::TcpListener(std::move(listener)))
                         : os::TcpListener::Open(config.listen, config.port.value_or(0),
                                                 "a port below 1024 needs plumbline-view.socket");
  if (!opened) return opened.failure();
  const os::TcpEndpoint at = opened.value().endpoint();
  if (const auto why = http::WhyExposed(at, config.token)) return Error{*why};
  const http::ConnectionLimits limits = options.limits;
  std::unique_ptr<Page> page(new Page(std::move(options), shown, std::move(sink)));
  page->at_ = at;
  page->access_.SetPort(at.port);
  page->server_ = std::make_unique<http::HttpServer>(
      std::move(opened).value(), limits,
      [raw = page.get()](const http::HttpRequest& request, http::HttpResponse& response) {
        raw->Answer(request, response);
      });
  try {
    page->server_->Start();
  } catch (const std::system_error& error) {
    return Error{fmt::format("cannot start a thread: {}", error.what())};
  }
  return page;
}

void Page::Refuse(http::HttpResponse& response, int status, const std::string& why) {
  ++refused_;
  response.Refuse(status, why);
}

void Page::Answer(const http::HttpRequest& request, http::HttpResponse& response) {
  if (access_.Admit(request, response)) AnswerAuthorized(request, response);
}

void Page::AnswerAuthorized(const http::HttpRequest& request, http::HttpResponse& response) {
  constexpr std::string_view kReports = "/reports/";
  const double now_s = MonotonicSeconds();
  const std::string& path = request.path;
  if (http::AnswerFile(Files(), path, response)) return;
  if (path == "/status.json") {
    response.SetBody(Status(), kJson);
  } else if (path == "/metrics") {
    response.SetBody(MetricsResponse(now_s), kMetricsText);
  } else if (path == "/healthz") {
    AnswerHealth(response);
  } else if (path == "/trend.json") {
    response.SetBody(
        trend_.Get(
            now_s, kCachePeriod_s,
            [this] { return TrendJson(ReadTrend(options_.state_directory, options_.joints)); }),
        kJson);
  } else if (path == "/reports.json") {
    response.SetBody(reports_.Get(now_s, kCachePeriod_s, [this] { return Reports(); }), kJson);
  } else if (path == "/cameras.json") {
    response.SetBody(
        cameras_.Get(now_s, kCachePeriod_s,
                     [this] { return CameraListJson(camera::ListVideoNodes(options_.cameras)); }),
        kJson);
  } else if (path.starts_with(kReports)) {
    AnswerReport(path.substr(kReports.size()), response);
  } else if (path == "/live.mjpg") {
    AnswerLive(response);
  } else if (path == "/picture.jpg") {
    const auto picture = feed_.Newest(now_s);
    if (picture && now_s - shown_.picture_current_s() < kMaxPictureAge_s) {
      response.SetBody(picture->bytes, "image/jpeg");
    } else {
      Refuse(response, 503, "no current picture; try again");
    }
  } else {
    Refuse(response, 404, "not found");
  }
}

void Page::AnswerLive(http::HttpResponse& response) {
  if (viewers_.fetch_add(1) >= kMaxViewers) {
    --viewers_;
    Refuse(
        response, 503,
        fmt::format("at most {} viewers can watch the live picture; try again later", kMaxViewers));
    return;
  }
  const std::shared_ptr<void> leaving(nullptr, [this](void*) { --viewers_; });
  response.Set("Content-Type", "multipart/x-mixed-replace; boundary=frame");
  // The first picture is sent twice, since browsers display a part when the next one starts.
  response.stream = [this, leaving,
                     number = std::uint64_t{0}](const http::HttpWrite& write) mutable {
    const double now_s = MonotonicSeconds();
    const auto picture = feed_.Newest(now_s);
    const bool old = !picture || now_s - shown_.picture_current_s() > kMaxPictureAge_s;
    if (old || picture->number == number) {
      if (!write("")) return false;
      SleepSeconds(kPicturePollPeriod_s);
      return true;
    }
    const std::string part = MultipartFrame(*picture);
    if (number == 0 && !write(part)) return false;
    number = picture->number;
    return write(part);
  };
}

void Page::AnswerReport(const std::string& name, http::HttpResponse& response) const {
  const Result<std::string> bytes = ReadReport(options_.state_directory, name);
  if (!bytes) {
    response.Refuse(404, bytes.error());
    return;
  }
  response.Set("Content-Security-Policy", kReportPolicy);
  response.SetBody(*bytes,
                   ReportKindOf(name) == ReportKind::kAlarmPicture ? "image/png" : http::kHtmlType);
}

void Page::CollectLog() {
  auto now = shown_.status();
  if (!now || now == collected_) return;
  log_.Add(*now);
  collected_ = std::move(now);
}

std::string Page::Status() {
  const double now_s = MonotonicSeconds();
  const auto now = shown_.status();
  const auto picture = shown_.picture();
  if (now) log_.Add(*now);
  PictureFacts facts;
  if (picture) facts = {picture->image.size, now_s - shown_.picture_current_s(), ""};
  facts.server_start = start_id_;
  return StatusJson(now.get(), facts, log_.Lines(), now_s);
}

std::string Page::Reports() const {
  nlohmann::ordered_json json = {{"reports", nlohmann::ordered_json::array()}};
  for (const ReportFile& report : ListReports(options_.state_directory)) {
    const char* const kind = report.kind == ReportKind::kModel       ? "model"
                             : report.kind == ReportKind::kDiagnosis ? "diagnosis"
                                                                     : "alarm";
    json["reports"].push_back(
        {{"name", report.name}, {"kind", kind}, {"bytes", report.bytes}, {"utc_s", report.utc_s}});
  }
  return text::JsonText(json);
}

std::string Page::MetricsResponse(double now_s) const {
  PageCounts counts;
  counts.requests = access_.requests();
  counts.refused = access_.refused() + refused_ + server_->rejected();
  counts.connections = server_->connections();
  counts.viewers = viewers_;
  return MetricsText(shown_.status().get(), counts, now_s);
}

void Page::AnswerHealth(http::HttpResponse& response) const {
  const auto now = shown_.status();
  const bool well = DaemonReports(now.get(), MonotonicSeconds());
  if (well) {
    response.SetBody("plumblined is running\n", "text/plain; charset=utf-8");
  } else {
    response.Refuse(503, "no data from plumblined");
  }
}

}  // namespace plumbline::display
