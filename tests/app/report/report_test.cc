// The report is well-formed, self-contained and escaped, and states why figures are missing.
#include "app/report/report.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "app/diagnosis/diagnosis_text.h"
#include "app/report/figures.h"
#include "app/report/html.h"
#include "app/report/sections.h"
#include "tests/app/diagnosis/example_diagnosis.h"

using namespace plumbline;

using namespace plumbline::report;
using test::ExampleCell;
using test::ExampleDiagnosis;

namespace {

namespace fs = std::filesystem;

const ReportSource kSource{"cell.toml", "measured.csv", 96, {7}, "2026-11-21", "0.1.0"};

std::string Report(const diagnosis::Diagnosis& diagnosis) {
  return ReportHtml(diagnosis, ExampleCell(), kSource);
}

bool Has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

std::size_t Count(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

bool HasGnuplot() {
  return DrawSvgs("").ok();
}

/// Temporary folder of this process.
class Folder {
 public:
  Folder() : path_(fs::temp_directory_path() / ("plumbline-report-" + std::to_string(getpid()))) {
    fs::create_directories(path_);
  }
  ~Folder() { fs::remove_all(path_); }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  std::string File(const std::string& name) const { return (path_ / name).string(); }

 private:
  fs::path path_;
};

// Checks that tags are closed in order, ids are unique, and references stay within the file.
constexpr const char* kChecker = R"python(
import sys
from html.parser import HTMLParser
void = {'meta', 'br', 'img', 'hr', 'link', 'input'}
class Checker(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.ids, self.uses, self.faults = [], set(), [], []
    def attributes(self, tag, attrs):
        if tag in ('script', 'link', 'iframe', 'object', 'img'): self.faults.append('tag ' + tag)
        for name, value in attrs:
            if name.startswith('on'): self.faults.append('handler ' + name)
            if name == 'id':
                if value in self.ids: self.faults.append('id twice: ' + value)
                self.ids.add(value)
            if name in ('href', 'src', 'xlink:href'):
                if not value.startswith('#'): self.faults.append('reference ' + value)
                self.uses.append(value[1:])
    def handle_starttag(self, tag, attrs):
        self.attributes(tag, attrs)
        if tag not in void: self.open.append(tag)
    def handle_startendtag(self, tag, attrs):
        self.attributes(tag, attrs)
    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag: self.faults.append('closes %s at %s' % (tag, self.getpos()))
text = open(sys.argv[1], encoding='utf-8').read()
checker = Checker()
checker.feed(text)
checker.close()
faults = checker.faults + ['open: ' + tag for tag in checker.open]
faults += ['no id ' + use for use in checker.uses if use not in checker.ids]
faults += ['address ' + word for word in ('http:', 'https:', '@import', 'url(//') if word in text]
print('\n'.join(faults[:20]))
sys.exit(1 if faults else 0)
)python";

}  // namespace

TEST_CASE("the report is well-formed and self-contained for every verdict") {
  const Folder folder;
  std::ofstream(folder.File("check.py")) << kChecker;
  for (const diagnosis::Verdict verdict :
       {diagnosis::Verdict::kNoEffect, diagnosis::Verdict::kExplained,
        diagnosis::Verdict::kAmbiguous, diagnosis::Verdict::kUnknown}) {
    CAPTURE(Describe(verdict));
    const std::string file = folder.File("report.html");
    std::ofstream(file) << Report(ExampleDiagnosis(verdict));
    const std::string command = "python3 '" + folder.File("check.py") + "' '" + file + "'";
    CHECK(std::system(command.c_str()) == 0);
  }
}

TEST_CASE("the checker itself finds faults") {
  const Folder folder;
  std::ofstream(folder.File("check.py")) << kChecker;
  for (const char* bad : {"<p><b>x</p>", "<p id=\"a\"></p><p id=\"a\"></p>", "<a href=\"#b\"></a>",
                          "<a href=\"http://example.org\"></a>", "<script></script>"}) {
    CAPTURE(bad);
    std::ofstream(folder.File("bad.html")) << bad;
    const std::string command =
        "python3 '" + folder.File("check.py") + "' '" + folder.File("bad.html") + "' > /dev/null";
    CHECK(std::system(command.c_str()) != 0);
  }
}

TEST_CASE("the report has the sections that belong to its verdict") {
  struct Case {
    diagnosis::Verdict verdict;
    std::vector<std::string> says, does_not_say;
  };
  const Case cases[] = {
      {diagnosis::Verdict::kNoEffect,
       {"No effect detected above the noise of 0.087 mm", "Detection limits"},
       {"Effects found", "What to measure next", "Held out, corrected"}},
      {diagnosis::Verdict::kExplained,
       {"Joint compliance on axes 2 and 3 (93 % of the residual) and thermal growth (6 %)",
        "5.100&thinsp;&times;&thinsp;10<sup>&minus;7</sup>", "Correlation", "Held out, corrected"},
       {"Alternative explanations"}},
      {diagnosis::Verdict::kAmbiguous,
       {"Tool stiffness or payload mass: these points cannot distinguish them; 6 further poses "
        "would",
        "Alternative explanations", "What to measure next"},
       {"Correlation of"}},
      {diagnosis::Verdict::kUnknown,
       {"an effect outside the catalogue that follows air_pressure_bar",
        "that part is not corrected"},
       {"What to measure next"}}};
  for (const Case& c : cases) {
    CAPTURE(Describe(c.verdict));
    const std::string html = Report(ExampleDiagnosis(c.verdict));
    for (const std::string& part : c.says) {
      CAPTURE(part);
      CHECK(Has(html, part));
    }
    for (const std::string& part : c.does_not_say) {
      CAPTURE(part);
      CHECK_FALSE(Has(html, part));
    }
    for (const char* always : {"measured.csv", "2026-11-21", "Effects considered", "Outliers",
                               "<td class=\"number\">54</td>", "latency cannot be seen"}) {
      CAPTURE(always);
      CHECK(Has(html, always));
    }
  }
}

TEST_CASE("the report has figures if gnuplot is installed") {
  if (!HasGnuplot()) {
    WARN("SKIPPED: gnuplot is not installed (Debian package gnuplot-nox)");
    return;
  }
  const std::string html = Report(ExampleDiagnosis(diagnosis::Verdict::kAmbiguous));
  CHECK_FALSE(Has(html, "no figures"));
  // 4 to 6 residual panels, 10 signals, 6 joints, 2 for the poses, 2 for the rival.
  CHECK(Count(html, "<svg") >= 24);
  CHECK(Has(html, "aria-label=\"air_pressure_bar\""));
}

TEST_CASE("without gnuplot the report has its tables and a note") {
  GnuplotOptions absent;
  absent.program = "gnuplot-that-is-not-installed";
  const std::string html =
      ReportHtml(ExampleDiagnosis(diagnosis::Verdict::kExplained), ExampleCell(), kSource, absent);
  CHECK(Has(html, "no figures"));
  CHECK(Has(html, "gnuplot-nox"));
  CHECK_FALSE(Has(html, "<svg"));
  CHECK_FALSE(Has(html, "<h2>Residuals in the cell"));
  CHECK(Has(html, "Held out, corrected model"));
}

TEST_CASE("failures of gnuplot are reported") {
  const Folder folder;
  struct Case {
    const char* script;
    const char* says;
  };
  const Case cases[] = {{"#!/bin/sh\ncat > /dev/null; echo broken >&2; exit 3\n", "broken"},
                        {"#!/bin/sh\nexec sleep 60\n", "did not end within 0.7 s"},
                        {"#!/bin/sh\nexec < /dev/null; echo '<svg></svg>'\n", ""}};
  for (const Case& c : cases) {
    CAPTURE(c.script);
    GnuplotOptions options;
    options.program = folder.File("gnuplot");
    options.limit = std::chrono::milliseconds(700);
    std::ofstream(options.program) << c.script;
    fs::permissions(options.program, fs::perms::owner_all);
    // Larger than a pipe's buffer: a child that does not read must not block the writer.
    const auto drawn = DrawSvgs(std::string(300000, '#'), options);
    CHECK(drawn.ok() == std::string(c.says).empty());
    if (!drawn) CHECK(Has(drawn.error(), c.says));
    fs::remove(options.program);
  }
}

TEST_CASE("texts from files are escaped, in HTML and in gnuplot") {
  const Folder folder;
  const std::string trace = folder.File("trace");
  diagnosis::Diagnosis diagnosis = ExampleDiagnosis(diagnosis::Verdict::kUnknown);
  const std::string evil[] = {
      "<script>alert(1)</script>",           "\"&'",         "`touch " + trace + "`",
      "'; system('touch " + trace + "'); '", "@x\nplot 1\n", "\xff\xfe_%s{}"};
  for (std::size_t k = 0; k < std::size(evil); ++k) diagnosis.signals[k].name = evil[k];
  diagnosis.drivers = {evil[0], evil[5]};
  diagnosis.notes = {evil[0]};
  diagnosis.not_recorded = {evil[1]};
  diagnosis.considered[0].reason = evil[0];
  diagnosis.rows[diagnosis::RowIndex(15)].session = evil[0];
  diagnosis.held_out_by = evil[1];
  model::CellModel cell = ExampleCell();
  cell.robot.name = "</title>" + evil[0];
  ReportSource source = kSource;
  source.cell_file = source.data_file = evil[0];
  const std::string html = ReportHtml(diagnosis, cell, source);
  CHECK_FALSE(Has(html, "<script"));
  CHECK(Count(html, "</title>") == 1);
  CHECK(Has(html, "&lt;script&gt;alert(1)&lt;/script&gt;"));
  CHECK(ValidUtf8(html) == html);
  CHECK_FALSE(fs::exists(trace));
  if (HasGnuplot()) CHECK_FALSE(Has(html, "no figures"));
}

TEST_CASE("an effect that no listed explanation contains has a lower bound as its gap, or none") {
  diagnosis::Diagnosis diagnosis = ExampleDiagnosis(diagnosis::Verdict::kExplained);
  diagnosis::Considered& last = diagnosis.considered.emplace_back();
  last.id = "latency";
  last.chi2_drop = 5;
  last.evidence_gap = 123;
  last.gap_is_lower_bound = true;
  CHECK(Has(Report(diagnosis), "&gt; 123"));
  const std::size_t zeros = Count(Report(diagnosis), ">0.0<");
  diagnosis.considered.back().evidence_gap = 0;
  diagnosis.considered.back().gap_is_lower_bound = false;
  CHECK_FALSE(Has(Report(diagnosis), "&gt; 123"));
  CHECK(Count(Report(diagnosis), ">0.0<") == zeros);
}

TEST_CASE("figures and numbers belong to the right rows if only some rows were searched") {
  // 3000 rows, of which every second one took part in the search and was held out.
  diagnosis::Diagnosis diagnosis = ExampleDiagnosis(diagnosis::Verdict::kAmbiguous);
  const diagnosis::RowTrace row = diagnosis.rows.front();
  diagnosis.rows.assign(3000, row);
  diagnosis.outlier_rows.clear();
  diagnosis::SignalTrace signal{"k", {}, 0.01, 0.5};
  diagnosis::Rival& rival = diagnosis.rivals.front();
  rival.shift_W.clear();
  rival.rows.clear();
  for (std::size_t k = 0; k < diagnosis.rows.size(); ++k) {
    diagnosis::RowTrace& of = diagnosis.rows[diagnosis::RowIndex(k)];
    signal.values.push_back(static_cast<double>(k));
    of.before = Vec3(0, 0, 1e-6 * static_cast<double>(k));
    of.after = 0.5 * of.before;
    of.held_out_before.reset();
    of.held_out_after.reset();
    if (k % 2 == 1) continue;
    of.fold = 0;
    of.held_out_before = Vec3(4e-3, 0, 0);
    of.held_out_after = Vec3(k == 2000 ? 9e-3 : 3e-3, 0, 0);
    rival.rows.emplace_back(k);
    rival.shift_W.emplace_back(0, 0, 1e-6 * static_cast<double>(k));
  }
  diagnosis.rows[diagnosis::RowIndex(2000)].weight = 0.3;  // low enough to count as an outlier
  diagnosis.rows[diagnosis::RowIndex(2000)].outlier = true;
  diagnosis.outlier_rows = {2002};
  diagnosis.signals = {signal};

  const std::string panel = SignalFigures(diagnosis).panels.at(0).script;
  // Of 2999 rows every fourth is drawn: value, before and after [mm].
  CHECK(Has(panel, "\n1200 1.2 0.6 \n"));
  CHECK(Has(panel, "\n2997 2.997 1.4985 \n"));
  CHECK_FALSE(Has(panel, "\n2000 "));
  const PanelGroup pictures = RivalFigures(diagnosis, rival, ExampleCell());
  REQUIRE(pictures.panels.size() == 2);
  CHECK(Has(pictures.panels[0].script, "\n2001 2 \n"));

  const std::string table = ErrorTable(diagnosis);
  const auto held_out = table.find("Held out, corrected model");
  REQUIRE(held_out != std::string::npos);
  // Median, 95th percentile and maximum exclude rows that were not held out, and the outlier.
  const std::string of_row = table.substr(held_out, table.find("</tr>", held_out) - held_out);
  CHECK(Count(of_row, diagnosis::MillimetreText(3e-3)) == 3);
  CHECK_FALSE(Has(of_row, diagnosis::MillimetreText(9e-3)));
  CHECK(Has(table, "1500 of 3000 rows"));
}

TEST_CASE("an empty diagnosis, a single row and NaN still give a report") {
  CHECK(Has(Report(diagnosis::Diagnosis{}), "</html>"));
  diagnosis::Diagnosis one = ExampleDiagnosis(diagnosis::Verdict::kExplained);
  one.rows.resize(1);
  for (diagnosis::SignalTrace& signal : one.signals) signal.values.resize(1);
  one.rows.front().after = Vec3::Constant(std::nan(""));
  one.held_out.after_m = std::nan("");
  one.findings[0].covariance.setConstant(std::nan(""));
  const std::string html = Report(one);
  CHECK(Has(html, "</html>"));
  CHECK(Has(html, "unknown"));
}

TEST_CASE("texts and numbers are formatted for HTML") {
  CHECK(Escape("a<b>&\"'\x01") == "a&lt;b&gt;&amp;&quot;&#39; ");
  CHECK(ValidUtf8("\xC3\xA4\xC3") == "\xC3\xA4\xEF\xBF\xBD");
  CHECK(ValidUtf8("\xED\xA0\x80") == "\xEF\xBF\xBD\xEF\xBF\xBD\xEF\xBF\xBD");
  CHECK(NumberHtml("-1.5e-07") == "&minus;1.5&thinsp;&times;&thinsp;10<sup>&minus;7</sup>");
  CHECK(NumberHtml("2e+10") == "2&thinsp;&times;&thinsp;10<sup>10</sup>");
  CHECK(NumberHtml("-0.180") == "&minus;0.180");
  CHECK(NumberHtml("none") == "none");
  CHECK(GnuplotQuoted("it's\n`x`") == "'it\u2019s `x`'");
}
