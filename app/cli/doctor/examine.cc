#include "app/cli/doctor/examine.h"

#include <fmt/format.h>

#include "app/base/config/daemon_config_reader.h"
#include "app/cell/model_store/usable_model.h"
#include "app/cli/doctor/cell.h"
#include "app/cli/doctor/computer.h"
#include "drivers/files/package_paths.h"

namespace plumbline::cli {
namespace {

CheckResults FaultsOf(const config::FaultList& faults, const char* subject, const char* remedy) {
  CheckResults found;
  for (const config::Fault& fault : faults.All()) {
    found.push_back(
        {fault.severity == config::Fault::Severity::kFault ? Health::kFault : Health::kWarning,
         subject, config::FaultText(fault), remedy});
  }
  return found;
}

}  // namespace

CheckResults Examine(const std::string& config_file, const std::string& user) {
  const Account account = AccountByName(user);
  config::FaultList faults;
  const auto config = config::ReadDaemonConfig(config_file, faults);
  CheckResults found = FaultsOf(faults, "configuration", "fix that line");
  if (config) {
    const std::string problem = AccessProblem(account, config_file, false);
    const bool readable = problem.empty();
    found.insert(found.begin(), {readable ? Health::kGood : Health::kFault, "configuration",
                                 readable ? config_file : problem,
                                 readable ? ""
                                          : "chgrp " + account.name + " " + config_file +
                                                " && chmod 640 " + config_file});
  }
  const auto add = [&](const CheckResults& more) {
    found.insert(found.end(), more.begin(), more.end());
  };
  add({CheckClock(), CheckSystemJournal()});
  if (!config) return found;
  add({CheckStateDirectory(config->state_directory, account)});
  add(CheckJournal(config->state_directory));
  config::FaultList applied;
  cell::CheckModelStore(config->state_directory, config->cell_file, applied);
  add(FaultsOf(applied, "model in force",
               "plumbline model list, then plumbline model apply or rollback"));
  add(CheckPrograms(*config, files::ProgramFolder()));
  add(CheckDaemon(*config));
  add({CheckPlcAccess(config->plc.tcp)});
  for (const config::CameraConfig& camera : config->vision.cameras) {
    add({CheckCamera(camera, account), CheckZoomSensor(camera.zoom, account)});
  }
  for (const config::GaugeConfig& gauge : config->gauges) add({CheckGauge(gauge, account)});
  add({CheckDisplay(config->overlay, account)});
  if (config->mqtt) add({CheckBroker(*config->mqtt, account)});
  return found;
}

}  // namespace plumbline::cli
