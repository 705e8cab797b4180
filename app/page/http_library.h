// cpp-httplib, made fit to be included before Eigen: <resolv.h>, which it brings, makes a macro of
// a name that Eigen uses.
#pragma once

#include <httplib.h>

#undef _res
