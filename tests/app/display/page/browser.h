// Headless Chromium, driven through its debugging pipe
// [chromedevtools.github.io/devtools-protocol].
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <csignal>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "app/base/text/json_text.h"
#include "drivers/clock.h"
#include "tests/app/temporary_folder.h"

namespace plumbline::test {

/// Path of Chromium on Debian; nullopt if it is not installed.
inline std::optional<std::string> BrowserProgram() {
  for (const char* const path : {"/usr/bin/chromium", "/usr/bin/chromium-headless-shell"}) {
    if (access(path, X_OK) == 0) return path;
  }
  return std::nullopt;
}

class Browser {
 public:
  Browser(int width, int height, bool phone, bool dark) {
    int commands[2], answers[2];
    REQUIRE(pipe2(commands, O_CLOEXEC) == 0);
    REQUIRE(pipe2(answers, O_CLOEXEC) == 0);
    const std::string program = *BrowserProgram(), profile = "--user-data-dir=" + folder_.path();
    pid_ = fork();
    if (pid_ == 0) {
      setpgid(0, 0);
      const int from = fcntl(commands[0], F_DUPFD, 10), to = fcntl(answers[1], F_DUPFD, 10);
      dup2(from, 3);
      dup2(to, 4);
      const int null = open("/dev/null", O_RDWR);
      dup2(null, STDOUT_FILENO);
      dup2(null, STDERR_FILENO);
      execl(program.c_str(), program.c_str(), "--headless=new", "--no-sandbox", "--disable-gpu",
            "--disable-dev-shm-usage", "--no-first-run", "--disable-background-networking",
            "--remote-debugging-pipe", profile.c_str(), "about:blank", nullptr);
      _exit(127);
    }
    close(commands[0]);
    close(answers[1]);
    to_ = commands[1];
    from_ = answers[0];
    const auto target = Call("Target.createTarget", {{"url", "about:blank"}}).at("targetId");
    session_ =
        Call("Target.attachToTarget", {{"targetId", target}, {"flatten", true}}).at("sessionId");
    for (const char* const domain : {"Page.enable", "Runtime.enable", "Log.enable"}) Call(domain);
    Call("Emulation.setDeviceMetricsOverride",
         {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", phone}});
    Call("Emulation.setEmulatedMedia",
         {{"features", {{{"name", "prefers-color-scheme"}, {"value", dark ? "dark" : "light"}}}}});
  }
  ~Browser() {
    close(to_);
    close(from_);
    kill(-pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  nlohmann::json Call(const std::string& method,
                      const nlohmann::json& parameters = nlohmann::json::object()) {
    nlohmann::json command = {{"id", ++id_}, {"method", method}, {"params", parameters}};
    if (!session_.empty()) command["sessionId"] = session_;
    const std::string text = text::JsonText(command);
    REQUIRE(write(to_, text.c_str(), text.size() + 1) == static_cast<ssize_t>(text.size() + 1));
    for (;;) {
      const nlohmann::json message = Next();
      if (message.value("id", 0) != id_) continue;
      INFO(method << ": " << text::JsonText(message).substr(0, 500));
      REQUIRE(message.contains("result"));
      return message.at("result");
    }
  }
  void Open(const std::string& address) { Call("Page.navigate", {{"url", address}}); }

  /// Value of an expression in the page; null if it throws.
  nlohmann::json Evaluate(const std::string& expression) {
    const auto result =
        Call("Runtime.evaluate",
             {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
    return result.at("result").value("value", nlohmann::json());
  }
  /// Whether it becomes true within half a minute.
  bool Becomes(const std::string& expression) {
    for (const double end_s = MonotonicSeconds() + 30; MonotonicSeconds() < end_s;) {
      if (Evaluate(expression) == true) return true;
      SleepSeconds(0.05);
    }
    return false;
  }
  /// Errors logged by the page, including violations of its content security policy.
  const std::vector<std::string>& console_errors() const { return console_errors_; }

  /// Presses and releases a key. @param text  that it types
  void Press(const std::string& key, const std::string& text) {
    const int code = key == "Enter" ? 13 : key == "Escape" ? 27 : 0;
    for (const char* const type : {"keyDown", "keyUp"}) {
      Call("Input.dispatchKeyEvent", {{"type", type},
                                      {"key", key},
                                      {"text", std::string(type) == "keyDown" ? text : ""},
                                      {"windowsVirtualKeyCode", code}});
    }
  }

  /// Stores a screenshot for the manual if PLUMBLINE_KEEP_PICTURES names a folder.
  void Keep(const std::string& name, bool whole = false) {
    if (std::getenv("PLUMBLINE_KEEP_PICTURES") == nullptr) return;
    KeepText(name + ".base64",
             Call("Page.captureScreenshot",
                  {{"format", "jpeg"}, {"quality", 80}, {"captureBeyondViewport", whole}})
                 .at("data"));
  }
  /// Stores a text likewise.
  static void KeepText(const std::string& name, const std::string& text) {
    const char* const folder = std::getenv("PLUMBLINE_KEEP_PICTURES");
    if (folder != nullptr) std::ofstream(std::string(folder) + "/" + name) << text;
  }

 private:
  nlohmann::json Next() {
    const double end_s = MonotonicSeconds() + 60;
    std::size_t end = std::string::npos;
    while ((end = read_.find('\0')) == std::string::npos) {
      pollfd waiting{from_, POLLIN, 0};
      const double left_s = end_s - MonotonicSeconds();
      REQUIRE(left_s > 0);
      if (poll(&waiting, 1, static_cast<int>(1e3 * left_s)) <= 0) continue;
      char bytes[65536];
      const ssize_t n = read(from_, bytes, sizeof bytes);
      REQUIRE(n > 0);
      read_.append(bytes, static_cast<std::size_t>(n));
    }
    nlohmann::json message = text::JsonOrNull(read_.substr(0, end));
    read_.erase(0, end + 1);
    const std::string method = message.value("method", "");
    if (method == "Runtime.exceptionThrown" || method == "Log.entryAdded") {
      console_errors_.push_back(text::JsonText(message.at("params")));
    }
    return message;
  }

  TemporaryFolder folder_;
  pid_t pid_ = -1;
  int to_ = -1, from_ = -1, id_ = 0;
  std::string session_, read_;
  std::vector<std::string> console_errors_;
};

}  // namespace plumbline::test
