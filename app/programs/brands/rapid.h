// ABB RAPID: .mod, .sys and .prg modules, and .pgf lists of them.
#pragma once

#include "app/programs/brand.h"

namespace plumbline::programs {

const Brand& Rapid();

}  // namespace plumbline::programs
