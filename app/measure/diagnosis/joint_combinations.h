// Combinations of joints that moved only together, whose effects the rows cannot separate.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "app/measure/diagnosis/fit_problem.h"

namespace plumbline::measure {

/// The combinations of joint angles that hardly varied over the rows that were not rejected:
/// eigenvectors of the correlation matrix of the revolute joints with an eigenvalue below 0.05.
/// Joints that move independently leave none: the smallest eigenvalue then is about
/// (1 - sqrt(joints / poses))^2 [Marchenko & Pastur 1967], 0.18 with the fewest poses accepted,
/// three per joint; with fewer the result is empty. Joints that hardly moved are left out.
/// @return  weights per radian and ranges [rad], each widened by 0.02 rad to both sides
std::vector<model::JointCombination> NearlyConstantCombinations(const FitProblem& problem);

/// What these combinations mean for poses that move the joints apart; nullopt if there are none.
std::optional<std::string> MovedTogetherNote(
    const std::vector<model::JointCombination>& combinations);

}  // namespace plumbline::measure
