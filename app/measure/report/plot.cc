#include "app/measure/report/plot.h"

#include <cmath>

namespace plumbline::plot {

std::string Begin(int width, int height) {
  return fmt::format(
      "reset\n"
      "set encoding utf8\nset minussign\n"
      "set terminal svg size {},{} dynamic noenhanced font 'Helvetica,12' linewidth 1\n"
      "set border 3 linecolor rgb '{}' linewidth 0.8\n"
      "set tics nomirror out scale 0.5 textcolor rgb '{}'\n"
      "set xlabel textcolor rgb '{}'\nset ylabel textcolor rgb '{}'\n"
      "set grid linecolor rgb '{}' linewidth 0.5 linetype 1\n"
      "unset key\nunset colorbox\n"
      "set palette defined (0 '#c4d3da', 0.4 '#2f8aa8', 1 '#06303f')\n",
      width, height, kGrey, kInk, kInk, kInk, "#edf0f2");
}

std::string Data(const std::string& name, const std::vector<std::vector<double>>& rows) {
  std::string text = "$" + name + " << EOD\n";
  for (const std::vector<double>& row : rows) {
    for (const double value : row) text += fmt::format("{:.6g} ", value);
    text += '\n';
  }
  return text + "EOD\n";
}

double RoundDown(double value) {
  if (!(value > 0) || !std::isfinite(value)) return 1;
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double digit = value / power;
  return power * (digit >= 5 ? 5 : digit >= 2 ? 2 : 1);
}

}  // namespace plumbline::plot
