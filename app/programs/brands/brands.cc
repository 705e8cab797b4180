// Table of the brands.
#include <fmt/format.h>

#include <vector>

#include "app/programs/brand.h"
#include "app/programs/brands/fanuc.h"
#include "app/programs/brands/jbi.h"
#include "app/programs/brands/krl.h"
#include "app/programs/brands/pose_table.h"
#include "app/programs/brands/rapid.h"
#include "app/programs/brands/urscript.h"

namespace plumbline::programs {

std::span<const Brand* const> Brands() {
  static const std::vector<const Brand*> kBrands = [] {
    std::vector<const Brand*> brands = {
        &KrlBrand(),  //
        &Rapid(),     //
        &FanucTp(),   //
        &UniversalRobots(),
        &YaskawaJbi(),  //
    };
    brands.insert(brands.end(), PoseTables().begin(), PoseTables().end());
    return brands;
  }();
  return kBrands;
}

Result<const Brand*> BrandOf(const std::vector<SourceFile>& files,
                             std::span<const Brand* const> brands) {
  const Brand* found = nullptr;
  const SourceFile* first = nullptr;
  for (const SourceFile& file : files) {
    for (const Brand* const brand : brands) {
      if (!brand->Recognises(file)) continue;
      if (found != nullptr && found != brand) {
        return Error{
            fmt::format("{} is a program of {}, {} of {}: give the files of one controller",
                        first->name, found->name(), file.name, brand->name())};
      }
      found = brand;
      if (first == nullptr) first = &file;
      break;
    }
  }
  if (found == nullptr) {
    std::string known;
    for (const Brand* const brand : brands) {
      known += (known.empty() ? "" : ", ") + std::string(brand->name());
    }
    return Error{
        fmt::format("{}: no robot program that is read here ({}); `plumbline explain` "
                    "says what the file is",
                    files.empty() ? std::string("no file") : files.front().name, known)};
  }
  return found;
}

}  // namespace plumbline::programs
