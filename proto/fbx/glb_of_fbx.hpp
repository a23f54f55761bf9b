// A motion in FBX as .glb, which proto/clip reads. Only the program posed-fbx links this: assimp is
// too large to be trusted with files of strangers, so it works in a process of its own (confine()).
// Cold.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "proto/frame/result.hpp"

namespace posed::fbx {

// From now on this process can compute, read and write what is open, and end, but nothing else: no
// file, no network, no other process. Its memory (by the length of the file; 4 GB at most), its
// time (a minute of computing) and the depth of its calls have limits. Fails where the system does
// not allow to set them.
Result<> confine(std::size_t file_bytes);

// The bytes of a .glb with the nodes of an FBX file (text or binary), in metres with +Y up; its
// figure's nodes as joints of a skin: the bones of a mesh, otherwise the animated limbs; and its
// animations, with one row of times each, that of their keys where these are evenly spaced,
// otherwise the file's frames. The nodes rest where a mesh was bound to them, if one is. FBX builds
// the turn of a joint of up to nine parts, which become one here. The sentences about what is wrong
// name no file.
Result<std::string> glb_of_fbx(std::string_view bytes);

}  // namespace posed::fbx
