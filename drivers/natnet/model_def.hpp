// Reads the payload of a ModelDef: what the server calls its rigid bodies and skeletons.
//
// Little-endian; a text is its bytes and a zero, at most 1,023 of them.
//
//   i32 count, then each: i32 type, from 4.1 an i32: the size in bytes of what follows, and
//   0 marker set   text name, i32 count, count texts
//   1 rigid body   text name, i32 id, i32 parent, f32[3] offset [m],
//                  from 4.2: f32[4] rotation at rest,
//                  from 3.0: i32 count, count f32[3], count i32 labels, from 4.0: count texts
//   2 skeleton     text name, i32 id, i32 count, count rigid bodies (public
//                  descriptions do not agree whether these bones carry markers from 3.0 on, so
//                  both are tried)
//   3 force plate  i32 id, text serial number, f32[2] size, f32[3] origin, f32[144] calibration,
//                  f32[12] corners, i32 type, i32 kind of data, i32 count, count texts
//   4 device       i32 id, text name, text serial number, i32 type, i32 kind of data, i32 count,
//                  count texts
//   5 camera       text name, f32[3], f32[4]
//   others         from 4.1, skipped by their size, as are 3 to 5; before, an error
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "drivers/natnet/protocol.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"

namespace posed::drivers::natnet {

struct BoneDef {
  std::string name{};
  std::int32_t id = 0;
  std::int32_t parent = -1;  // id of the parent bone; of the root, an id that no bone has
  Vec3f offset_m{};          // in the server's axes
  std::size_t markers = 0;   // how many
};

struct BodyDef {
  std::string name{};
  std::int32_t id = 0;
  bool is_skeleton = false;
  std::vector<BoneDef> bones{};  // one for a rigid body
};

struct ModelDef {
  std::vector<BodyDef> bodies;
  // How many a marker set has, by its name.
  std::map<std::string, std::size_t, std::less<>> markers;
};

// Tries this version if it is known, then 3.0, 4.1, 4.2, 4.0 and 2.9: the first reading that uses
// up the payload exactly is taken; an error if none does. The bytes are untrusted; names are not
// checked for being text. Cold.
Result<ModelDef> parse_model_def(std::span<const std::byte> payload, Version version);

}  // namespace posed::drivers::natnet
