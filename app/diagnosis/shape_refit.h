// Shapes of an explanation, refitted together with its sizes.
#pragma once

#include "app/diagnosis/pool.h"

namespace plumbline {

/// An explanation refitted to the rows of the pool's problem: units that the refitted shapes make
/// superfluous are gone, and the blocks of searched shapes have the refitted ones, so that a time
/// constant and a step beside it are no longer those found one after the other. Adds those blocks
/// to the pool. The explanation itself where the refit fails, or scores no better.
Explanation WithRefittedShapes(Pool& pool, const Explanation& chosen);

}  // namespace plumbline
