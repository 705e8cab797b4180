PRAGMA application_id = 1347176017;
PRAGMA user_version = 2;
BEGIN TRANSACTION;
CREATE TABLE message (
  seq INTEGER PRIMARY KEY AUTOINCREMENT,
  kind INTEGER NOT NULL, importance INTEGER NOT NULL, utc_ms INTEGER NOT NULL, body TEXT NOT NULL
, acknowledgements INTEGER NOT NULL DEFAULT 0);
INSERT INTO "message" VALUES(1,3,1,1795260000000,'{"n":1}',1);
INSERT INTO "message" VALUES(2,4,2,1795260000124,'{"n":2}',0);
INSERT INTO "message" VALUES(3,5,2,1795260031500,'{"n":3}',0);
CREATE TABLE stream (
  id TEXT NOT NULL, memory TEXT NOT NULL,
  dropped_0 INTEGER NOT NULL, dropped_1 INTEGER NOT NULL, dropped_2 INTEGER NOT NULL
, repeated_ms INTEGER NOT NULL DEFAULT 0);
INSERT INTO "stream" VALUES('1d532e05','{"journal":1790000000,"id":120}',0,0,0,1795260030000);
CREATE INDEX by_importance ON message (importance, seq);
CREATE INDEX acknowledged ON message (seq) WHERE acknowledgements > 0;
DELETE FROM "sqlite_sequence";
INSERT INTO "sqlite_sequence" VALUES('message',3);
COMMIT;
