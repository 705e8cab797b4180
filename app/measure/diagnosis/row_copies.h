// Detection of rows that are exact copies of earlier ones.
#pragma once

#include "app/measure/diagnosis/dataset.h"

namespace plumbline::measure {

/// Removes copies: rows equal to an earlier one in every digit of every column including t_s.
/// Without t_s, equal rows may also be repeated measurements with a coarse resolution; they are
/// kept, with a note.
/// The table and what each row measures must be set.
void DropCopies(Dataset& data);

}  // namespace plumbline::measure
