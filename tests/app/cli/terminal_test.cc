// Wrapped lines, colours and progress on a terminal.
#include <algorithm>
#include <catch2/catch.hpp>
#include <sstream>
#include <string>

#include "app/base/terminal/terminal_output.h"
#include "app/cli/progress.h"

namespace plumbline::terminal_test {

using plumbline::cli::Progress;
using plumbline::terminal::ColumnsOf;
using plumbline::terminal::ForReading;
using plumbline::terminal::Painted;
using plumbline::terminal::PrintExactly;
using plumbline::terminal::ReplacedLine;
using plumbline::terminal::Shown;
using plumbline::terminal::ShowsColours;
using plumbline::terminal::TerminalOutput;
using plumbline::terminal::Tone;
using plumbline::terminal::WrappedLine;
using plumbline::terminal::WrappedParagraph;

TEST_CASE("a long line is wrapped at spaces, with a hanging indent") {
  CHECK(WrappedLine("short", 20) == "short");
  CHECK(WrappedLine("one two three four five", 12) == "one two\n  three four\n  five");
  CHECK(WrappedLine("  one two three four", 12) == "  one two\n    three\n    four");
  CHECK(WrappedLine("robot   trusted, 4 ms old, polled", 20) ==
        "robot   trusted, 4\n        ms old,\n        polled");
  CHECK(WrappedLine("warning  clock  not synchronised, fix it", 28) ==
        "warning  clock  not\n                synchronised,\n                fix it");
  CHECK(WrappedLine("one /a/path/that/is/too/long two", 12) ==
        "one\n  /a/path/that/is/too/long\n  two");
}

TEST_CASE("a row of numbers wider than the terminal is not wrapped") {
  const std::string row = "   1   1951.122   -1111.344   885.952   0.554";
  CHECK(WrappedLine(row, 30) == row);
}

TEST_CASE("colours and multibyte characters count as what they occupy") {
  CHECK(ColumnsOf("\xC2\xB1"
                  "1.3 mm") == 7);
  CHECK(ColumnsOf(Painted("warning", Tone::kWarning, true)) == 7);
  CHECK(Painted("warning", Tone::kWarning, false) == "warning");
  const std::string line = Painted("FAULT", Tone::kFault, true) + "    robot refused";
  CHECK(WrappedLine(line, 22) == line);
}

TEST_CASE("a paragraph ignores line feeds") {
  CHECK(WrappedParagraph("one two\nthree four", 10, 0) == "one two\nthree four");
  CHECK(WrappedParagraph("one two\nthree four", 13, 0) == "one two three\nfour");
  CHECK(WrappedParagraph("one two three", 8, 3) == "one two\n   three");
}

TEST_CASE("a terminal gets wrapped text; machine formats, files and pipes are unchanged") {
  const std::string line = "one two three four five\n";
  std::ostringstream pipe, json, terminal;
  {
    const terminal::TerminalOutput to_pipe(pipe, 0, false), to_json(json, 12, true),
        to_terminal(terminal, 12, true);
    pipe << terminal::ForReading << line;
    json << line;
    terminal << terminal::ForReading << "one two " << std::flush << "three four five\n";
    CHECK_FALSE(terminal::ShowsColours(pipe));
    CHECK(terminal::ShowsColours(terminal));
    terminal << ReplacedLine() << " 50 %  a step with a long name" << std::flush << ReplacedLine()
             << std::flush;
    terminal << "no line feed at the end";
  }
  CHECK(pipe.str() == line);
  CHECK(json.str() == line);
  CHECK(terminal.str() ==
        "one two\n  three four\n  five\n\r\033[K 50 %  a step with a long name\r\033[K"
        "no line feed at the end");
}

TEST_CASE("only our own colours reach a terminal: those of a file are visible text") {
  const std::string hostile =
      "\033[31mred\033]0;title\a\r\x9b"
      "2J\xC2\x9b"
      "2J";
  const std::string shown = "\\u001b[31mred\\u001b]0;title\\u0007\\u000d\\x9b2J\\u009b2J";
  std::ostringstream terminal, pipe;
  {
    const terminal::TerminalOutput to_terminal(terminal, 80, true), to_pipe(pipe, 0, false);
    terminal << Painted("bad", Tone::kFault, true) << ' ' << hostile << '\n';
    terminal::PrintExactly(terminal, hostile);
    pipe << hostile << '\n';
    terminal::PrintExactly(pipe, hostile);
  }
  CHECK(terminal.str() == "\033[31mbad\033[0m " + shown + "\n" + shown);
  CHECK(pipe.str() == shown + "\n" + hostile);
  CHECK(Shown("\033[12345678901234567890;31mguess") == "\\u001b[12345678901234567890;31mguess");
}

TEST_CASE(
    "progress elsewhere: nothing for two seconds, then a line every ten per cent with the time "
    "left") {
  std::ostringstream err;
  double now_s = 100;
  {
    Progress progress(err, {.clock_s = [&] { return now_s; }});
    for (std::size_t done = 0; done <= 50000; done += 64) {
      now_s = 100 + 1e-4 * static_cast<double>(done);  // 5 s in all
      progress.ShowCount(done, 50000, "poses");
    }
  }
  const std::string text = err.str();
  CHECK_THAT(text, Catch::StartsWith(" 40 %  20032 of 50000 poses, 3 s left\n 50 %  "));
  CHECK_THAT(text, Catch::EndsWith(" 90 %  45056 of 50000 poses, 1 s left\n"));
  CHECK(std::count(text.begin(), text.end(), '\n') == 6);
}

TEST_CASE("progress on a terminal: one line with the time left, erased at the end") {
  std::ostringstream err;
  double now_s = 0;
  {
    Progress progress(
        err, {.columns = 30, .quiet = false, .update_s = 1e6, .clock_s = [&] { return now_s; }});
    progress.Show(0, "reading");
    now_s = 300;
    progress.Show(0.5, "fitting all rows, pass 2");
    progress.Clear();
    progress.Show(0.6, "too late");
  }
  CHECK(Shown(err.str()) == "\r\033[K 50 %  fitting all rows, pass\r\033[K");
}

TEST_CASE("progress on a terminal updates the time left between two steps") {
  std::ostringstream err;
  double now_s = 10;
  Progress progress(err, {.columns = 80, .quiet = false, .update_s = 0.01, .clock_s = [&] {
                            return now_s += 10;
                          }});
  progress.Show(0.5, "fitting");
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  progress.Clear();
  CHECK_THAT(err.str(), Catch::Contains(", 20 s left") && Catch::Contains(", 40 s left"));
}

TEST_CASE("quiet progress prints nothing") {
  std::ostringstream err;
  {
    Progress progress(err, {.columns = 80, .quiet = true, .clock_s = {}});
    progress.Show(0.5, "fitting");
  }
  CHECK(err.str().empty());
}

}  // namespace plumbline::terminal_test
