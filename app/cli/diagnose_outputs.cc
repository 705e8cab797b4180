#include "app/cli/diagnose_outputs.h"

#include <fmt/format.h>

#include <ctime>
#include <filesystem>

#include "app/base/config/model_fingerprint.h"
#include "app/base/text/sha256.h"
#include "app/base/text/utc_text.h"
#include "app/cli/output_file.h"
#include "app/cli/same_file.h"
#include "app/measure/diagnosis/answer.h"
#include "app/measure/diagnosis/model_writer.h"
#include "app/measure/report/pdf.h"
#include "app/measure/report/report.h"
#include "app/measure/siblings/sibling_folder.h"
#include "app/version.h"
#include "drivers/files/text_file.h"

namespace plumbline::cli {
namespace {

namespace fs = std::filesystem;

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  char text[16];
  return {text, std::strftime(text, sizeof text, "%Y-%m-%d", &local)};
}

/// Path of the file for proposed poses; empty if none is to be written.
std::string NextPosesPath(const DiagnoseArguments& arguments) {
  if (!arguments.next_poses.empty()) return arguments.next_poses;
  if (arguments.json.empty() || arguments.json == "-") return "";
  std::error_code unknown;
  const bool special =
      fs::exists(arguments.json, unknown) && !fs::is_regular_file(arguments.json, unknown);
  return special ? "" : (fs::path(arguments.json).parent_path() / "next_poses.csv").string();
}

/// The reference to the poses file in the JSON file: only its name if both are in one folder.
std::string NameForJson(const std::string& poses, const std::string& json) {
  const fs::path path(poses);
  return path.parent_path() == fs::path(json).parent_path() ? path.filename().string() : poses;
}

/// Fingerprint of a valid cell's model; empty if the text cannot be parsed.
std::string FingerprintOf(const std::string& cell_text) {
  config::FaultList ignored;
  const config::TomlDocument document(cell_text, "", ignored);
  return document.parsed() ? config::ModelFingerprint(document) : "";
}

/// The corrected cell; empty, with the reason in `err`, if it would not be a valid one.
std::string CorrectedCell(const DiagnoseArguments& arguments, const DiagnoseInput& input,
                          const measure::Diagnosis& diagnosis, const measure::DataOrigin& origin,
                          std::ostream& err) {
  const auto model = measure::CorrectedCellText(input.cell_text, input.cell, diagnosis, origin);
  if (model) return *model;
  err << arguments.model
      << ": not written, because the corrected model would not be a valid cell. A residual or "
         "value this large indicates a mistake in the data (units, columns, another cell) "
         "rather than an effect:\n"
      << model.error();
  return "";
}

std::string ReportOf(const DiagnoseArguments& arguments, const DiagnoseInput& input,
                     const measure::Diagnosis& diagnosis, const measure::DataOrigin& origin,
                     const std::string& corrected_cell) {
  const measure::ReportSource source{
      fs::path(arguments.cell).filename().string(),
      origin.file,
      origin.rows,
      input.unreadable_lines,
      origin.date,
      PLUMBLINE_VERSION,
      text::TextFromUtc(static_cast<double>(std::time(nullptr))),
      text::Sha256Hex(input.cell_text),
      input.data_sha256,
      FingerprintOf(input.cell_text),
      corrected_cell.empty() ? std::string() : FingerprintOf(corrected_cell),
      arguments.certificate_details};
  return measure::ReportHtml(diagnosis, input.cell, source);
}

}  // namespace

bool CheckDiagnoseOutputs(const DiagnoseArguments& arguments, std::ostream& err) {
  const OutputPaths outputs = {{"--json", arguments.json},
                               {"--write-model", arguments.model},
                               {"--report", arguments.report},
                               {"--pdf", arguments.pdf},
                               {"--next-poses", NextPosesPath(arguments)}};
  std::vector<std::string> inputs = {arguments.cell, arguments.measured};
  for (const std::string& folder : arguments.siblings) {
    inputs.push_back(measure::CellFileOf(folder));
    inputs.push_back(measure::RowsFileOf(folder));
  }
  bool writable = !OverwritesFile("diagnose", outputs, inputs, err);
  for (const auto& [option, path] : outputs) {
    if (path.empty() || path == "-") continue;
    if (path != arguments.next_poses && option == std::string_view("--next-poses"))
      continue;  // beside --json
    if (const Result<void> can_write = files::CheckWritable(path); !can_write) {
      err << UnwritableText(path, can_write.error(), option);
      writable = false;
    }
  }
  if (arguments.pdf.empty()) return writable;
  const std::string why = measure::WhyNoPdf();
  if (!why.empty()) err << fmt::format("plumbline diagnose: --pdf: {}\n", why);
  return writable && why.empty();
}

std::vector<DiagnoseOutput> DiagnoseOutputs(const DiagnoseArguments& arguments,
                                            const DiagnoseInput& input,
                                            const measure::Diagnosis& diagnosis,
                                            std::ostream& err) {
  std::vector<DiagnoseOutput> outputs;
  const measure::DataOrigin origin{fs::path(arguments.measured).filename().string(),
                                   static_cast<int>(input.rows), Today()};
  std::string corrected_cell;
  if (!arguments.model.empty())
    corrected_cell = CorrectedCell(arguments, input, diagnosis, origin, err);
  if (!corrected_cell.empty())
    outputs.push_back({"--write-model", arguments.model, corrected_cell});
  if (!arguments.report.empty() || !arguments.pdf.empty()) {
    const std::string html = ReportOf(arguments, input, diagnosis, origin, corrected_cell);
    if (!arguments.report.empty()) outputs.push_back({"--report", arguments.report, html});
    if (!arguments.pdf.empty()) {
      const Result<std::string> pdf = measure::PdfFromHtml(html);
      if (pdf) {
        outputs.push_back({"--pdf", arguments.pdf, *pdf});
      } else {
        err << fmt::format("{}: not written: {}\n", arguments.pdf, pdf.error());
      }
    }
  }
  std::string poses = diagnosis.next_poses.empty() ? "" : NextPosesPath(arguments);
  if (!poses.empty()) {
    outputs.push_back({"--next-poses", poses, measure::NextPosesCsv(diagnosis, input.cell)});
    poses = NameForJson(poses, arguments.json);
  }
  if (!arguments.json.empty())
    outputs.push_back({"--json", arguments.json, measure::AnswerJson(diagnosis, poses)});
  return outputs;
}

bool WriteDiagnoseOutputs(const std::vector<DiagnoseOutput>& outputs, std::ostream& out,
                          std::ostream& err) {
  bool written = true;
  for (const DiagnoseOutput& output : outputs) {
    if (output.path == "-") {
      out << output.text << std::flush;
      continue;
    }
    const Result<void> result = files::WriteTextFile(output.path, output.text);
    if (result) continue;
    err << UnwritableText(output.path, result.error(), output.option);
    written = false;
  }
  return written;
}

}  // namespace plumbline::cli
