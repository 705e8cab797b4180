PRAGMA application_id = 1347177009;
PRAGMA user_version = 3;
BEGIN TRANSACTION;
CREATE TABLE epoch (utc_s INTEGER NOT NULL);
INSERT INTO "epoch" VALUES(1795312502);
CREATE TABLE import (
  id INTEGER PRIMARY KEY, file TEXT NOT NULL, content_hash INTEGER NOT NULL,
  rows INTEGER NOT NULL, last_row INTEGER NOT NULL
);
INSERT INTO "import" VALUES(1,'measured.csv',-81985529216486896,2,4);
CREATE TABLE measurement (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  source TEXT NOT NULL CHECK (source IN ('plc', 'camera', 'import')),
  unix_ms INTEGER,
  t_s REAL,  -- of probes: UTC since the epoch
  session TEXT NOT NULL, command INTEGER,
  q TEXT NOT NULL, qd TEXT, qdd TEXT, tau TEXT,  -- arrays; deg and Nm, mm and N where prismatic
  payload_kg REAL, temp_C REAL,
  predicted_x_mm REAL, predicted_y_mm REAL, predicted_z_mm REAL,
  x_mm REAL, y_mm REAL, z_mm REAL, range_mm REAL,
  qw REAL, qx REAL, qy REAL, qz REAL,
  model_version INTEGER, wild INTEGER NOT NULL DEFAULT 0, alarm INTEGER NOT NULL DEFAULT 0,
  q_step_deg REAL,  -- of the registers that q was read from; 0: finer than matters
  covariance_mm2 TEXT  -- of x, y, z by camera: array of 9, row by row
);
INSERT INTO "measurement" VALUES(1,'plc',1763710200123,12.125,'left station',17,'[30.25,125.0]',NULL,NULL,'[41.5,-7.25]',60.0,23.5,1200.0,-400.0,900.0,1200.5,-400.25,901.0,NULL,NULL,NULL,NULL,NULL,1,0,0,5.72957795130823246965e-02,NULL);
INSERT INTO "measurement" VALUES(2,'plc',1763710260623,72.625,'',18,'[-90.5,125.0]',NULL,NULL,NULL,NULL,NULL,1200.0,-400.0,900.0,1200.5,-400.25,901.0,NULL,NULL,NULL,NULL,NULL,1,1,1,5.72957795130823246965e-02,NULL);
INSERT INTO "measurement" VALUES(3,'import',NULL,137.5,'calib boot 00000001',NULL,'[-90.5,125.0]','[-45.25,62.5]','[-22.625,31.25]',NULL,0.0,NULL,NULL,NULL,NULL,100.0,200.0,300.0,2500.0,0.5,0.5,-0.5,0.5,NULL,0,0,NULL,NULL);
INSERT INTO "measurement" VALUES(4,'import',NULL,137.5,'calib boot 00000001',NULL,'[-90.5,125.0]','[-45.25,62.5]','[-22.625,31.25]',NULL,0.0,NULL,NULL,NULL,NULL,100.0,200.0,300.0,2500.0,0.5,0.5,-0.5,0.5,NULL,0,0,NULL,NULL);
INSERT INTO "measurement" VALUES(5,'camera',1763710320000,132.0,'',19,'[-90.5,125.0]',NULL,NULL,NULL,NULL,NULL,1200.0,-400.0,900.0,1200.5,-400.25,901.0,NULL,NULL,NULL,NULL,NULL,1,0,0,5.72957795130823246965e-02,'[0.01,0.0025,0.0,0.0025,0.01,0.0,0.0,0.0,0.01]');
CREATE TABLE monitor_restart (
  id INTEGER PRIMARY KEY, after_row INTEGER NOT NULL, model_version INTEGER NOT NULL,
  reason TEXT NOT NULL
);
INSERT INTO "monitor_restart" VALUES(1,5,3,'model');
INSERT INTO "monitor_restart" VALUES(2,5,3,'person');
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('measurement',5);
COMMIT;
