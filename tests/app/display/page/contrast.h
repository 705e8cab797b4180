// Contrast of a page in the browser.
#pragma once

namespace plumbline::test {

/// Lowest contrast of all visible texts against their background [WCAG 2.1, 1.4.3].
inline constexpr const char* kLeastContrast = R"((() => {
  const parts = (text) => text.match(/[\d.]+/g).map(Number);
  const light = (c) => { const l = c.slice(0, 3).map((v) => v / 255)
    .map((v) => v <= 0.03928 ? v / 12.92 : Math.pow((v + 0.055) / 1.055, 2.4));
    return 0.2126 * l[0] + 0.7152 * l[1] + 0.0722 * l[2]; };
  const under = (e) => { for (; e; e = e.parentElement) {
    const c = parts(getComputedStyle(e).backgroundColor); if (c.length < 4 || c[3] > 0) return c; }
    return [255, 255, 255]; };
  let least = 99;
  for (const e of document.querySelectorAll("h1, h2, p, li, figcaption, a, footer, label, .mark")) {
    if (!e.innerText || !e.offsetParent) continue;
    const a = light(parts(getComputedStyle(e).color)), b = light(under(e));
    least = Math.min(least, (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05));
  }
  return least; })())";

}  // namespace plumbline::test
