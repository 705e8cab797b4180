#include "app/base/log/catalogue_parts.h"

namespace plumbline::log {
namespace {

constexpr EventEntry kEntries[] = {
    // service
    {Event::kStarted, "started", LogLevel::kNotice, "b6793976305b4d169e869ee7ccf78892", "service",
     "plumblined ... PLC server on ...", "the daemon is running and answers the PLC", ""},
    {Event::kNotStarted, "not-started", LogLevel::kError, "396e6dcca31c4ecc94a0078a95d63b75",
     "service", "not started: ...",
     "the configuration has the faults logged before this line, or a required resource is "
     "unavailable",
     "fix what the line names; `plumbline check` and `plumbline doctor` give details"},
    {Event::kEnding, "ending", LogLevel::kNotice, "d71aae0a79ad4afead7a847524bf3748", "service",
     "stopping on SIGTERM (SIGINT)", "stopped by `systemctl stop`, a restart, or Ctrl-C", ""},
    {Event::kFileFault, "file-fault", LogLevel::kError, "3fedcc69fc864fefb00312083eec5275",
     "service", "FILE:LINE KEY: ...",
     "a file has a fault: the daemon does not start, or keeps the previous configuration",
     "fix the reported line; run `plumbline check` to verify"},
    {Event::kFileWarning, "file-warning", LogLevel::kWarning, "d29dfd20f41747fb80608e2d57fbacfc",
     "service", "FILE:LINE KEY: warning: ...",
     "a configuration value is probably not what you intended",
     "check the reported line. For `near_deg` and unreachable points see program.md, \"The posture "
     "of a point\"; for lengths, masses, compliances and payloads commission.md, \"Values that are "
     "probably not intended\""},
    {Event::kReloaded, "reloaded", LogLevel::kNotice, "99bc55caa6ab45acaee3fe0e6c46269a", "service",
     "configuration ... reloaded",
     "the new configuration took effect between two cycles. Points stay valid; if [robot] or "
     "[push] changed, they become valid again once the robot has been read over the new link, a "
     "few cycles later",
     ""},
    {Event::kNotReloaded, "not-reloaded", LogLevel::kError, "3ce54784ff8245b393e99f9f9e3b03a6",
     "service", "configuration not reloaded",
     "the new file, or the model store, has the faults logged before this line, or the file has no "
     "points left because it is truncated; the previous configuration stays in force",
     "fix them, then reload"},
    {Event::kNeedsRestart, "needs-restart", LogLevel::kWarning, "27c49cc026b049018201e0553adafe12",
     "service", "needs a restart: ...",
     "the named settings changed, but SIGHUP cannot apply them to a running daemon",
     "`systemctl restart plumbline`"},
    {Event::kStateDirectory, "state-directory", LogLevel::kWarning,
     "ae972403c7be45bba93bca5dbae51efc", "service", "state directory: ...",
     "another plumblined uses this directory; with `[monitoring]` enabled the daemon does not "
     "start",
     "give each daemon its own `state_directory`"},
    {Event::kBootCounter, "boot-counter", LogLevel::kWarning, "58890e3dde984ae8b0baff42e545ecad",
     "service", "boot counter not stored: ...",
     "`state_directory` cannot be written; everything else works",
     "make the directory writable; the counter is stored as soon as it is"},
    {Event::kStorageLost, "storage-lost", LogLevel::kError, "3b0d2a4fd8ac4e5b9a1f6c58e0c74d12",
     "service", "state directory cannot be written: ...",
     "the disk is full, read-only or not owned by the daemon's user. Corrected points are still "
     "served; probes are refused with code 19; the boot count and models are not stored",
     "as the line says: free disk space, remount writable, or fix the owner; the daemon recovers "
     "without a restart"},
    {Event::kStorageRestored, "storage-back", LogLevel::kNotice, "c2f1a9e57b6d4f0d8e83574bb0a6d9c1",
     "service", "state directory can be written again", "probes are accepted again", ""},
    {Event::kThreadStalled, "stands-still", LogLevel::kError, "8bec2d0d8ec3422ab245548da2dedfcf",
     "service", "... has not responded for ... s",
     "the named thread is blocked, for example by a disk, a serial line or a camera that does not "
     "answer; the service manager restarts the daemon",
     "if it recurs, check the device that the thread uses"},
    {Event::kCycleLate, "cycle-late", LogLevel::kWarning, "286a666e44e64df6a3eb956bf31cd81b",
     "service", "control cycle started late: ...",
     "the machine is overloaded, or another real-time task occupies the control cycle's CPU",
     "give the daemon real-time priority (`systemd/plumbline.service`), or move the other load to "
     "another machine"},
    {Event::kCycleOnTime, "cycle-on-time", LogLevel::kNotice, "f4cbad448de34d62a5e0ece6c232f2a6",
     "service", "control cycle is on time again", "", ""},
    {Event::kClockSet, "clock-set", LogLevel::kWarning, "46ff541491894e3e8d02b0904aee66d3",
     "service", "system clock stepped by ... s",
     "probe and effect times continue on the previous time base until a restart",
     "run a time service; restart the daemon once the clock is right"},
    {Event::kRepeated, "repeated", LogLevel::kWarning, "6c04a11236704781b5532f3ffbf3bfdd",
     "service", "... N more in the last minute, the latest: ...",
     "at most five lines a minute are logged per event and subject; further ones are only counted",
     "as for the repeated event"},
    {Event::kLogHeldUp, "log-held-up", LogLevel::kWarning, "04b121fd73e6479e9d6089758f29e6bc",
     "service", "log output was blocked for ... s: ...",
     "journald, or whatever reads the log, accepted nothing for that time; the daemon did not "
     "wait, buffered up to 256 lines and wrote them afterwards",
     "`systemctl status systemd-journald`; check the disk under /var/log/journal"},
    // robot
    {Event::kRobotSetupFailed, "robot-set-up", LogLevel::kError, "16182868f6574819834426a4062549bb",
     "robot", "robot: ...",
     "the robot connection cannot be configured (a replay file without rows, an invalid unit id)",
     "fix what the line names"},
    {Event::kRobotLinkUp, "robot-link-up", LogLevel::kNotice, "714fccf2210f40d7871432d9804f914f",
     "robot", "robot link up, restored after ...", "the robot controller answers", ""},
    {Event::kRobotLinkAbsent, "robot-link-absent", LogLevel::kError,
     "913d94b719d045f19467daf9dcea2de9", "robot", "robot link not established: ...",
     "the controller has not answered since the start; an unknown host name has no address",
     "check address, port and unit id, and that the controller's Modbus server is on. Unknown host "
     "name: check the name server, or configure the address"},
    {Event::kRobotLinkLost, "robot-link-lost", LogLevel::kError, "ce96ecdb51cc4de99c4135e9858fa864",
     "robot", "robot link lost: ...",
     "no answer within `timeout_ms`, or one that is not the response to the request; corrected "
     "points are withdrawn. \"(before: ...)\": the link is still down, now for another reason",
     "check cable, address and controller, or what the line names; the daemon reconnects by "
     "itself. \"refreshes its registers faster\": "
     "see commission.md, \"Reading the robot\""},
    {Event::kRobotLinkInterrupted, "robot-link-blip", LogLevel::kWarning,
     "39ff189892bb4d8eabd5c7cb800a541f", "robot", "robot link lost and restored at once",
     "interrupted for less than 100 ms", "check the cable if it recurs"},
    {Event::kRobotNotice, "robot-notice", LogLevel::kNotice, "8447460fc14c43f085a0a9878f1a9699",
     "robot", "message of the controller: ...",
     "the controller sent a text, lacks an optional value, was restarted, or sends less often than "
     "asked; the link works",
     "follow the text; `rtde_fields` and `rtde_hz` in `[robot]` say what is asked for"},
    {Event::kRobotTrusted, "robot-trusted", LogLevel::kNotice, "a0e66798c65346b2a3aaece1cef596ef",
     "robot", "robot input trusted (again after ...)",
     "robot readings are plausible; points can become valid", ""},
    {Event::kRobotNotTrusted, "robot-not-trusted", LogLevel::kError,
     "3fff291f5d6c4f558f327434d17b6a67", "robot", "robot input not trusted: ...",
     "corrected points are withdrawn. Stale: no new reading for `stale_after_ms`. Not a number, "
     "too small, joint jumped: the registers hold implausible values, such as words in the wrong "
     "order. All zero: nothing confirms that these are readings. Outside its limits, wrong number "
     "of joints: cell and profile do not describe this arm. Tool pose contradicts the joints: they "
     "differ by over 10 mm or 1.1 degree",
     "stale: as for a lost link, or the controller's sequence counter has stopped. All zero: move "
     "a joint. Otherwise check the profile's addresses, types, word order, unit and wrap; the "
     "cell's `min_deg` and `max_deg`; the controller's tool offset"},
    {Event::kRobotBrieflyUntrusted, "robot-doubted", LogLevel::kWarning,
     "3d60f88ade734723bbbffec8dab6a4ea", "robot", "robot input was not trusted for a few cycles",
     "readings were implausible or stale for a few cycles; corrected points were withdrawn "
     "meanwhile",
     "if it recurs, check the profile's types and word order, and the cable"},
    {Event::kJointsUnchecked, "joints-unchecked", LogLevel::kWarning,
     "7eab7372ab354a169accf9e001d7d074", "robot", "no tool pose is read",
     "the robot profile has none, or joints are played back from a table: joint values cannot be "
     "checked against forward kinematics",
     "compare `plumbline status` with the teach pendant"},
    {Event::kJointsCoarse, "joints-coarse", LogLevel::kWarning, "32d1aa3a97184adb8f7f095b08f46635",
     "robot", "joint registers are coarse", "their resolution costs the stated accuracy at the tip",
     "let the robot program copy finer values (`universal-robots-fine`)"},
    {Event::kControllerPoseDiffers, "controller-pose-differs", LogLevel::kWarning,
     "d1df452e35074a61aa217e8fa728056d", "robot",
     "the controller's tool pose is ... from the cell's rigid table",
     "the controller computes its tool pose in another way than the cell, by more than the "
     "resolution of its numbers. Corrections stay in force: their errors may be of this size",
     "run `plumbline identify-controller`, or wait until the robot has been at standstill in ten "
     "postures; see commission.md, \"Which model the controller uses\""},
    {Event::kControllerModel, "controller-model", LogLevel::kWarning,
     "dcb66a8973cc4a44b3bb1a0eabf6ca7e", "robot", "the controller's pose is ...",
     "the relation of the reported tool pose to the cell is known: another table, tool, base or "
     "counting of joints",
     "write the lines that the message names into the cell or the robot profile, and reload"},
    {Event::kCompensatedTwice, "compensated-twice", LogLevel::kError,
     "d871a86414154f67ace9b3f51282ae95", "robot",
     "the controller's pose is ..., which this cell corrects as well",
     "the controller compensates deflection or calibration that the cell corrects too: corrected "
     "points are moved twice. They are not withdrawn",
     "switch the controller's absolute accuracy off, or take the effects and compliances out of "
     "the cell"},
    {Event::kControllerUnexplained, "controller-unexplained", LogLevel::kWarning,
     "5fc7b0b19d4048d5b0e8eba7da8e7c53", "robot",
     "no known relation explains the controller's pose",
     "the reported tool pose differs from the cell, and neither one nor two known relations "
     "explain it",
     "run `plumbline identify-controller`: it shows what the difference follows"},
    {Event::kControllerAgrees, "controller-agrees", LogLevel::kNotice,
     "e488e30362d845c69195e453b198b6c0", "robot",
     "the controller's tool pose is that of the cell's table again", "", ""},
    {Event::kMassGuessed, "mass-guessed", LogLevel::kWarning, "ac51b40797f14d35a393438c8f724aed",
     "robot", "a link has no link_com_mm", "its centre of mass is assumed",
     "declare `link_com_mm`"},
    {Event::kEmergencyStop, "emergency-stop", LogLevel::kWarning,
     "9edadf6d02be4af19a2c7516feb2220c", "robot", "the controller reports an emergency stop",
     "the robot is in emergency stop", ""},
    {Event::kEmergencyStopReleased, "emergency-stop-released", LogLevel::kNotice,
     "3b1c172607224cfbbdfe0879d2682d41", "robot", "the emergency stop is released", "", ""},
    {Event::kPushFailed, "push-failed", LogLevel::kWarning, "6355cb89513c49f3bfb09773121f60bd",
     "robot", "push to the controller: ...", "corrected points cannot be written to the controller",
     "check the registers of the profile's `[push]`, and `max_step_mm`"},
    {Event::kPushWorks, "push-works", LogLevel::kNotice, "e6263bd8c275403eafd8e2c3bed8786d",
     "robot", "push to the controller works again", "", ""},
    {Event::kPushNotWithdrawn, "push-left", LogLevel::kWarning, "039bd08272ca4cf4b36cdd4cd659b008",
     "robot", "pushed points may still be marked valid in the controller: ...",
     "the daemon stopped and could not withdraw them",
     "the robot program must not use a slot whose sequence number has stopped changing"},
    // motion
    {Event::kMotionPortFailed, "motion-port-failed", LogLevel::kError,
     "2b0f5f920539b2ac8eccd4a0c7838484", "motion", "motion link: ADDRESS:PORT: ...",
     "the UDP port cannot be opened: the controller is not answered; tried again every second",
     "check `listen` and `port` of [motion], and which program uses the port: ss -ulpn"},
    {Event::kMotionAnswering, "motion-answering", LogLevel::kNotice,
     "aad131270234e7cf0ecb6b82238cbd43", "motion", "motion link: the controller is answered",
     "packets arrive and are answered, with the offset 0 at first", ""},
    {Event::kMotionEnded, "motion-ended", LogLevel::kNotice, "5aacc13d4163c5d1f6fc475c04f500ad",
     "motion", "motion link: the controller sends nothing any more",
     "the robot program switched the sensor interface off, or the controller stopped by its "
     "timeout",
     "none if the program has ended; otherwise read the controller's message"},
    {Event::kMotionNotAnswered, "motion-not-answered", LogLevel::kError,
     "1b601a00a95aad0bd9c33d59c0c407c9", "motion", "motion link: not answered: ...",
     "the offset that the controller holds is not known, because its stream ran before the daemon "
     "or too many packets in a row were lost; the controller stops by its timeout",
     "acknowledge the controller's message and start the robot program again; for lost packets "
     "check the cable and that no other traffic is on that network"},
    {Event::kMotionCorrecting, "motion-correcting", LogLevel::kNotice,
     "08fb5b8d6dd30de36d4fa78e9faa869c", "motion", "motion corrected: X mm wanted",
     "the running motion is offset by what the model demands", ""},
    {Event::kMotionNotCorrecting, "motion-not-correcting", LogLevel::kNotice,
     "aec15f6976f305a4abdcd84d6d30c45e", "motion", "motion not corrected: ...",
     "the offset returns to 0 at its ramp and rate",
     "as the line says; motion.md explains each reason"},
    {Event::kMotionIgnored, "motion-ignored", LogLevel::kWarning,
     "7c131ccb9631e4d47efed0d1d9347e1c", "motion", "motion link: N packets ignored: ...",
     "packets came from another address than the controller's, or are not its messages",
     "keep other devices off the sensor network; check `robot`, `kind` and `joints_tag`"},
    // points
    {Event::kPointCorrected, "point-corrected", LogLevel::kInfo, "e04ae10f796644eea12c93b872e48d71",
     "points", "point ... corrected by ...",
     "the point is valid; its 95 % radius is `assumed` until a diagnosis has fitted the model, and "
     "unknown if nothing in the model deflects",
     ""},
    {Event::kPointRefused, "point-refused", LogLevel::kError, "390eb8e66fe547b38ec89f414d840b5d",
     "points", "point ... has no correction: ...", "its code has the reason",
     "program.md, \"Result codes\""},
    {Event::kPointsWithdrawn, "points-withdrawn", LogLevel::kError,
     "40111ed0f0254cf1bc516e320f5c3a2a", "points",
     "corrected points withdrawn: the lens of camera ... is not valid",
     "`required_for` of that camera contains \"points\", and its lens is not verified at the "
     "present zoom",
     "let the zoom come to rest with the reference tags in view, or show the calibration board; "
     "the points then become valid again automatically"},
    {Event::kPointsRestored, "points-restored", LogLevel::kNotice,
     "db9f65842d1640d0a62bed2e9ddd845c", "points", "corrected points are served again after ...",
     "the required lens is valid", ""},
    // plc
    {Event::kPlcServerFailed, "plc-side", LogLevel::kError, "6dce5d82a95e4967af4d26562036cd42",
     "plc", "PLC server: ...",
     "the port is in use or needs privilege, or the address does not belong to this machine",
     "check `plc.listen` and `plc.port`; is another plumblined running?"},
    {Event::kPlcPortDiffers, "plc-port-differs", LogLevel::kWarning,
     "44b5d0e9478244c8a5e4bc8ff4b7337a", "plc",
     "plc.port (plc.listen) is ..., but the service manager's socket listens on ...",
     "the socket unit takes precedence",
     "set the same in both (`systemctl edit plumbline.socket`)"},
    {Event::kHeartbeatLost, "heartbeat-lost", LogLevel::kWarning,
     "0fb19b15eace4f0c9ccda86b91e19ea1", "plc", "PLC heartbeat lost",
     "register 1030 has not changed for 2 s", "check the PLC's program and the network"},
    {Event::kHeartbeatBack, "heartbeat-back", LogLevel::kNotice, "447f7d8799d9476e945c386df730c8ac",
     "plc", "PLC heartbeat is back", "", ""},
    {Event::kSerialLost, "serial-lost", LogLevel::kError, "3941948eeac6499989e831d7551eee3f", "plc",
     "serial line ...: ...", "it cannot be opened, or was unplugged",
     "check the adapter, `plc.rtu.device` and membership in group dialout; the daemon reopens it "
     "automatically"},
    {Event::kSerialOpen, "serial-open", LogLevel::kNotice, "1f4f950ad2034e54a4d2fece1d7a8e10",
     "plc", "serial line ... open", "", ""},
    {Event::kClientRefused, "client-refused", LogLevel::kWarning,
     "0e2d890287404a9d849bc4b518a63df3", "plc",
     "Modbus client ... refused: ..., asks for unit id ...",
     "the client is not in `plc.allow`, every slot is reserved, or it asks for another unit id",
     "add it to `plc.allow`, or find out what it is; `plc.max_clients`; set its unit id to 1, or "
     "`plc.unit_id` to its own"},
    {Event::kClientClosed, "client-closed", LogLevel::kWarning, "2fc32a123f5c483abb000f332ab26903",
     "plc", "Modbus client ... closed: ...",
     "longest idle: more clients than `plc.max_clients`. Frame not completed, does not read its "
     "answers, not Modbus: the client misbehaves. Out of file descriptors: the system's limit",
     "close idle clients, or raise `plc.max_clients`; fix the client; raise `LimitNOFILE` of the "
     "service"},
    {Event::kTwoMasters, "two-masters", LogLevel::kWarning, "9aa3bce220344a5bb57b4843293e6ae8",
     "plc", "two masters: ADDRESS and ADDRESS write the command window (registers 1000-1039)",
     "each may overwrite the other's command, or read its answer; warning bit 15, registers "
     "425-427",
     "let only one of them write commands: `plc.allow`, or set the other to read only"},
    {Event::kOneMaster, "one-master", LogLevel::kNotice, "54673e7804d84bc383b604f85ee53104", "plc",
     "one client alone writes the command window again", "no second writer for 5 s", ""},
    // loop
    {Event::kModelInForce, "model-in-force", LogLevel::kNotice, "83d6e24b4e004cd2b7efa266a9c4be5d",
     "monitoring", "model version N in force in place of the cell file",
     "a person applied it, or `apply = \"automatic\"` did", ""},
    {Event::kModelSetAside, "model-set-aside", LogLevel::kWarning,
     "749e9eab0a0649cc993826bfd73025dd", "monitoring",
     "model version N is set aside: ..., the model store ... was found empty, ..., whether a model "
     "was applied is not known: ...",
     "the cell file now describes a different cell from the one the version was applied to; the "
     "line lists the changed keys. Points are corrected by the cell file alone. Warning bit 13 "
     "stays, also across restarts, until a version is applied",
     "`plumbline model apply N` applies it anyway; `plumbline model apply` with the declared "
     "version confirms the cell file; or measure and diagnose again"},
    {Event::kModelRefused, "model-refused", LogLevel::kError, "ba26c7935cc44cb7987bc4452b70b211",
     "monitoring", "model version N is not put in force: point ... would ...",
     "a model that was applied, or an edited cell file, would cost a point its correction, move a "
     "point by more than three times the largest residual that it explains, or leave a point "
     "outside the range that it was fitted to; the model in force stays",
     "check its report and the measurement that it was fitted to, and for an edited cell file the "
     "edit; `plumbline model apply N --force` puts it in force anyway"},
    {Event::kReferenceLearned, "monitor-learnt", LogLevel::kNotice,
     "dd59c47f17a747bf81a5c271c5e0869b", "monitoring", "drift monitor has its reference: ...",
     "it has learned the current residual and watches for drift from now on", ""},
    {Event::kDriftAlarm, "drift-alarm", LogLevel::kWarning, "18ed53ac9ae340aaa05bcb44f2578c6f",
     "monitoring", "drift alarm: ...",
     "probe residuals differ from the reference by more than noise explains",
     "collision, loose tool, warm-up? then `plumbline model list`; command 8 dismisses the alarm"},
    {Event::kDriftAlarmActive, "drift-stands", LogLevel::kWarning,
     "4267377364c44da6a58d1ef6a424a019", "monitoring",
     "drift alarm of journal row N is still active", "raised before this start and not dismissed",
     "find the cause; command 8 of the PLC dismisses the alarm"},
    {Event::kMonitorRestarted, "monitor-restarted", LogLevel::kNotice,
     "2711d9974aa44ad0a70d5d54189d5220", "monitoring", "drift monitor restarted by the PLC",
     "requested by command 8", ""},
    {Event::kDiagnosisStarted, "diagnosis-started", LogLevel::kNotice,
     "e93d9d915a3747cea28d89496e6d536d", "monitoring", "diagnosis started over N measured points",
     "it runs as a separate process at the lowest priority", ""},
    {Event::kDiagnosisNote, "diagnosis-note", LogLevel::kNotice, "4b0259516c45416aba9d50f2fd9f5886",
     "monitoring", "diagnosis: ...", "rows or columns that the diagnosis cannot use, and why", ""},
    {Event::kDiagnosisCoarse, "diagnosis-coarse", LogLevel::kWarning,
     "25be04a1a8a04b048c7d25c87e8c685c", "monitoring",
     "the joint readings of N probes have a resolution of ... mrad, ... mm at the tool",
     "smaller effects cannot be detected", "use finer registers (`universal-robots-fine`)"},
    {Event::kDiagnosisEnded, "diagnosis-ended", LogLevel::kNotice,
     "8362abfff8ab451896f0ad507f053fa2", "monitoring", "diagnosis: VERDICT ...",
     "nothing proposed: no effect exceeds the noise, or no model predicts held-out points better. "
     "Proposed: a corrected model awaits approval; if it was not applied automatically, the line "
     "says why. Applied: it is in force",
     "read its report, then `plumbline model apply N`; `plumbline model rollback` reverts it"},
    {Event::kDiagnosisOutOfDate, "diagnosis-out-of-date", LogLevel::kNotice,
     "cba75fc0785d4258be720425989387f6", "monitoring",
     "diagnosis stopped: another model is in force", "its input is out of date", ""},
    {Event::kDiagnosisFailed, "diagnosis-failed", LogLevel::kError,
     "9721cf7335bc48628cd1cf6346afb903", "monitoring", "diagnosis not started: ..., failed: ...",
     "the line gives the reason", "see the files in `diagnosis` of the state directory"},
    {Event::kJournalFault, "journal-fault", LogLevel::kError, "db6bfde1568d4261bdc4cdfa2941c442",
     "monitoring", "journal: ...",
     "probes are refused (code 12) until the journal works again; probes accepted just before are "
     "buffered, and the log reports any that are lost at shutdown",
     "disk full, `journal_mb` reached, permissions, or a file that is not a journal: stop the "
     "daemon and move it away"},
    {Event::kJournalWorks, "journal-works", LogLevel::kNotice, "ddb43b9201944e9b88c2521301f0aca8",
     "monitoring", "journal works again", "", ""},
    {Event::kProbesNotMonitored, "probes-unwatched", LogLevel::kWarning,
     "132e32e399c94b7298ff3cd518fa0880", "monitoring",
     "probes by ... are recorded, but not monitored for drift",
     "the drift monitor's reference was taken with the other camera, or with both",
     "probe with the reference cameras again, or take a new reference with command 8"},
    {Event::kProbeRefused, "probe-refused", LogLevel::kWarning, "2656d6eaf947480d85934ccec6226307",
     "monitoring", "probe refused and not recorded: ...",
     "0, 0, 0; in metres instead of mm; beyond the arm's reach; or the robot moved (codes 17, 18, "
     "registers 420-423). Logged when the reason changes",
     "as the line says"},
    {Event::kProbesAccepted, "probes-taken", LogLevel::kNotice, "495f297deb724d96b35b47e5018e247c",
     "monitoring", "probes are accepted again; N were refused", "", ""},
    {Event::kProbeQuarantined, "probe-quarantined", LogLevel::kWarning,
     "8de8514dfab14e3691e88069ce981eef", "monitoring", "probe quarantined: row N ...",
     "it contradicts the model by more than any plausible effect: recorded, but excluded from "
     "drift monitoring and diagnosis (code 20)",
     "are unit, frame and tool right? then `plumbline journal quarantine accept N`, otherwise "
     "`reject N`"},
    {Event::kGaugeRecorded, "gauge-recorded", LogLevel::kNotice, "1d469fb3d06543ce927aabb423cd576f",
     "monitoring", "gauge ...: X mm recorded", "the journal has the row", ""},
    {Event::kGaugeRefused, "gauge-refused", LogLevel::kWarning, "a7fddf8f159b400aa3d3835897cd6b84",
     "monitoring", "gauge ...: not recorded: ...",
     "the robot moved, the journal is not writable, the gauge reports a fault, or the line is not "
     "of the configured format",
     "as the line says; then press the button again"},
    {Event::kGaugeLost, "gauge-lost", LogLevel::kWarning, "14b80eac77a64b2e919faf63eb0c0f85",
     "monitoring", "gauge ...: cannot be opened, or hung up",
     "its readings are not recorded until it is connected again", "as the line says"},
    {Event::kGaugeBack, "gauge-back", LogLevel::kNotice, "7d19b6f301f943f5a4990c26de43e84e",
     "monitoring", "gauge ... is connected again", "", ""},
    {Event::kQuarantineDecided, "quarantine-decided", LogLevel::kNotice,
     "191c31b6b0944b31b17b4f69a68e5d09", "monitoring", "quarantine: N probes wait for a decision",
     "a person accepted or rejected probes; the drift monitor has reread the journal", ""},
    {Event::kReferenceRefused, "reference-refused", LogLevel::kWarning,
     "1ad70c02413e4b2ba08237a1052f8df1", "monitoring", "drift monitor's reference refused: ...",
     "its probes disagree by more than chance: drift is not monitored (bit 7 of register 400)",
     "inspect the listed rows, then take a new reference with command 8; if poses really differ "
     "that much, raise `probe_sigma_mm`"},
    {Event::kRadiusContradicted, "radius-contradicted", LogLevel::kWarning,
     "3e2171deae2d4749b99b8f5438a81ac7", "monitoring",
     "probes contradict the stated 95 % radius: ...",
     "the probes agree with each other, but not with the model: the radius is shown without its "
     "95 % (basis unknown, bit 9 of register 400, warning bit 5)",
     "check tool, load and measurement frame; read the diagnosis, which starts by itself; apply a "
     "model that explains the probes, or take a new reference with command 8"},
    {Event::kClockBehind, "clock-behind", LogLevel::kWarning, "a122c7bdeecf4dc7a3bc4c7792fa3818",
     "monitoring", "the system clock is ... s behind the journal's last probe",
     "the clock is wrong now, or was wrong then",
     "set the clock; time-dependent effects are wrong until then"},
};

}  // namespace

std::span<const EventEntry> DaemonEvents() {
  return kEntries;
}

}  // namespace plumbline::log
