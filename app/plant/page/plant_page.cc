#include "app/plant/page/plant_page.h"

#include <fmt/format.h>

#include <numeric>
#include <random>
#include <system_error>

#include "app/base/http/http_files.h"
#include "app/plant/answers/state_words.h"
#include "app/plant/page/plant_page_files.h"
#include "drivers/clock.h"

namespace plumbline::plant {
namespace {

constexpr double kBeat_s = 2;           ///< an unchanged wall is confirmed so often
constexpr double kStreamWait_s = 0.25;  ///< after which a stream sees that the program ends
constexpr std::size_t kMaxWords = 100;

std::span<const http::StaticFile> PlantPageFiles() {
  static const http::StaticFile kFiles[] = {
      {"/wall.js", plant_page_files::kScript, http::kScriptType},
      {"/page.css", plant_page_files::kStyle, http::kStyleType},
      {"/login.js", http::files::kLoginScript, http::kScriptType},
      {"/icon.svg", http::files::kIcon, http::kIconType},
  };
  return kFiles;
}

std::string NewStart() {
  std::random_device chance;
  return fmt::format("{:08x}", chance());
}

}  // namespace

PlantPage::PlantPage(PlantPageOptions options)
    : start_(NewStart()),
      access_({options.page.token, options.page.hosts,
               [log = options.log](const std::string& client) {
                 log(fmt::format("the page was asked with a wrong token by {}", client));
               }}),
      feed_(std::move(options.database), options.log) {}

Result<std::unique_ptr<PlantPage>> PlantPage::Start(PlantPageOptions options,
                                                    os::Descriptor listener, bool* faulty) {
  auto opened = listener
                    ? Result(os::TcpListener(std::move(listener)))
                    : os::TcpListener::Open(options.page.listen, options.page.port.value_or(0));
  if (!opened) return opened.failure();
  const os::TcpEndpoint at = opened.value().endpoint();
  if (const auto why = http::WhyExposed(at, options.page.token)) {
    if (faulty != nullptr) *faulty = true;
    return Error{*why};
  }
  std::unique_ptr<PlantPage> page(new PlantPage(std::move(options)));
  page->at_ = at;
  page->access_.SetPort(at.port);
  page->server_ = std::make_unique<http::HttpServer>(
      std::move(opened).value(), http::ConnectionLimits{},
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

std::uint64_t PlantPage::VersionOf(const http::HttpRequest& request) const {
  // A browser that connects again repeats the last event that it has seen.
  const std::string_view last = request.Header("last-event-id");
  return VersionFromText(last.empty() ? request.Parameter("since").value_or("") : last, start_);
}

void PlantPage::Answer(const http::HttpRequest& request, http::HttpResponse& response) {
  if (!access_.Admit(request, response)) return;
  if (http::AnswerFile(PlantPageFiles(), request.path, response)) return;
  if (request.path == "/") {
    AnswerWall(request, response);
  } else if (request.path == "/events") {
    AnswerEvents(request, response);
  } else if (request.path == "/update.json") {
    const auto newest = feed_.Get();
    response.SetBody(WallUpdateJson(*newest.wall, VersionOf(request), start_, newest.problem),
                     "application/json");
  } else if (request.path == "/status.json" || request.path == "/healthz") {
    const auto newest = feed_.Get();
    if (!newest.problem.empty() || newest.wall->version == 0) {
      response.Refuse(503, newest.problem.empty() ? "starting" : newest.problem);
    } else if (request.path == "/healthz") {
      response.SetBody("the plant's database answers\n", "text/plain; charset=utf-8");
    } else {
      response.SetBody(newest.wall->status, "application/json");
    }
  } else {
    response.Refuse(404, "not found");
  }
}

void PlantPage::AnswerWall(const http::HttpRequest& request, http::HttpResponse& response) const {
  WallSelection selection;
  selection.words = LowerCase(request.Parameter("q").value_or("").substr(0, kMaxWords));
  selection.state = request.Parameter("state").value_or("");
  selection.by_line = request.Parameter("lines").has_value();
  const auto newest = feed_.Await(0, 1);  // only the first viewer after the start waits
  response.SetBody(WallHtml(*newest.wall, selection, start_, newest.problem), http::kHtmlType);
}

void PlantPage::AnswerEvents(const http::HttpRequest& request, http::HttpResponse& response) {
  {
    const std::lock_guard lock(streams_mutex_);
    const int open = std::accumulate(streams_.begin(), streams_.end(), 0,
                                     [](int sum, const auto& peer) { return sum + peer.second; });
    if (open >= kMaxStreams || streams_[request.peer] >= kMaxStreamsPerPeer) {
      response.Refuse(503, "too many streams are open; ask for /update.json instead");
      return;
    }
    ++streams_[request.peer];
  }
  const std::shared_ptr<void> leaving(nullptr, [this, peer = request.peer](void*) {
    const std::lock_guard lock(streams_mutex_);
    if (--streams_[peer] == 0) streams_.erase(peer);
  });
  response.Set("Content-Type", "text/event-stream");
  response.stream = [this, leaving, seen = VersionOf(request), problem = std::string(),
                     sent_s = -1e300](const http::HttpWrite& write) mutable {
    const auto newest = feed_.Await(seen, kStreamWait_s);
    const bool changed = newest.wall->version != seen || newest.problem != problem;
    if (!changed && MonotonicSeconds() - sent_s < kBeat_s) return write("");
    const std::string update = WallUpdateJson(*newest.wall, seen, start_, newest.problem);
    seen = newest.wall->version;
    problem = newest.problem;
    sent_s = MonotonicSeconds();
    return write(fmt::format("id: {}-{}\ndata: {}\n\n", start_, seen, update));
  };
}

}  // namespace plumbline::plant
