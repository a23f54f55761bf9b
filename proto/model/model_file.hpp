// The envelope of a model file: 8 bytes POSEDMDL, u32 version, u64 payload length, u32 CRC-32
// (zlib's) of the payload, all little-endian, then posed.v1.ModelFile (drawn in proto/README.md).
// Nothing of the bytes is believed before it is checked; what lies inside is checked by the model's
// own room. Cold.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>

#include "posed/v1/model.pb.h"
#include "proto/frame/result.hpp"

namespace posed::model_file {

// The payload of a whole model file. `name` is only for error messages. Whatever the bytes are: an
// Error, never a crash.
[[nodiscard]] Result<v1::ModelFile> open(std::span<const std::byte> bytes, const std::string& name);

// The whole file that holds `file`; the writer's version is filled in. The same model gives the
// same bytes.
[[nodiscard]] std::string seal(v1::ModelFile file);

// The largest model that is read, far above what `posed train` writes.
inline constexpr std::size_t kMaxModelFile = std::size_t{256} * 1024 * 1024;  // bytes

// A model file's bytes from and to the disk. Written whole or not at all; only a regular file of at
// most kMaxModelFile is read.
[[nodiscard]] Result<std::string> load(const std::filesystem::path& path);
[[nodiscard]] Result<> save(const std::string& bytes, const std::filesystem::path& path);

}  // namespace posed::model_file
