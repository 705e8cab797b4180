// Subcommands of plumbline. Each adds its options to `app` and sets `exit_code` when it has run.
#pragma once

namespace CLI {
class App;
}

namespace plumbline::cli {

void AddBeamCommand(CLI::App& app, int& exit_code);
void AddBoardWorkerCommand(CLI::App& app, int& exit_code);
void AddCalibrateHandEyeCommand(CLI::App& app, int& exit_code);
void AddCalibrateLensCommand(CLI::App& app, int& exit_code);
void AddCamerasCommand(CLI::App& app, int& exit_code);
void AddCheckCommand(CLI::App& app, int& exit_code);
void AddCompletionCommand(CLI::App& app, int& exit_code);
void AddDiagnoseCommand(CLI::App& app, int& exit_code);
void AddDistanceCommand(CLI::App& app, int& exit_code);
void AddDoctorCommand(CLI::App& app, int& exit_code);
void AddEffectsCommand(CLI::App& app, int& exit_code);
void AddExplainCommand(CLI::App& app, int& exit_code);
void AddExportUrdfCommand(CLI::App& app, int& exit_code);
void AddIdentifyControllerCommand(CLI::App& app, int& exit_code);
void AddImportCommand(CLI::App& app, int& exit_code);
void AddImportUrdfCommand(CLI::App& app, int& exit_code);
void AddJournalCommand(CLI::App& app, int& exit_code);
void AddLensCommand(CLI::App& app, int& exit_code);
void AddLogCommand(CLI::App& app, int& exit_code);
void AddMeshCommand(CLI::App& app, int& exit_code);
void AddModelCommand(CLI::App& app, int& exit_code);
void AddPathCommand(CLI::App& app, int& exit_code);
void AddPlanCommand(CLI::App& app, int& exit_code);
void AddPredictCommand(CLI::App& app, int& exit_code);
void AddPrintCommand(CLI::App& app, int& exit_code);
void AddPriorCommand(CLI::App& app, int& exit_code);
void AddProgramCommand(CLI::App& app, int& exit_code);
void AddRegistersCommand(CLI::App& app, int& exit_code);
void AddSettingsCommand(CLI::App& app, int& exit_code);
void AddPlantCommand(CLI::App& app, int& exit_code);
void AddSnapshotCommand(CLI::App& app, int& exit_code);
void AddStatusCommand(CLI::App& app, int& exit_code);
void AddTokenCommand(CLI::App& app, int& exit_code);
void AddTrackCommand(CLI::App& app, int& exit_code);

}  // namespace plumbline::cli
