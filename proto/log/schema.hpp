// The tables of a device log (drawn in proto/README.md) and how a file says that it is one.
#pragma once

#include <cstdint>

namespace posed::log {

inline constexpr std::int32_t kApplicationId = 0x504F5345;  // "POSE" in the SQLite header
inline constexpr std::int32_t kFormatVersion = 2;           // user_version; grows with the tables

// STRICT: a value of the wrong type cannot get in, so a reader need not ask each row.
inline constexpr const char* kSchema = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE stream(id INTEGER PRIMARY KEY, name TEXT NOT NULL, driver TEXT NOT NULL,
                    text TEXT NOT NULL, identity TEXT NOT NULL, config TEXT NOT NULL,
                    model TEXT NOT NULL) STRICT;
CREATE TABLE blob(sha256 TEXT PRIMARY KEY, bytes BLOB NOT NULL) STRICT;
CREATE TABLE chunk(id INTEGER PRIMARY KEY, stream INTEGER NOT NULL, direction INTEGER NOT NULL,
                   arrival_ns INTEGER NOT NULL, next_sequence INTEGER NOT NULL,
                   bytes BLOB NOT NULL) STRICT;
CREATE TABLE decision(id INTEGER PRIMARY KEY, stream INTEGER NOT NULL, kind INTEGER NOT NULL,
                      sequence INTEGER NOT NULL, count INTEGER NOT NULL, now_ns INTEGER NOT NULL,
                      alpha REAL NOT NULL, model_hash TEXT NOT NULL,
                      labels TEXT NOT NULL DEFAULT '') STRICT;
CREATE TABLE frame(id INTEGER PRIMARY KEY, stream INTEGER NOT NULL, sequence INTEGER NOT NULL,
                   raw INTEGER NOT NULL, bytes BLOB NOT NULL) STRICT;
CREATE TABLE gap(id INTEGER PRIMARY KEY, stream INTEGER NOT NULL, kind INTEGER NOT NULL,
                 after_chunk INTEGER NOT NULL, lost INTEGER NOT NULL,
                 time_ns INTEGER NOT NULL) STRICT;
CREATE INDEX decision_of_stream ON decision(stream);
CREATE INDEX frame_of_stream ON frame(stream, raw);
)sql";

}  // namespace posed::log
