#include "app/programs/brands/fanuc_words.h"

#include <array>

#include "app/programs/brands/source_cursor.h"

namespace plumbline::programs::fanuc {

std::string_view EnglishWord(std::string_view word) {
  struct Translation {
    std::string_view german, english;
  };
  static constexpr std::array kTranslations = {
      Translation{"WKZ_NUM", "UTOOL_NUM"}, Translation{"BENUTZER_NUM", "UFRAME_NUM"},
      Translation{"TRAGLST", "PAYLOAD"},   Translation{"WKZ_Offset", "Tool_Offset"},
      Translation{"AUFRUF", "CALL"},       Translation{"WENN", "IF"},
      Translation{"SPRUNG", "JMP"},        Translation{"LABEL", "LBL"},
      Translation{"WARTE", "WAIT"},        Translation{"Interrupt", "Skip"},
      Translation{"ENDE", "END"},          Translation{"KONFIG", "CONFIG"},
      Translation{"FREIG", "UNLOCK"},      Translation{"SPERRE", "LOCK"},
  };
  for (const Translation& translation : kTranslations) {
    if (SameWord(word, translation.german)) return translation.english;
  }
  return word;
}

}  // namespace plumbline::programs::fanuc
