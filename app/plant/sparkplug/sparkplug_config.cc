#include "app/plant/sparkplug/sparkplug_config.h"

#include <algorithm>
#include <filesystem>

#include "app/base/config/required_file.h"
#include "app/base/config/toml_reader.h"

namespace plumbline::plant {
namespace {

constexpr int kMaxNodes = 10000;
constexpr std::size_t kMaxIdLength = 64;

bool IsTopicLevel(const std::string& name) {
  return name.size() <= kMaxIdLength && std::all_of(name.begin(), name.end(), [](char c) {
           return c != '/' && c != '+' && c != '#' && static_cast<unsigned char>(c) >= ' ' &&
                  c != 127;
         });
}

SparkplugConfig ConfigFromToml(const config::TomlTable& root, const std::string& file) {
  SparkplugConfig config;
  const std::string folder = std::filesystem::path(file).parent_path().string();
  if (const auto broker = root.Table("broker")) config.cells = BrokerFromToml(*broker, folder);
  config.hosts = config.cells;
  const auto table = root.Table("sparkplug");
  if (!table) return config;
  if (const auto broker = table->Table("broker")) config.hosts = BrokerFromToml(*broker, folder);
  config.client_id = table->String("client_id").value_or(config.client_id);
  config.primary_host = table->String("primary_host").value_or("");
  for (const auto& [key, name] :
       {std::pair{"client_id", config.client_id}, {"primary_host", config.primary_host}}) {
    if (!IsTopicLevel(name)) table->AddFault(key, "must have 1..64 characters, without / + #");
  }
  config.max_nodes = table->Integer("max_nodes", 1, kMaxNodes).value_or(config.max_nodes);
  return config;
}

}  // namespace

std::optional<SparkplugConfig> SparkplugConfigFromText(std::string_view text,
                                                       const std::string& file,
                                                       config::FaultList& faults) {
  return config::ReadDocument(text, file, faults, [&](config::TomlDocument& document) {
    // The other programs of the plant have tables in the same file.
    document.Root().Ignore({"database", "collect", "prior", "worker", "page"});
    return ConfigFromToml(document.Root(), file);
  });
}

std::optional<SparkplugConfig> ReadSparkplugConfig(const std::string& file,
                                                   config::FaultList& faults) {
  const auto text = config::ReadRequiredFile(file, faults);
  return text ? SparkplugConfigFromText(*text, file, faults) : std::nullopt;
}

}  // namespace plumbline::plant
