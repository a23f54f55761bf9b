// The tables of a device log (drawn in proto/README.md) and the marks that identify the file as
// one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "proto/log/rows.hpp"

namespace posed::log {

inline constexpr std::int32_t kApplicationId = 0x504F5345;  // "POSE" in the SQLite header
inline constexpr std::int32_t kFormatVersion = 4;  // user_version; increases when the tables change
inline constexpr std::int32_t kMinFormatVersion = 3;  // the oldest that is read

// STRICT: SQLite rejects values of the wrong type, so a reader need not check each row.
inline constexpr const char* kSchema = R"sql(
CREATE TABLE meta(key TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT;
CREATE TABLE source(id INTEGER PRIMARY KEY, name TEXT NOT NULL, driver TEXT NOT NULL,
                    text TEXT NOT NULL, identity TEXT NOT NULL, config TEXT NOT NULL,
                    crc INTEGER NOT NULL) STRICT;
CREATE TABLE stream(id INTEGER PRIMARY KEY, source INTEGER NOT NULL, body TEXT NOT NULL,
                    name TEXT NOT NULL, stages_json TEXT NOT NULL, first_item INTEGER NOT NULL,
                    crc INTEGER NOT NULL) STRICT;
CREATE TABLE blob(sha256 TEXT PRIMARY KEY, bytes BLOB NOT NULL) STRICT;
CREATE TABLE chunk(id INTEGER PRIMARY KEY, source INTEGER NOT NULL, socket INTEGER NOT NULL,
                   direction INTEGER NOT NULL, arrival_ns INTEGER NOT NULL,
                   first_item INTEGER NOT NULL, sequences BLOB NOT NULL, bytes BLOB NOT NULL,
                   crc INTEGER NOT NULL) STRICT;
CREATE TABLE decision(id INTEGER PRIMARY KEY, item INTEGER NOT NULL, stream INTEGER NOT NULL,
                      stage TEXT NOT NULL, name TEXT NOT NULL, value BLOB NOT NULL,
                      now_ns INTEGER NOT NULL, crc INTEGER NOT NULL) STRICT;
CREATE TABLE frame(id INTEGER PRIMARY KEY, stream INTEGER NOT NULL, sequence INTEGER NOT NULL,
                   raw INTEGER NOT NULL, bytes BLOB NOT NULL, crc INTEGER NOT NULL) STRICT;
CREATE TABLE gap(id INTEGER PRIMARY KEY, kind INTEGER NOT NULL, owner INTEGER NOT NULL,
                 after_chunk INTEGER NOT NULL, lost INTEGER NOT NULL, time_ns INTEGER NOT NULL,
                 crc INTEGER NOT NULL) STRICT;
CREATE TABLE take(id INTEGER PRIMARY KEY, name TEXT NOT NULL, first_item INTEGER NOT NULL,
                  last_item INTEGER NOT NULL, timecode TEXT NOT NULL, crc INTEGER NOT NULL) STRICT;
CREATE INDEX frame_of_stream ON frame(stream, raw);
)sql";

// The same for a format that is read: in format 3 a take has no timecode.
inline std::string schema_of(std::int32_t format) {
  constexpr std::string_view kTimecode = " timecode TEXT NOT NULL,";
  std::string tables = kSchema;
  if (format == 3) tables.erase(tables.find(kTimecode), kTimecode.size());
  return tables;
}

// The column `sequences` of a chunk: for each stream of its source {u32 stream id, u64 number of
// its next frame, u64 number of its next sample}, little-endian, one after the other.
//
// Both replace the content of `out`; the caller passes it in so that its memory is reused.
void pack_positions(std::span<const StreamPosition> places, std::vector<std::byte>& out);
// Returns false when the bytes are not a whole number of entries.
[[nodiscard]] bool unpack_positions(std::span<const std::byte> bytes,
                                    std::vector<StreamPosition>& out);

// Suffixes of the files that make up a log: SQLite keeps further files beside it while it is open,
// or after a crash.
inline constexpr std::array kFileSuffixes{"", "-wal", "-shm", "-journal"};

}  // namespace posed::log
