PRAGMA application_id = 1347177521;
PRAGMA user_version = 4;
BEGIN TRANSACTION;
CREATE TABLE lens (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  utc TEXT NOT NULL,
  camera_serial TEXT NOT NULL, mode TEXT NOT NULL,
  zoom_counts INTEGER NOT NULL, focus_counts INTEGER,
  width INTEGER NOT NULL, height INTEGER NOT NULL,
  fx REAL NOT NULL, fy REAL NOT NULL, cx REAL NOT NULL, cy REAL NOT NULL,
  k1 REAL NOT NULL, k2 REAL NOT NULL, p1 REAL NOT NULL, p2 REAL NOT NULL, k3 REAL NOT NULL,
  covariance TEXT NOT NULL,  -- 81 numbers, order fx, fy, cx, cy, k1, k2, p1, p2, k3; or 256
  rms_px REAL NOT NULL, board TEXT NOT NULL, pupil_shift_m REAL, temp_C REAL,
  corners BLOB NOT NULL, checksum INTEGER NOT NULL,
  uncertainty_px REAL,  -- of the projection at its worst place, one standard deviation
  usable_radius_px REAL,  -- null: the whole image
  more_distortion TEXT,  -- null, or k4, k5, k6, s1, s2, s3, s4 and 1 for a fisheye
  no_window INTEGER NOT NULL DEFAULT 0, fixed_focus INTEGER NOT NULL DEFAULT 0  -- 1: declared
);
INSERT INTO "lens" VALUES(1,'2026-11-21T07:30:00Z','SN-1','YUYV 1920x1080@30',1000,4660,1920,1080,1500.25,1501.5,959.25,540.125,-0.125,0.05,1.0e-05,-2.0e-05,3.33333333333333328707e-02,'[1.0,0.25,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.25,0.5,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.25,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.125,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0625,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.03125,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.015625,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0078125,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.00390625]',0.04,'chessboard 18x12, 10 mm',NULL,NULL,X'0001FF01',-5979994773210956373,0.31,NULL,NULL,1,0);
INSERT INTO "lens" VALUES(2,'2026-11-21T08:30:00Z','SN-1','YUYV 1920x1080@30',2000,NULL,1920,1080,3000.5,3003.0,959.25,540.125,-0.125,0.05,1.0e-05,-2.0e-05,3.33333333333333328707e-02,'[1.0,0.25,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.25,0.5,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.25,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.125,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0625,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.03125,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.015625,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0078125,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.0,0.00390625]',0.04,'chessboard 18x12, 10 mm',0.0021,23.5,X'0001FF02',1963131286979628169,0.31,NULL,NULL,0,0);
CREATE INDEX lens_of_camera ON lens (camera_serial, mode);
CREATE TRIGGER lens_is_not_changed BEFORE UPDATE ON lens
  BEGIN SELECT RAISE(ABORT, 'lenses are never changed'); END;
CREATE TRIGGER lens_is_not_removed BEFORE DELETE ON lens
  BEGIN SELECT RAISE(ABORT, 'lenses are never removed'); END;
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('lens',2);
COMMIT;
