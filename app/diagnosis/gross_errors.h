// Mistakes in the data that no effect should be blamed for.
#pragma once

#include <optional>

#include "app/diagnosis/linearisation.h"

namespace plumbline {

/// What a residual of centimetres most likely is: a joint's sign swapped, angles in radians, or a
/// joint's zero far off; nothing where the residual is of the size that effects have.
/// @return  a sentence that says what to do
std::optional<std::string> GrossError(const Dataset& data, const Linearisation& aligned,
                                      int threads);

}  // namespace plumbline
