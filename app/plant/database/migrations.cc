#include "app/plant/database/migrations.h"

namespace plumbline::plant {
namespace {

constexpr const char* kFirst = R"sql(
CREATE SCHEMA plumbline;
SET LOCAL search_path = plumbline;

CREATE TABLE schema_version (
  version int PRIMARY KEY, migrated timestamptz NOT NULL DEFAULT now()
);

CREATE TABLE cell (
  cell int GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  line text NOT NULL, node text NOT NULL,  -- GROUP and NODE of its topics
  name text, arm_model text, arm_series text, installed date,
  page text,             -- URL of the cell's own page
  version text,          -- of Plumbline
  birth bigint, death bigint,  -- bdSeq of the newest NBIRTH and NDEATH: UTC [ms] of the connection
  clean_shutdown boolean,
  waiting bigint,        -- messages queued at the cell at its newest NBIRTH
  first_received timestamptz NOT NULL DEFAULT now(), last_received timestamptz,
  state_utc timestamptz, state jsonb,  -- the newest NDATA, by its number
  state_stream bigint, state_seq bigint,
  health smallint,                     -- its `health`, see CellHealth
  model int,
  limited bigint NOT NULL DEFAULT 0,   -- messages refused because there were too many
  limited_reason text, limited_last timestamptz,
  UNIQUE (line, node)
);

-- What a cell declares and applies: cell.toml with the effects in force.
CREATE TABLE cell_file (
  cell int NOT NULL REFERENCES cell, utc timestamptz NOT NULL, fingerprint text NOT NULL,
  model int, toml text NOT NULL,
  PRIMARY KEY (cell, utc, fingerprint)
);

-- Which numbers of a cell's stream have arrived: all from first_seq to below next_seq, but for those
-- in `gap`.
CREATE TABLE stream (
  cell int NOT NULL REFERENCES cell, stream bigint NOT NULL,
  first_seq bigint NOT NULL, next_seq bigint NOT NULL,
  dropped bigint NOT NULL DEFAULT 0,          -- that the cell reports as dropped from its full queue
  given_up bigint NOT NULL DEFAULT 0,         -- missing, in the oldest of too many gaps
  first_received timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (cell, stream)
);
CREATE TABLE gap (
  cell int NOT NULL, stream bigint NOT NULL, first_seq bigint NOT NULL, last_seq bigint NOT NULL,
  noticed timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (cell, stream, first_seq),
  FOREIGN KEY (cell, stream) REFERENCES stream
);

-- Messages. The partitions are months of utc, created by ensure_month().
CREATE TABLE probe (
  cell int NOT NULL, stream bigint NOT NULL, seq bigint NOT NULL, utc timestamptz NOT NULL,
  journal bigint NOT NULL, id bigint NOT NULL,
  model int NOT NULL,
  x_mm float8, y_mm float8, z_mm float8,     -- measured
  dx_mm real, dy_mm real, dz_mm real, size_mm real,  -- residual: measured minus predicted
  payload_kg real, temp_c real,
  wild boolean NOT NULL, alarm boolean NOT NULL, quarantined boolean NOT NULL,
  source text NOT NULL, session text NOT NULL,
  q float8[],                                -- deg, mm where prismatic
  more jsonb,                                -- further columns of a row of measured.csv, by name
  PRIMARY KEY (cell, utc, stream, seq)
) PARTITION BY RANGE (utc);
CREATE TABLE alarm (
  cell int NOT NULL, stream bigint NOT NULL, seq bigint NOT NULL, utc timestamptz NOT NULL,
  word text NOT NULL, bit smallint NOT NULL, begins boolean NOT NULL, meaning text NOT NULL,
  PRIMARY KEY (cell, utc, stream, seq)
) PARTITION BY RANGE (utc);
CREATE TABLE model (
  cell int NOT NULL, stream bigint NOT NULL, seq bigint NOT NULL, utc timestamptz NOT NULL,
  model int NOT NULL, before int, declared int, proposed int,
  PRIMARY KEY (cell, utc, stream, seq)
) PARTITION BY RANGE (utc);
CREATE TABLE lens (
  cell int NOT NULL, stream bigint NOT NULL, seq bigint NOT NULL, utc timestamptz NOT NULL,
  camera text NOT NULL, lens text NOT NULL, reason text NOT NULL, lens_id bigint,
  zoom_counts bigint, board_views int,
  PRIMARY KEY (cell, utc, stream, seq)
) PARTITION BY RANGE (utc);
CREATE TABLE point (
  cell int NOT NULL, stream bigint NOT NULL, seq bigint NOT NULL, utc timestamptz NOT NULL,
  point int NOT NULL, name text NOT NULL, valid boolean NOT NULL, extrapolated boolean NOT NULL,
  code smallint NOT NULL, reason text NOT NULL,
  cx_mm real, cy_mm real, cz_mm real, correction_mm real,
  x_mm float8, y_mm float8, z_mm float8,     -- command
  uncertainty_mm real, basis text NOT NULL, model int NOT NULL,
  PRIMARY KEY (cell, utc, stream, seq)
) PARTITION BY RANGE (utc);

-- Sums of what arrived, so that questions across cells read one row a cell, day and model.
CREATE TABLE cell_day (
  cell int NOT NULL REFERENCES cell, day date NOT NULL, model int NOT NULL,
  probes bigint NOT NULL DEFAULT 0,          -- not in quarantine and not wild, with a residual
  wild bigint NOT NULL DEFAULT 0, quarantined bigint NOT NULL DEFAULT 0,
  sum_mm float8 NOT NULL DEFAULT 0,          -- of the sizes of residuals
  sum_mm2 float8 NOT NULL DEFAULT 0, max_mm real NOT NULL DEFAULT 0,
  sum_dx_mm float8 NOT NULL DEFAULT 0, sum_dy_mm float8 NOT NULL DEFAULT 0,
  sum_dz_mm float8 NOT NULL DEFAULT 0,
  alarms bigint NOT NULL DEFAULT 0,          -- that began
  states bigint NOT NULL DEFAULT 0, worst_health smallint NOT NULL DEFAULT 0,
  PRIMARY KEY (cell, day, model)
);
-- The newest state of every camera and point.
CREATE TABLE camera_now (
  cell int NOT NULL REFERENCES cell, camera text NOT NULL, utc timestamptz NOT NULL,
  lens text NOT NULL, reason text NOT NULL,
  PRIMARY KEY (cell, camera)
);

-- What could not be read: one row an hour, topic and reason, with the first message as example.
CREATE TABLE dead_letter (
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  received timestamptz NOT NULL DEFAULT now(),
  hour timestamptz NOT NULL DEFAULT date_trunc('hour', now(), 'UTC'),
  topic text NOT NULL, reason text NOT NULL,  -- at most 300 characters each
  messages bigint NOT NULL DEFAULT 1,
  bytes bigint NOT NULL, payload bytea NOT NULL,  -- at most its first 4096 bytes
  UNIQUE (hour, topic, reason)
);
-- Messages refused because a cell sent too many, counted by minute.
CREATE TABLE refused (
  cell int NOT NULL REFERENCES cell, minute timestamptz NOT NULL, reason text NOT NULL,
  messages bigint NOT NULL,
  PRIMARY KEY (cell, minute, reason)
);

-- Work for any number of machines.
CREATE TABLE job (
  job bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  kind text NOT NULL, cell int REFERENCES cell, arm_model text,
  version text NOT NULL DEFAULT '',          -- of the program that is to do it; empty: any
  key text NOT NULL,                         -- what makes it unique: cell, rows and version
  input jsonb NOT NULL DEFAULT '{}',
  created timestamptz NOT NULL DEFAULT now(),
  worker text, lease_until timestamptz, attempts int NOT NULL DEFAULT 0,
  finished timestamptz, failed text,
  UNIQUE (kind, key)
);
CREATE INDEX job_open ON job (job) WHERE finished IS NULL;
CREATE TABLE result (
  job bigint PRIMARY KEY REFERENCES job, worker text NOT NULL, utc timestamptz NOT NULL DEFAULT now(),
  program text NOT NULL,                     -- version of the program that did it
  seconds real NOT NULL, output jsonb NOT NULL
);
CREATE TABLE prior (
  arm_model text NOT NULL, utc timestamptz NOT NULL DEFAULT now(), arms int NOT NULL,
  file text NOT NULL,                        -- signed
  PRIMARY KEY (arm_model, utc)
);

-- What only the owner decides.
CREATE TABLE setting (
  retention_months int NOT NULL DEFAULT 24 CHECK (retention_months >= 0)  -- 0: all is kept
);
INSERT INTO setting DEFAULT VALUES;

-- Creates the partitions of the month of a time. Runs as the owner, for the collector. A table is
-- made by itself and then attached, which blocks neither readers nor writers of the others.
CREATE FUNCTION ensure_month(month_of timestamptz) RETURNS void
LANGUAGE plpgsql SECURITY DEFINER SET search_path = plumbline, pg_temp SET timezone = 'UTC'
SET lock_timeout = '5s' AS $$
DECLARE
  first timestamptz := date_trunc('month', month_of);
  parent text;
  name text;
BEGIN
  PERFORM pg_advisory_xact_lock(5066612);
  FOREACH parent IN ARRAY ARRAY['probe', 'alarm', 'model', 'lens', 'point'] LOOP
    name := parent || to_char(first, '_YYYY_MM');
    CONTINUE WHEN to_regclass(name) IS NOT NULL;
    EXECUTE format('CREATE TABLE %I (LIKE %I INCLUDING ALL)', name, parent);
    EXECUTE format('ALTER TABLE %I ATTACH PARTITION %I FOR VALUES FROM (%L) TO (%L)',
                   parent, name, first, first + interval '1 month');
  END LOOP;
END $$;

-- Drops what is older than the retention: partitions, sums, letters, superseded files of cells, and
-- finished jobs. Runs as the owner, for the collector. Returns the number of partitions.
CREATE FUNCTION drop_old() RETURNS int
LANGUAGE plpgsql SECURITY DEFINER SET search_path = plumbline, pg_temp SET timezone = 'UTC'
SET lock_timeout = '5s' AS $$
DECLARE
  months int := (SELECT retention_months FROM setting);
  oldest timestamptz := date_trunc('month', now()) - make_interval(months => months);
  part record;
  dropped int := 0;
BEGIN
  IF months = 0 THEN
    RETURN 0;
  END IF;
  FOR part IN
    SELECT child.relname AS name FROM pg_inherits
      JOIN pg_class child ON child.oid = inhrelid JOIN pg_class parent ON parent.oid = inhparent
      JOIN pg_namespace space ON space.oid = child.relnamespace
    WHERE space.nspname = 'plumbline'
      AND parent.relname IN ('probe', 'alarm', 'model', 'lens', 'point')
      AND to_timestamp(right(child.relname, 7), 'YYYY_MM') < oldest
  LOOP
    EXECUTE format('DROP TABLE %I', part.name);
    dropped := dropped + 1;
  END LOOP;
  DELETE FROM cell_day WHERE day < oldest;
  DELETE FROM dead_letter WHERE received < oldest;
  DELETE FROM refused WHERE minute < oldest;
  DELETE FROM cell_file f WHERE utc < oldest AND EXISTS (
    SELECT FROM cell_file newer WHERE newer.cell = f.cell AND newer.utc > f.utc);
  DELETE FROM result USING job WHERE result.job = job.job AND job.finished < oldest;
  DELETE FROM job WHERE finished < oldest;
  RETURN dropped;
END $$;

-- Rows of the page and of the report: one a cell.
CREATE VIEW cell_now AS
SELECT c.*,
       (birth IS NOT NULL AND (death IS NULL OR death < birth)) AS online,
       -- A cell that invents numbers must not overflow the sums.
       least(1e15, (SELECT coalesce(sum(last_seq - first_seq + 1), 0) FROM gap g
                    WHERE g.cell = c.cell) +
                   (SELECT coalesce(sum(given_up), 0) FROM stream s WHERE s.cell = c.cell))::bigint
         AS missing,
       least(1e15, (SELECT coalesce(sum(dropped), 0) FROM stream s WHERE s.cell = c.cell))::bigint
         AS dropped
FROM cell c;
)sql";

constexpr const char* kAll[] = {kFirst};

}  // namespace

