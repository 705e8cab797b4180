// Sheets as a PDF or SVG file, drawn by cairo in a loadable module.
//
// cairo depends on two dozen shared libraries that no other command needs. The module is loaded
// when the first sheet is drawn.
#pragma once

#include <cstddef>
#include <string>

#include "app/vision/print/sheet.h"
#include "firmware-like/result.h"

namespace plumbline::vision {

enum class SheetFormat { kPdf, kSvg };

/// Callback that receives the file in parts.
using TakeBytes = void(void* file, const unsigned char* bytes, std::size_t count);

/// Draws the sheets and passes the file to `take` together with `file`.
/// @return  nullptr, or why cairo failed: a string literal of the module
using DrawSheets = const char*(const Document& document, SheetFormat format, TakeBytes* take,
                               void* file);

/// File name of the module, and name of its function of type DrawSheets. The number is the version
/// of this interface, so that a module of another version is rejected instead of called.
inline constexpr const char* kSheetModuleFile = "plumbline-sheets.so";
inline constexpr const char* kDrawSheetsName = "plumbline_draw_sheets_1";

/// The file as bytes: vector graphics in exact millimetres. An SVG file holds one sheet only.
/// @param module  path of the module
/// @return        an error with the remedy if the module cannot be loaded or cairo fails
Result<std::string> FileOfSheets(const Document& document, SheetFormat format,
                                 const std::string& module);

}  // namespace plumbline::vision
