PRAGMA application_id = 1347176017;
PRAGMA user_version = 1;
BEGIN TRANSACTION;
CREATE TABLE message (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  kind INTEGER NOT NULL, importance INTEGER NOT NULL, utc_ms INTEGER NOT NULL, body TEXT NOT NULL
);
INSERT INTO "message" VALUES(2,4,2,1795260000124,'{"n":2}');
INSERT INTO "message" VALUES(3,5,2,1795260031500,'{"n":3}');
CREATE TABLE stream (
  id TEXT NOT NULL, memory TEXT NOT NULL,
  dropped_0 INTEGER NOT NULL, dropped_1 INTEGER NOT NULL, dropped_2 INTEGER NOT NULL
);
INSERT INTO "stream" VALUES('1d532e05','{"journal":1790000000,"id":120}',0,0,0);
CREATE INDEX by_importance ON message (importance, seq);
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('message',3);
COMMIT;
