#include "app/doctor/examine.h"

#include <fmt/format.h>

#include "app/config/daemon_config_reader.h"
#include "app/doctor/cell.h"
#include "app/doctor/computer.h"
#include "app/model_store/usable_model.h"
#include "drivers/files/package_paths.h"

namespace plumbline {
namespace {

CheckUp FaultsOf(const FaultList& faults, const char* subject, const char* remedy) {
  CheckUp found;
  for (const Fault& fault : faults.All()) {
    found.push_back({fault.severity == Fault::Severity::kFault ? Health::kFault : Health::kWarning,
                     subject, FaultText(fault), remedy});
  }
  return found;
}

}  // namespace

CheckUp Examine(const std::string& config_file, const std::string& user) {
  const Account account = AccountOf(user);
  FaultList faults;
  const auto config = ReadDaemonConfig(config_file, faults);
  CheckUp found = FaultsOf(faults, "configuration", "mend that line");
  if (config) {
    const std::string why = WhyNoAccess(account, config_file, false);
    found.insert(found.begin(), {why.empty() ? Health::kGood : Health::kFault, "configuration",
                                 why.empty() ? config_file : why,
                                 why.empty() ? "" : "chmod a+r, or chgrp " + account.name});
  }
  const auto add = [&](const CheckUp& more) {
    found.insert(found.end(), more.begin(), more.end());
  };
  add({LookAtClock(), LookAtJournal()});
  if (!config) return found;
  add({LookAtState(config->state_directory, account)});
  FaultList applied;
  AddFaultsOfModelStore(config->state_directory, config->cell_file, applied);
  add(FaultsOf(applied, "model in force", "plumbline model list, then apply or rollback"));
  add(LookAtPrograms(*config, OwnFolder()));
  add(LookAtDaemon(*config));
  add({LookAtAccess(config->plc.tcp)});
  for (const CameraConfig& camera : config->vision.cameras) {
    add({LookAtCamera(camera, account), LookAtZoom(camera.zoom, account)});
  }
  add({LookAtDisplay(config->overlay, account)});
  if (config->mqtt) add({LookAtBroker(*config->mqtt, account)});
  return found;
}

}  // namespace plumbline
