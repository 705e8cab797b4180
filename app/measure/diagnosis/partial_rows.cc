#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "app/measure/diagnosis/diagnose.h"
#include "app/measure/table/conditions.h"

namespace plumbline::measure {
namespace {

const char* NameOf(effects::Signal signal) {
  switch (signal) {
    case effects::Signal::kOrder:
      return "the robot's last move";
    case effects::Signal::kVelocity:
      return "qd";
    case effects::Signal::kAcceleration:
      return "qdd";
    default:
      return "a signal";
  }
}

void AddLacked(effects::Signal signal, std::vector<std::size_t> rows,
               std::vector<MissingSignal>& lacked) {
  if (!rows.empty()) lacked.push_back({signal, std::move(rows)});
}

bool EffectNeeds(const Finding& finding, effects::Signal signal) {
  const effects::EffectTraits& traits = finding.effect.term.effect->traits();
  if (traits.Needs(signal)) return true;
  return std::ranges::any_of(traits.word_needs, [&](const effects::VariantSignal& need) {
    return need.signal == signal && need.word == finding.effect.term.word;
  });
}

/// Treats a signal that most rows lack as not recorded.
void DropSignal(const MissingSignal& lacked, MeasuredTable& table) {
  if (lacked.signal == effects::Signal::kOrder) table.recorded.order = false;
  if (lacked.signal == effects::Signal::kVelocity) table.recorded.qd = false;
  if (lacked.signal == effects::Signal::kAcceleration) table.recorded.qdd = false;
  table.notes.push_back(
      fmt::format("{} is missing in {} of {} rows: effects that depend on it are not considered",
                  NameOf(lacked.signal), lacked.rows.size(), table.rows.size()));
}

std::vector<std::size_t> RowsOf(const std::vector<MissingSignal>& lacked) {
  std::set<std::size_t> rows;
  for (const MissingSignal& one : lacked) rows.insert(one.rows.begin(), one.rows.end());
  return {rows.begin(), rows.end()};
}

/// The options with progress scaled to the interval from..from + share.
DiagnosisOptions WithProgress(const DiagnosisOptions& options, double from, double share) {
  DiagnosisOptions part = options;
  if (options.progress) {
    part.progress = [&options, from, share](double done, const std::string& what) {
      options.progress(from + share * done, what);
    };
  }
  return part;
}

/// The answer from the complete rows, with a note on the excluded ones.
Diagnosis WithNotes(Diagnosis diagnosis, const MeasuredTable& table,
                    const std::vector<MissingSignal>& lacked) {
  for (const MissingSignal& one : lacked) {
    diagnosis.notes.push_back(fmt::format(
        "{} is missing in {} rows (first: line {}): these rows were excluded, because the "
        "answer contains an effect that depends on it",
        NameOf(one.signal), one.rows.size(), table.rows[one.rows.front()].line));
  }
  return diagnosis;
}

}  // namespace

std::vector<MissingSignal> LackedSignals(const model::CellModel& cell, const MeasuredTable& table) {
  std::vector<std::size_t> moves, velocities, accelerations;
  std::set<std::string> seen;
  const std::vector<effects::Conditions> conditions = ConditionsOf(cell, table);
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    const MeasuredRow& row = table.rows[k];
    const bool first = seen.insert(row.session).second;
    if (!first && conditions[k].last_move.size() == 0) moves.push_back(k);
    if (row.qd.size() == 0) velocities.push_back(k);
    if (row.qdd.size() == 0) accelerations.push_back(k);
  }
  std::vector<MissingSignal> lacked;
  if (table.recorded.order) AddLacked(effects::Signal::kOrder, moves, lacked);
  if (table.recorded.qd) AddLacked(effects::Signal::kVelocity, velocities, lacked);
  if (table.recorded.qdd) AddLacked(effects::Signal::kAcceleration, accelerations, lacked);
  return lacked;
}

MeasuredTable ExcludeRows(const MeasuredTable& table, const std::vector<std::size_t>& rows) {
  MeasuredTable without = table;
  without.rows.clear();
  for (std::size_t k = 0; k < table.rows.size(); ++k) {
    const bool set_aside = std::binary_search(rows.begin(), rows.end(), k);
    (set_aside ? without.unmeasured : without.rows).push_back(table.rows[k]);
  }
  std::ranges::stable_sort(without.unmeasured, [](const MeasuredRow& a, const MeasuredRow& b) {
    return a.line < b.line;
  });
  return without;
}

bool DependsOn(const Diagnosis& diagnosis, const std::vector<MissingSignal>& lacked) {
  const auto needs = [&](const Finding& finding) {
    return std::ranges::any_of(
        lacked, [&](const MissingSignal& one) { return EffectNeeds(finding, one.signal); });
  };
  return std::ranges::any_of(diagnosis.findings, needs) ||
         std::ranges::any_of(diagnosis.discrepancy, needs);
}

Result<Diagnosis> Diagnose(const model::CellModel& cell, MeasuredTable table,
                           const DiagnosisOptions& options) {
  if (options.order_unknown) table.recorded.order = false;
  std::vector<MissingSignal> lacked = LackedSignals(cell, table);
  std::erase_if(lacked, [&](const MissingSignal& one) {
    const bool most = 2 * one.rows.size() > table.rows.size();
    if (most) DropSignal(one, table);
    return most;
  });
  if (lacked.empty()) return DiagnoseRows(cell, table, options);
  const Result<Diagnosis> complete =
      DiagnoseRows(cell, ExcludeRows(table, RowsOf(lacked)), WithProgress(options, 0, 0.5));
  if (complete && DependsOn(*complete, lacked)) return WithNotes(*complete, table, lacked);
  if (options.interrupted && options.interrupted()) return Error{"interrupted"};
  // No effect depends on the missing signals, so the incomplete rows can take part.
  Result<Diagnosis> all = DiagnoseRows(cell, table, WithProgress(options, 0.5, 0.5));
  if (complete && (!all || DependsOn(*all, lacked))) return WithNotes(*complete, table, lacked);
  return all;
}

}  // namespace plumbline::measure
