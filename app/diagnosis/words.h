// A diagnosis in words: what terminal and report say alike.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/diagnosis/diagnosis.h"

namespace plumbline {

/// An effect as a reader calls it: "joint compliance".
std::string EffectName(std::string_view id);

/// "joint compliance on axes 2 and 3"; without the axes where there is no scope.
std::string EffectName(std::string_view id, const std::vector<std::string>& scope);
/// "backlash on axis 2 (load)", "a step at one moment (base)": with the word, where it has one.
std::string EffectName(std::string_view id, std::string_view word,
                       const std::vector<std::string>& scope);
std::string EffectName(const Finding& finding);

/// What an empirical term does for each unit of its signal, where its curve is straight to within a
/// twentieth of its rise: "a straight line: the base moves 73.5 mm per bar (x 43.0, y 49.4, z
/// -33.3)". Empty of a curve, of two signals, and of effects of the catalogue.
std::string LineText(const ActiveEffect& effect);
/// With the words where they tell a rival from what it would replace.
std::string RivalName(const Rival& rival);
std::string ReplacedName(const Rival& rival);

/// The text with a capital at its start.
std::string Capital(std::string text);

/// "a, b and c", or with another last word: "a, b or c".
std::string Listed(const std::vector<std::string>& items, std::string_view last = "and");

/// A length with the digits that matter, without its unit: "8.64", "0.087", "<0.001".
std::string MillimetreText(double metres);

/// "93 %", "<1 %"; "100 %" only where nothing is missing to it.
std::string PercentText(double share);

/// A value to the second digit of its deviation, and the deviation: {"5.100e-07", "2.0e-09"}.
/// Without a deviation four digits, and an empty second text.
struct ValueText {
  std::string value, sd;
};
ValueText ValueTextOf(double value, std::optional<double> sd);

/// Where the noise was taken from: "declared", "from repeats", "from the residual".
std::string OriginText(const std::string& origin);

/// True where the answer corrects something by an empirical term.
bool HasEmpiricalTerm(const Diagnosis& diagnosis);

/// How a proposed pose is to be measured, beside pose and payload: "wait 20 min, q3 rising";
/// empty where nothing matters.
std::string MeasuringText(const NextPose& pose);

/// The verdict in one sentence, as a commissioning engineer would say it to another.
std::string Headline(const Diagnosis& diagnosis);

/// The error before and after, in one sentence, and on which points; empty where the model stays.
std::string ErrorSentence(const Diagnosis& diagnosis);

}  // namespace plumbline