std::span<const char* const> Migrations() {
  return kAll;
}

const char* const kRights = R"sql(
DO $$
DECLARE name text;
BEGIN
  FOREACH name IN ARRAY ARRAY['plumbline_collector', 'plumbline_reader', 'plumbline_worker'] LOOP
    IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = name) THEN
      EXECUTE format('CREATE ROLE %I NOLOGIN', name);
    END IF;
  END LOOP;
END $$;
REVOKE ALL ON SCHEMA plumbline FROM PUBLIC;
REVOKE EXECUTE ON ALL FUNCTIONS IN SCHEMA plumbline FROM PUBLIC;
GRANT USAGE ON SCHEMA plumbline TO plumbline_collector, plumbline_reader, plumbline_worker;
GRANT SELECT ON ALL TABLES IN SCHEMA plumbline TO plumbline_reader, plumbline_worker;
GRANT SELECT ON plumbline.schema_version, plumbline.setting TO plumbline_collector;
GRANT SELECT, INSERT, UPDATE ON plumbline.cell, plumbline.stream, plumbline.cell_day,
  plumbline.camera_now, plumbline.refused TO plumbline_collector;
GRANT SELECT, INSERT, DELETE ON plumbline.gap TO plumbline_collector;
GRANT SELECT, INSERT ON plumbline.probe, plumbline.alarm, plumbline.model, plumbline.lens,
  plumbline.point, plumbline.cell_file TO plumbline_collector;
GRANT SELECT, INSERT, UPDATE ON plumbline.dead_letter TO plumbline_collector;
GRANT EXECUTE ON FUNCTION plumbline.ensure_month, plumbline.drop_old
  TO plumbline_collector;
GRANT INSERT, UPDATE ON plumbline.job TO plumbline_worker;
GRANT INSERT ON plumbline.result, plumbline.prior TO plumbline_worker;
)sql";

}  // namespace plumbline::plant
