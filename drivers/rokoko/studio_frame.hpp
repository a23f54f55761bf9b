// One frame of Rokoko Studio's live stream, read from its JSON. Field names and units are those of
// the vendor's plugins for Blender and Unreal (rokoko-studio-live-blender: live_data_manager.py,
// animation_lists.py).
//
// Version 3:
//
//   {"version": 3 or "3.0", "fps": 60,
//    "scene": {"timestamp": 12.3,                    seconds
//              "actors": [ACTOR, ...], "props": [PROP, ...]}}
//
//   ACTOR  {"name": "Anna", "color": [...],
//           "meta": {"hasGloves", "hasLeftGlove", "hasRightGlove", "hasBody", "hasFace": bool},
//           "dimensions": {...},
//           "body": {"hip": JOINT, "spine": JOINT, ...},     joints.hpp has all names
//           "face": {"faceId": "...", "jawOpen": 0 to 100, ...}}
//   JOINT  {"position": {"x", "y", "z"}, "rotation": {"x", "y", "z", "w"}}
//   PROP   {"name": "Sword", "color": [...], "type": 0, "position": ..., "rotation": ...}
//
// Version 2 has no "scene": "timestamp", "actors" and "props" are at the top, beside "trackers"
// (like props) and "faces" ({"faceId", "profileName", "jawOpen": ...}). An actor's joints are in
// the actor itself, its "profileName" says whose face belongs to it. What Studio calls 2.5 says
// "version": 3 and is otherwise version 2: so the place of the actors counts, not the number.
//
// "JSON v4" says version "3,0" or 4 and has people in "scene" as lists of named joints, "newtons"
// (github.com/hit-wsw/hit-dex, README) or "characters" (the vendor's plugin for Unity,
// LiveFrame_v4). How their joints are turned in T-pose is not public, so they are refused.
//
// All positions [m] and rotations are global, in Unity's axes (joints.hpp).
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "drivers/rokoko/joints.hpp"
#include "proto/frame/frame.hpp"
#include "proto/frame/sink.hpp"

namespace posed::drivers::rokoko {

inline constexpr std::size_t kMaxSubjects = 32;   // actors, props, trackers and faces of a frame
inline constexpr std::size_t kMaxNameBytes = 64;  // longer ones are cut

class StudioName {
 public:
  // Takes a JSON string as it is written.
  RT_SAFE void set(std::string_view raw) noexcept;
  // Takes the bytes themselves.
  RT_SAFE void keep(std::string_view text) noexcept;
  // Adds " 2" or so, to tell apart what has one name.
  RT_SAFE void add_number(int number) noexcept;
  void clear() noexcept { size_ = 0; }
  [[nodiscard]] bool empty() const noexcept { return size_ == 0; }
  [[nodiscard]] std::string_view text() const noexcept { return {bytes_.data(), size_}; }
  friend bool operator==(const StudioName& a, const StudioName& b) noexcept {
    return a.text() == b.text();
  }

 private:
  std::array<char, kMaxNameBytes> bytes_{};
  std::size_t size_ = 0;
};

struct Subject {
  enum class Kind : std::uint8_t { kActor, kProp, kFace, kNone };

  Kind kind = Kind::kNone;
  StudioName name;
  StudioName profile;
  // Not said: version 2 has no "meta".
  bool has_body = true, has_left_glove = true, has_right_glove = true, has_face = true;
  bool valid = true;  // no joint is named twice, lies out of the room or is turned by no rotation
  JointSet placed;    // the position was sent
  JointSet turned;    // the rotation, too, and it is not all zero
  // [joint], of a prop [0]; global, in posed's axes
  std::array<Vec3f, kStudioJoints> position_m{};
  std::array<Quatf, kStudioJoints> rotation_xyzw{};
  std::bitset<kFaceValues> face_seen;
  std::array<float, kFaceValues> face{};  // 0 to 1
};

struct StudioFrame {
  double timestamp_s = 0.0;   // NaN when it was not sent
  bool named_joints = false;  // people of JSON v4 are in it
  std::size_t count = 0;
  std::array<Subject, kMaxSubjects> subjects;
};

// kOk: `frame` is filled. kForeign: not a frame of Studio, or of version 1. kShort: it is cut, is
// not JSON, or goes on after its end. kOutOfRange: too many subjects, or too deep.
RT_SAFE [[nodiscard]] Outcome read_studio_frame(std::string_view json, StudioFrame& frame) noexcept;

}  // namespace posed::drivers::rokoko
