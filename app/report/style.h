// Style sheet of the report, for screen, phone and print.
#pragma once

namespace plumbline::report {

inline constexpr const char* kReportStyle = R"css(
:root { --ink: #25313a; --soft: #5c6b75; --line: #dbe2e6; --accent: #0b6e8f; --tint: #f3f7f9; }
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0; color: var(--ink); background: #fff;
  font: 16px/1.5 system-ui, -apple-system, "Segoe UI", Roboto, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1040px; margin: 0 auto; padding: 40px 28px 64px; }
header p { margin: 0; color: var(--soft); }
h1 { font-size: 1.55rem; font-weight: 600; margin: 0 0 4px; line-height: 1.25; }
h2 { font-size: 1.12rem; font-weight: 600; margin: 48px 0 10px; padding-top: 14px;
  border-top: 1px solid var(--line); break-after: avoid; }
h3 { font-size: 1rem; font-weight: 600; margin: 24px 0 6px; break-after: avoid; }
p { margin: 0 0 12px; max-width: 74ch; }
ul { margin: 0 0 12px; padding-left: 20px; max-width: 74ch; }
.soft, figcaption, .legend { color: var(--soft); font-size: 0.875rem; }
.verdict { margin: 28px 0 22px; padding: 18px 22px; background: var(--tint);
  border-left: 4px solid var(--accent); }
.verdict p { margin: 0; }
.verdict .word { color: var(--accent); font-size: 0.8rem; font-weight: 600;
  letter-spacing: 0.06em; text-transform: uppercase; }
.verdict .headline { font-size: 1.3rem; line-height: 1.35; margin: 4px 0 6px; max-width: none; }
.keys { display: flex; flex-wrap: wrap; gap: 14px 40px; margin: 0 0 8px; }
.keys div { min-width: 120px; }
.keys dt { color: var(--soft); font-size: 0.8125rem; }
.keys dd { margin: 0; font-size: 1.35rem; font-variant-numeric: tabular-nums; }
.keys dd small { font-size: 0.8125rem; color: var(--soft); }
.table { overflow-x: auto; margin: 0 0 12px; }
table { border-collapse: collapse; font-size: 0.9rem; line-height: 1.4;
  font-variant-numeric: tabular-nums; }
th { text-align: left; font-weight: 600; color: var(--soft); font-size: 0.8125rem;
  border-bottom: 1px solid var(--ink); vertical-align: bottom; }
th, td { padding: 5px 18px 5px 0; }
td { border-bottom: 1px solid var(--line); vertical-align: top; }
th:last-child, td:last-child { padding-right: 0; }
.number { text-align: right; white-space: nowrap; }
.strong td { font-weight: 600; }
.heat td, .heat th { padding: 4px 6px; text-align: center; min-width: 46px; }
.heat th.name { text-align: left; white-space: nowrap; padding-right: 14px; color: var(--ink);
  border-bottom: 1px solid var(--line); font-weight: 400; }
figure { margin: 8px 0 20px; }
.panels { display: grid; gap: 14px 24px; grid-template-columns: repeat(auto-fit, minmax(min(100%, 400px), 1fr)); }
.panels.small { grid-template-columns: repeat(auto-fit, minmax(min(100%, 290px), 1fr)); }
.panel { break-inside: avoid; max-width: 500px; }
.panel p { margin: 0; font-size: 0.875rem; font-weight: 600; overflow-wrap: anywhere; }
.panel p.soft { font-size: 0.8125rem; font-weight: 400; }
.panel svg { display: block; width: 100%; height: auto; }
.panel svg text { font-family: system-ui, -apple-system, "Segoe UI", Roboto, Arial, sans-serif; }
figcaption { margin-top: 6px; max-width: 84ch; }
.legend { display: flex; align-items: center; gap: 8px; margin-top: 6px; }
.legend i { width: 140px; height: 8px;
  background: linear-gradient(90deg, #c4d3da, #2f8aa8 40%, #06303f);
  -webkit-print-color-adjust: exact; print-color-adjust: exact; }
.note { padding: 10px 14px; border: 1px solid var(--line); max-width: 74ch; }
footer { margin-top: 48px; padding-top: 12px; border-top: 1px solid var(--line);
  color: var(--soft); font-size: 0.8125rem; }
@media (max-width: 600px) {
  main { padding: 22px 16px 40px; }
  h1 { font-size: 1.3rem; }
  .verdict { padding: 14px 16px; }
  .verdict .headline { font-size: 1.12rem; }
  .keys { gap: 12px 28px; }
  table { font-size: 0.82rem; }
  th, td { padding-right: 10px; }
}
@media print {
  @page { margin: 16mm 14mm; }
  body { font-size: 10.5pt; }
  main { max-width: none; padding: 0; }
  h2 { margin-top: 24px; }
  .verdict, .heat td { -webkit-print-color-adjust: exact; print-color-adjust: exact; }
  .table { overflow: visible; }
  tr { break-inside: avoid; }
  .panels { grid-template-columns: repeat(2, 1fr); }
  .panels.small { grid-template-columns: repeat(3, 1fr); }
}
)css";

}  // namespace plumbline::report
