// Reader of the [[gauge]] tables of a configuration.
#pragma once

#include <string_view>
#include <vector>

#include "app/base/config/gauge_config.h"
#include "app/base/config/toml_reader.h"
#include "firmware-like/model/cell_model.h"

namespace plumbline::config {

/// Values of a [[gauge]] table, before the defaults of kind and format are filled in.
struct GaugeKeys {
  std::string artefact, device, usb_id, serial;
  gauge::GaugeKind kind = gauge::GaugeKind::kSerial;
  std::optional<const gauge::GaugeFormat*> format;
  std::optional<int> baud, data_bits, stop_bits;
  std::optional<char> parity;
  gauge::GaugeUnit unit = gauge::GaugeUnit::kMillimetre;
  std::optional<double> sigma_m;
};

/// The gauges in file order. Faults: an artefact that the cell lacks or that is no gauge, two
/// gauges for one artefact or device, an unknown format, impossible settings of the line, keys of
/// the other kind.
/// @param cell  provides the artefacts; null if it could not be read, then they are not checked
std::vector<GaugeConfig> GaugesFromToml(const TomlTable& root, const model::CellModel* cell);

}  // namespace plumbline::config
