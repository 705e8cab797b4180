// KRL, the language of KUKA controllers: .src and .dat modules, with $config.dat and $machine.dat.
#pragma once

#include "app/programs/brand.h"

namespace plumbline::programs {

const Brand& KrlBrand();

}  // namespace plumbline::programs
